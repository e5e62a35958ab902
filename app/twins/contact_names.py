"""The names of contact models that a form offers."""

from __future__ import annotations

from sqlalchemy import select
from sqlalchemy.orm import Session

from ...schema.registered_models import RegisteredVersion
from ...twin.contact.laws import LAWS
from .building import PRIOR

#: More versions than these would hide the laws in a list; an older one can be typed in an address.
_MOST_VERSIONS = 50


def list_contact_names(session: Session) -> list[str]:
    """The prior, the laws of contact, then the registered versions, the newest first."""
    return [PRIOR, *LAWS, *list_version_labels(session)]


def list_version_labels(session: Session) -> list[str]:
    """Registered versions such as gp@1, the newest first."""
    labels = select(RegisteredVersion.label).order_by(RegisteredVersion.id.desc())
    return list(dict.fromkeys(session.scalars(labels.limit(_MOST_VERSIONS))))
