"""How right a way of finding pulses is, where the truth is known. An impact is found where a pulse begins near it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .struck_records import Struck

NEAR_S = 5e-3


@dataclass(frozen=True)
class Seen:
    """A pulse as any way tells it."""

    start_s: float
    contact_time_s: float
    followed: bool


@dataclass(frozen=True)
class Score:
    """Of one record: impacts and second hits that were missed or made up, error of the contact time (rms, a share)."""

    miscounted: int
    misjudged: int
    error: float


def score(record: Struck, found: Sequence[Seen]) -> Score:
    starts = np.array([one.start_s for one in found])
    matched, errors, misjudged = set[int](), list[float](), 0
    for hit in record.hits:
        near = int(np.abs(starts - hit.start_s).argmin()) if starts.size else -1
        if near < 0 or abs(starts[near] - hit.start_s) > NEAR_S:
            misjudged += hit.followed
            continue
        matched.add(near)
        if not hit.chatters:
            errors.append(found[near].contact_time_s / hit.contact_time_s - 1)
            misjudged += found[near].followed != hit.followed
    wrong = len(record.hits) - len(matched) + len(found) - len(matched)
    return Score(wrong, misjudged, float(np.sqrt(np.mean(np.square(errors)))) if errors else float("inf"))


def share(wrong: float, peers: float) -> float:
    """Ours over the peer's; 1 where neither has any."""
    return wrong / peers if peers else 1.0 if wrong == 0 else float("inf")
