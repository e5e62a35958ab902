"""Settings that look right and are not: near in level, but refused, outside of the model, or likely to overtest."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..setting import Setting
from .goal import Goal
from .probability import Proposal
from .search import Candidate

#: How near (dB, mean over the lines) a spectrum's level is to the goal's for a setting to look right.
NEAR_DB = 3.0
#: From this probability on a setting is said to overtest.
OVERTEST = 0.9
#: Of each kind, the nearest.
_EACH = 5


@dataclass(frozen=True)
class Avoid:
    """A setting not to fire, and why."""

    setting: Setting
    reason: str
    level_error_db: float


def avoided(
    outside: Sequence[Proposal], kept: Sequence[Proposal], refused: Sequence[Candidate], goal: Goal
) -> list[Avoid]:
    """The nearest of each kind: `outside` of the model's domain, likely to overtest of those `kept`, `refused`."""
    kinds = (_refused(refused, goal), _outside(outside, goal), _overtest(kept, goal))
    return [setting_to_avoid for kind in kinds for setting_to_avoid in _nearest(kind)]


def _nearest(found: Iterator[Avoid]) -> list[Avoid]:
    near = [candidate for candidate in found if abs(candidate.level_error_db) <= NEAR_DB]
    return sorted(near, key=lambda each: abs(each.level_error_db))[:_EACH]


def _refused(candidates: Sequence[Candidate], goal: Goal) -> Iterator[Avoid]:
    for candidate in candidates:
        error = float(np.mean(candidate.level_db - goal.level_db))
        yield Avoid(candidate.setting, f"beyond the bench: {'; '.join(candidate.refused)}", error)


def _outside(outside: Sequence[Proposal], goal: Goal) -> Iterator[Avoid]:
    for proposal in outside:
        error = float(np.mean(proposal.level_db - goal.level_db))
        yield Avoid(proposal.setting, f"outside of the model: {'; '.join(proposal.outside)}", error)


def _overtest(kept: Sequence[Proposal], goal: Goal) -> Iterator[Avoid]:
    """All but the first, which is the best there is even where it overtests."""
    for proposal in kept[1:]:
        over = proposal.level_db - goal.level_db - goal.upper_db
        line = int(np.argmax(over))
        if proposal.probability_overtest >= OVERTEST and over[line] > 0:
            words = f"{over[line]:.1f} dB above the upper edge at {goal.frequency_hz[line]:.0f} Hz expected"
            error = float(np.mean(proposal.level_db - goal.level_db))
            yield Avoid(proposal.setting, f"overtests: {words}", error)
