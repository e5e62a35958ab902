"""What an ingest did, as the command line prints it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any


@dataclass
class IngestReport:
    """Totals of the campaign as it now stands in the store, and what this ingest added to it."""

    campaign: str
    recordings: int = 0
    impacts: int = 0
    shots: int = 0
    set_aside: list[dict[str, str]] = field(default_factory=list)
    findings: list[dict[str, Any]] = field(default_factory=list)
    added: dict[str, int] = field(default_factory=lambda: {"recordings": 0, "impacts": 0, "shots": 0})

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
