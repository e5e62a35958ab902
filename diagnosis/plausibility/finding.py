"""What a plausibility check says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Severity = Literal["name", "refuse"]


@dataclass(frozen=True)
class Finding:
    """A likely mistake. `message` names the thing, its value and the next step, in one line.

    `name`: worth a look, and said in the report. `refuse`: the record is not what it says, and is not diagnosed.
    """

    severity: Severity
    channel: str  # "force", "velocity", "tank_pressure", "acceleration_1", or a setting's name
    message: str


class ImplausibleRecordError(ValueError):
    """A campaign's record cannot be what it says; the message names channel, ratio, likely mistake and next step."""
