"""What a check has found wrong in a store, and what to do about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

#: In this order a place is told; other keys follow.
_PLACE = ("campaign", "recording", "channel", "chunk", "table", "row")


@dataclass(frozen=True)
class IntegrityFinding:
    """`place` names what is concerned: campaign, recording, channel, chunk, table, row, or what else there is."""

    check: str
    message: str
    advice: str
    place: Mapping[str, Any] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        return {"check": self.check, **self.place, "message": self.message, "advice": self.advice}

    def __str__(self) -> str:
        keys = [key for key in _PLACE if key in self.place] + [key for key in self.place if key not in _PLACE]
        where = ", ".join(f"{key} {self.place[key]}" for key in keys)
        return f"{self.check}: {where}{': ' if where else ''}{self.message}; {self.advice}"
