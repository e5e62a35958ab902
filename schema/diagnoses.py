"""Diagnoses of the sim-to-real gap, as they were reported."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey
from sqlalchemy.orm import Mapped, mapped_column, relationship

from .base import Base, HasId, Written
from .campaigns import Campaign


class Diagnosis(HasId, Written, Base):
    """One report on one campaign against one simulator."""

    __tablename__ = "diagnoses"

    campaign_id: Mapped[int] = mapped_column(ForeignKey("campaigns.id"), index=True)
    simulator: Mapped[str]
    diagnosed_at: Mapped[datetime]
    report: Mapped[dict[str, Any]]
    campaign: Mapped[Campaign] = relationship()
