"""What an ingest did, as the command line prints it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from ...schema.campaigns import Campaign
from ...schema.impacts import Impact, Shot
from ...schema.recordings import STORED, QualityFinding, RecordedChannel, Recording
from .shot_differences import campaign_differences

#: The check of a finding that says that a recording was discarded and is not stored again.
DISCARDED = "discarded"


@dataclass
class IngestReport:
    """Totals of the campaign as it now stands in the store, and what this ingest added to it."""

    campaign: str
    recordings: int = 0
    impacts: int = 0
    shots: int = 0
    set_aside: list[dict[str, str]] = field(default_factory=list)
    findings: list[dict[str, Any]] = field(default_factory=list)
    added: dict[str, int] = field(
        default_factory=lambda: {"recordings": 0, "impacts": 0, "shots": 0}
    )
    #: Facts that the stored campaign lacked: "bench.hammer.mass_kg = 0.32; boundary_conditions of
    #: 11 impacts".
    added_facts: str = ""
    #: Columns of runs.csv without a known meaning and without a declaration in campaign.toml.
    undeclared_factors: list[str] = field(default_factory=list)

    @property
    def added_words(self) -> str:
        """ "2 recordings, 5 impacts"."""
        return (
            ", ".join(f"{count} {noun}" for noun, count in self.added.items() if count)
            or "nothing new"
        )

    @property
    def total_words(self) -> str:
        return f"{self.recordings} recordings, {self.impacts} impacts, {self.shots} shots"

    def as_json(self) -> dict[str, Any]:
        """The form of the command line's contract."""
        return {
            "campaign": self.campaign,
            "recordings": self.recordings,
            "impacts": self.impacts,
            "shots": self.shots,
            "set_aside": self.set_aside,
            "findings": self.findings,
        }

    def sum_up(self, session: Session) -> None:
        """Totals and findings as they stand in the store.

        Parameters:
            session: A session of the store.
        """
        row = session.execute(
            select(Campaign.id, Campaign.kind).where(Campaign.name == self.campaign)
        ).one_or_none()
        campaign, kind = row or (None, None)
        stored = select(func.count()).where(
            Recording.campaign_id == campaign, Recording.status == STORED
        )
        self.recordings = session.scalar(stored) or 0
        self.impacts = (
            session.scalar(select(func.count()).where(Impact.campaign_id == campaign)) or 0
        )
        self.shots = session.scalar(select(func.count()).where(Shot.campaign_id == campaign)) or 0
        query = (
            select(
                Recording.path,
                RecordedChannel.name,
                QualityFinding.check,
                QualityFinding.severity,
                QualityFinding.message,
                QualityFinding.evidence,
            )
            .join(Recording, QualityFinding.recording_id == Recording.id)
            .outerjoin(RecordedChannel, QualityFinding.channel_id == RecordedChannel.id)
            .where(Recording.campaign_id == campaign)
            .order_by(QualityFinding.id)
        )
        keys = ("recording", "channel", "check", "severity", "message")
        for *values, evidence in session.execute(query):
            finding = dict(zip(keys, values, strict=True))
            if finding["channel"] is None:  # one that the recording lacks has no row
                finding["channel"] = evidence.get("channel")
            self.findings.append(finding)
        if campaign is not None and kind == "gun":
            for common in campaign_differences(session, campaign):
                finding = {
                    "check": common.check,
                    "severity": common.severity,
                    "message": common.message,
                }
                self.findings.append(
                    {"recording": None, "channel": common.channel or None} | finding
                )
        if self.added_facts:
            self.findings.append(
                {"recording": None, "channel": None, "check": "added-facts", "severity": "note"}
                | {"message": self.added_facts}
            )
