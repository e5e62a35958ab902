"""When a factor is taken for a wrong unit, and when only said to look like one."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from .finding import Finding, Severity
from .levels import Gap

#: A gap below this (nats) is not looked into: physics explains a factor of 1.9.
WORTH_A_LOOK = math.log(1.9)
#: Factors from here on are refused when they fit within `FIT`, the same within `SAME` in all configurations.
REFUSED_FROM, FIT, SAME = math.log(3.0), math.log(1.05), 0.10
#: Factors beyond any physics of a bench are refused by their order of magnitude.
BEYOND_PHYSICS, ORDER = math.log(20.0), math.log(2.5)
#: What is only named fits within `NEAR`, a factor below that within `NEAR_SMALL`: losses come on top of it.
NEAR, NEAR_SMALL, NEAR_SAME = 0.25, 0.10, 0.20
#: So many mistakes are named where several fit.
_NAMED = 3


@dataclass(frozen=True)
class Suspicion:
    """A mistake that would explain a gap. `shift`, in nats, is what it does to the reading, `left` what remains."""

    channel: str
    what: str
    shift: float
    left: Gap

    @property
    def severity(self) -> Severity | None:
        """None where it does not fit well enough to be said."""
        size, off, scatter = abs(self.shift), abs(self.left.centre), self.left.scatter
        if size >= BEYOND_PHYSICS and off <= ORDER:
            return "refuse"
        if size >= REFUSED_FROM and off <= FIT and scatter <= SAME:
            return "refuse"
        near = NEAR if size >= REFUSED_FROM else NEAR_SMALL
        return "name" if size >= WORTH_A_LOOK and off <= near and scatter <= NEAR_SAME else None


def fitting(tried: Iterable[Suspicion]) -> list[Suspicion]:
    """Those that fit, least remaining gap first; with a refusal among them only refusals."""
    found = sorted((one for one in tried if one.severity), key=lambda one: one.left.rms)
    worst = "refuse" if any(one.severity == "refuse" for one in found) else "name"
    return [one for one in found if one.severity == worst]


_REMEDY = {
    "force": "correct its unit or sensitivity in campaign.toml",
    "acceleration": "correct its unit or sensitivity in campaign.toml",
    "velocity": "correct its column in runs.csv, or the laser's channel in campaign.toml",
    "tank": "correct tank_pressure_bar in runs.csv, or the transducer's channel in campaign.toml",
    "sampling": "correct the rate that the recordings state in hertz",
}


def unit_finding(reads: str, stage: str, now: Gap, suspects: Sequence[Suspicion]) -> Finding:
    """`reads` is off by `now` from what `stage` gives; `suspects` fit, the likeliest first, all of one severity."""
    first = suspects[0]
    texts = list(dict.fromkeys(f"{one.channel}: {one.what}" for one in suspects))[:_NAMED]
    remedy = next(text for beginning, text in _REMEDY.items() if first.channel.startswith(beginning))
    message = (
        f"{reads} is {math.exp(now.centre):.3g} times what the {stage} can give ({now.scatter:.0%} scatter between "
        f"configurations), which a wrong unit does and physics hardly: is it {', or '.join(texts)}? {remedy}"
    )
    return Finding(first.severity or "name", first.channel, message)
