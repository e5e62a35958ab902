"""Diagnoses of the sim-to-real gap, as they were reported and drawn, and versions of the twin's
configuration: the effects that a laboratory has adopted from them."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import CheckConstraint, ForeignKey
from sqlalchemy.orm import Mapped, mapped_column, relationship

from .base import Base, HasId, PlainJson, WithProvenance, names_row, positive
from .campaigns import Campaign


class Diagnosis(HasId, WithProvenance, Base):
    """One report on one campaign against one simulator."""

    __tablename__ = "diagnoses"

    campaign_id: Mapped[int] = mapped_column(ForeignKey("campaigns.id"), index=True)
    simulator: Mapped[str] = mapped_column(info=names_row("simulator"))
    diagnosed_at: Mapped[datetime]
    report: Mapped[dict[str, Any]]
    #: What the report leaves out and its page draws: 5 to 50 kB, which a listing does not read.
    #: None of a diagnosis that an earlier version made: its pages say to diagnose again.
    details: Mapped[dict[str, Any] | None] = mapped_column(
        PlainJson(none_as_null=True), deferred=True
    )
    campaign: Mapped[Campaign] = relationship()


class TwinVersion(HasId, WithProvenance, Base):
    """What one diagnosis left in the twin: the effects of the stages that it decides, none of them
    included.

    Versions are numbered through the laboratory. For each stage the newest version counts whose
    campaign had the same part there: its gun, its hammer, its plate.
    """

    __tablename__ = "twin_configurations"
    __table_args__ = (CheckConstraint(positive("version"), "version_positive"),)

    version: Mapped[int] = mapped_column(unique=True, info=names_row("version"))
    #: "which versions speak for this campaign": every prediction
    campaign_id: Mapped[int] = mapped_column(ForeignKey("campaigns.id"), index=True)
    diagnosis_id: Mapped[int | None] = mapped_column(ForeignKey("diagnoses.id"))
    adopted_at: Mapped[datetime]
    reason: Mapped[str]
    #: Keys of the twin's configuration as JSON: "effects", "sources"; and "stages", those that it
    #: decides.
    configuration: Mapped[dict[str, Any]]
    campaign: Mapped[Campaign] = relationship()
