"""Views that are stored by name: looked up, saved, renamed, deleted and restored."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from ....schema.saved_views import SavedView
from ..faults import UnknownValueError

#: So many names are told where one is not known.
_NAMED = 12


def list_view_rows(session: Session, *, deleted: bool = False) -> list[SavedView]:
    """The views that are in use by name, or those that were deleted, the last one first."""
    query = select(SavedView)
    if deleted:
        query = query.where(SavedView.deleted_at.is_not(None))
        return list(session.scalars(query.order_by(SavedView.deleted_at.desc(), SavedView.id)))
    query = query.where(SavedView.deleted_at.is_(None))
    return list(session.scalars(query.order_by(SavedView.name)))


def find_view(session: Session, name: str) -> SavedView | None:
    """The view of this name that is in use."""
    query = select(SavedView).where(SavedView.name == name, SavedView.deleted_at.is_(None))
    return session.scalars(query).one_or_none()


def get_view(session: Session, name: str, field: str = "view") -> SavedView:
    """The view of this name that is in use. Raises `LookupError` with the names that there are."""
    view = find_view(session, name)
    if view is None:
        names = [row.name for row in list_view_rows(session)]
        more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
        listed = ", ".join(names[:_NAMED]) or "none yet (pyroshock views save)"
        raise UnknownValueError(field, f"no view {name!r}; there are: {listed}{more}")
    return view


def add_view(
    session: Session, name: str, creator: str | None, request: Mapping[str, Any], *, replace: bool
) -> SavedView:
    """Store a view. One of the same name is deleted where it may be replaced. Raises `ValueError`
    where it may not."""
    existing = find_view(session, name)
    now = datetime.now(UTC)
    if existing is not None:
        if not replace:
            raise ValueError(
                f"name is {name!r}, which a view has already; expected another name, or replace"
            )
        existing.deleted_at = now
        session.flush()
    view = SavedView(name=name, creator=creator, request=dict(request), saved_at=now)
    session.add(view)
    session.flush()
    return view


def rename_view(session: Session, name: str, new_name: str) -> None:
    """Give a view another name. Raises `LookupError` for an unknown view, `ValueError` for a name
    that another view has."""
    view = get_view(session, name, "name")
    if new_name != name and find_view(session, new_name) is not None:
        raise ValueError(f"new_name is {new_name!r}, which a view has already; expected another")
    view.name = new_name


def delete_view(session: Session, name: str) -> None:
    """Take a view out of use; its row stays. Raises `LookupError` for an unknown view."""
    get_view(session, name, "name").deleted_at = datetime.now(UTC)


def restore_view(session: Session, name: str) -> None:
    """Take the view of this name that was deleted last into use again. Raises `LookupError` where
    none was deleted, `ValueError` where another view has the name meanwhile."""
    deleted = [row for row in list_view_rows(session, deleted=True) if row.name == name]
    if not deleted:
        raise UnknownValueError("name", f"no deleted view {name!r}; see pyroshock views --deleted")
    if find_view(session, name) is not None:
        raise ValueError(
            f"name is {name!r}, which another view has meanwhile; rename that view first: "
            "pyroshock views rename"
        )
    deleted[0].deleted_at = None
