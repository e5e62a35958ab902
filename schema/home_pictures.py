"""The pictures of the first page, as the laboratory has chosen and ordered them."""

from __future__ import annotations

from sqlalchemy import CheckConstraint, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from .base import Base, HasId, WithProvenance, names_row


class HomePictureRow(HasId, WithProvenance, Base):
    """A picture of the first page. A store without rows shows the usual pictures."""

    __tablename__ = "home_pictures"
    __table_args__ = (
        UniqueConstraint("picture"),
        UniqueConstraint("position"),
        CheckConstraint("length(picture) > 0", "picture_not_empty"),
        CheckConstraint("position > 0", "position_positive"),
    )

    picture: Mapped[str] = mapped_column(info=names_row("picture"))  # or "view NAME"
    position: Mapped[int]  # from 1
