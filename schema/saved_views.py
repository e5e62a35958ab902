"""Views of the page that explores the store: what was asked, under the name that a person gave
it."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import CheckConstraint, Index, text
from sqlalchemy.orm import Mapped, mapped_column

from .base import Base, HasId, WithProvenance, names_row


class SavedView(HasId, WithProvenance, Base):
    """A question to the store with the name of its answer's chart. `request` is the JSON of the
    request; a deleted view keeps its row, so that it can be restored."""

    __tablename__ = "saved_views"
    __table_args__ = (
        CheckConstraint("length(name) > 0", "name_not_empty"),
        # "which view has this name": a deleted one leaves its name to others
        Index(
            "uq_saved_views_name",
            "name",
            unique=True,
            sqlite_where=text("deleted_at IS NULL"),
            postgresql_where=text("deleted_at IS NULL"),
        ),
    )

    name: Mapped[str] = mapped_column(info=names_row("view"))
    creator: Mapped[str | None]  # as the person wrote it; None where nobody said
    request: Mapped[dict[str, Any]]  # fields of `Exploration` that are not the default
    saved_at: Mapped[datetime]
    deleted_at: Mapped[datetime | None]
