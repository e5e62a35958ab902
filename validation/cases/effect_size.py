"""By how much a cause moves what a campaign shows."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from ...array_types import Floats
from .case import STAGES, TOLERANCES
from .cause import ActingCause
from .observable_shift import in_contact, in_gun, in_plate

_CHANGES = {"gun": in_gun, "contact": in_contact, "plate": in_plate}


def changes(kind: str, number: int, cause: ActingCause) -> dict[str, Floats]:
    """By stage (C, d): ln v; ln peak, impulse, width; dB at third octaves of each channel."""
    return {stage: changed_stage(stage, kind, number, cause) for stage in STAGES[kind]}


def changed_stage(stage: str, kind: str, number: int, cause: ActingCause) -> Floats:
    """(C, d) of one stage, in the unit of `TOLERANCES`."""
    return _CHANGES[stage](kind, number, cause)


def gaps(moved: Mapping[str, Floats]) -> dict[str, float]:
    """Root mean square of each stage's changes, in tolerances; infinite where there is no answer."""
    with np.errstate(invalid="ignore", over="ignore"):
        sizes = {stage: float(np.sqrt(np.mean(rows**2))) / TOLERANCES[stage] for stage, rows in moved.items()}
    return {stage: size if np.isfinite(size) else np.inf for stage, size in sizes.items()}


@lru_cache(maxsize=8192)
def gap(kind: str, number: int, cause: ActingCause) -> float:
    """The largest of the stages' gaps, in tolerances."""
    return max(gaps(changes(kind, number, cause)).values())
