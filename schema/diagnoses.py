"""Diagnoses of the sim-to-real gap, as they were reported and drawn."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey
from sqlalchemy.orm import Mapped, mapped_column, relationship

from .base import Base, HasId, PlainJson, Written
from .campaigns import Campaign


class Diagnosis(HasId, Written, Base):
    """One report on one campaign against one simulator."""

    __tablename__ = "diagnoses"

    campaign_id: Mapped[int] = mapped_column(ForeignKey("campaigns.id"), index=True)
    simulator: Mapped[str]
    diagnosed_at: Mapped[datetime]
    report: Mapped[dict[str, Any]]
    #: What the report leaves out and its page draws: 5 to 50 kB, which a listing does not read. None in stores
    #: that were filled before revision 0003.
    details: Mapped[dict[str, Any] | None] = mapped_column(PlainJson(none_as_null=True), deferred=True)
    campaign: Mapped[Campaign] = relationship()
