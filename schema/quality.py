"""Verdicts on recorded signals, each with its evidence."""

from __future__ import annotations

from typing import Any

from sqlalchemy import CheckConstraint, ForeignKey
from sqlalchemy.orm import Mapped, mapped_column

from .base import Base, HasId, Written, one_of

SEVERITIES = ("note", "warning", "reject")
#: What the listing says of an impact that no check has seen, because it has no recording.
NOT_JUDGED = "not judged"


class QualityFinding(HasId, Written, Base):
    """What a check said about a recording, one of its channels, or one impact in it."""

    __tablename__ = "quality_findings"
    __table_args__ = (CheckConstraint(one_of("severity", SEVERITIES), "severity_known"),)

    recording_id: Mapped[int] = mapped_column(ForeignKey("recordings.id"), index=True)
    channel_id: Mapped[int | None] = mapped_column(ForeignKey("channels.id"), index=True)
    impact_id: Mapped[int | None] = mapped_column(ForeignKey("impacts.id"), index=True)
    check: Mapped[str] = mapped_column(index=True)
    severity: Mapped[str]
    message: Mapped[str]
    evidence: Mapped[dict[str, Any]]
