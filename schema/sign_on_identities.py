"""Who signs in through the identity provider of the laboratory: which account there is which user
here."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import CheckConstraint, ForeignKey, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column, relationship

from .base import Base, HasId, WithProvenance, names_row
from .users import User


class SignOnIdentity(HasId, WithProvenance, Base):
    """The account of a user at an identity provider (OpenID Connect Core 1.0, section 5.7: issuer
    and subject together, and nothing else, name a person for good).

    Without issuer and subject it is an invitation: the first account that signs in with this login
    becomes the user's.
    """

    __tablename__ = "sign_on_identities"
    __table_args__ = (
        # "whose account is this": each sign-in; an account is one user's
        UniqueConstraint("issuer", "subject"),
        CheckConstraint("(issuer IS NULL) = (subject IS NULL)", "issuer_with_subject"),
        CheckConstraint("(subject IS NULL) = (bound_at IS NULL)", "bound_with_subject"),
    )

    user_id: Mapped[int] = mapped_column(ForeignKey("users.id"), unique=True)
    #: "who was invited with this login": the first sign-in of an account
    login: Mapped[str] = mapped_column(unique=True, info=names_row("login"))
    issuer: Mapped[str | None]
    subject: Mapped[str | None]
    #: Whether the person was added for a group at the provider, whose role each sign-in renews.
    by_group: Mapped[bool] = mapped_column(default=False)
    invited_at: Mapped[datetime]
    bound_at: Mapped[datetime | None]
    user: Mapped[User] = relationship()
