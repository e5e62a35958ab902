"""Who wrote a row: one entry per command that changed the store."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy.orm import Mapped, mapped_column

from .base import Base, HasId


class Provenance(HasId, Base):
    """A run of the software that wrote something."""

    __tablename__ = "provenance"

    software_version: Mapped[str]
    command: Mapped[str]
    user: Mapped[str]
    host: Mapped[str]
    started_at: Mapped[datetime] = mapped_column()
