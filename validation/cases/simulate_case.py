"""Plays the runs of a case in their order, with background and scatter."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from ...array_types import Floats
from .case import TOLERANCES, Case
from .designs import CaseSetting
from .gun_case import ln_reading, ln_truth, ln_velocity
from .heavy_tail import heavy
from .recording import recordings
from .runs import CaseRuns

#: Standard uncertainty of a velocity that is read, and a hand's scatter about its level.
READING_U, HAND_SPREAD = 0.003, 0.12


@dataclass(frozen=True, eq=False)
class Played:
    """One run as it is recorded; channels (n,) in SI."""

    setting: CaseSetting
    repetition: int
    velocity_m_s: float | None = None
    velocity_u_m_s: float | None = None
    channels: Mapping[str, Floats] = field(default_factory=dict)


def played(case: Case, seed: int) -> Iterator[Played]:
    """The runs of a case in their order."""
    runs = CaseRuns.of(case)
    rng = np.random.default_rng([seed, case.background.seed])
    true, read = _speeds(runs, rng)
    shown = (f"{v:.6g}" for v in read) if case.kind != "plate" else ("",) * len(runs.rows)
    recorded = [float(text) if text else None for text in shown]
    u = [READING_U * v if v and case.kind in ("gun", "chain") else None for v in recorded]
    channels = iter(recordings(runs, true, rng)) if case.kind != "gun" else ({} for _ in runs.rows)
    for (c, repetition), v, error, signals in zip(runs.rows, recorded, u, channels, strict=True):
        yield Played(runs.plan[c], int(repetition) + 1, v, error, signals)


def _speeds(runs: CaseRuns, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """True and recorded speeds (R,)."""
    case, count = runs.case, len(runs.rows)
    reading = READING_U * rng.standard_normal(count)
    acting = case.strengths, case.laws
    if case.kind in ("hammer", "plate"):
        ln_true = np.log([s.speed_m_s for s in runs.settings]) + HAND_SPREAD * rng.standard_normal(count)
        return np.exp(ln_true), np.exp(ln_true + ln_reading(runs.settings, ln_true, *acting) + reading)
    ln_read = ln_velocity(case.kind, case.design, *acting)[runs.which]
    scatter = max(runs.spread("gun") ** 2 - READING_U**2, 0.0) ** 0.5 * heavy(rng, count)
    added = runs.outside.ln_velocity(runs.settings, ln_read, runs.order)
    ln_read = ln_read + scatter + added + TOLERANCES["gun"] * runs.background(1, "gun")[:, 0]
    misread = added if runs.outside.family == "gun.velocity_warm_up" else 0.0
    return np.exp(ln_truth(runs.settings, ln_read - misread, *acting)), np.exp(ln_read + reading)
