"""A diagnosis deleted from the store, as long as the twin does not rest on it."""

from __future__ import annotations

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from ....schema.diagnoses import Diagnosis, TwinVersion
from .stored import get_diagnosis_row


class DiagnosisInUseError(ValueError):
    """A version of the twin was adopted from the diagnosis; the message names it."""


def check_diagnosis_unused(session: Session, key: int) -> str:
    """The campaign of a diagnosis that may be deleted. Raises `LookupError`,
    `DiagnosisInUseError`."""
    campaign = get_diagnosis_row(session, key).campaign.name
    versions = session.scalars(
        select(TwinVersion.version).where(TwinVersion.diagnosis_id == key)
    ).all()
    if versions:
        raise DiagnosisInUseError(
            f"diagnosis {key} cannot be deleted: version {', '.join(map(str, sorted(versions)))} "
            "of the twin was adopted from it, and the record of the twin names it; it is deleted "
            f"with its campaign {campaign!r} only"
        )
    return campaign


def delete_diagnosis(session: Session, key: int) -> None:
    """Delete a diagnosis. Raises as `check_diagnosis_unused`."""
    check_diagnosis_unused(session, key)
    session.execute(delete(Diagnosis).where(Diagnosis.id == key))
