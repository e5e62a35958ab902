"""Ratings of the force pulses after ISO/TS 18571, before and after a correction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...array_types import Rows
from ...twin.effects import Effect
from ...twin.iso18571 import pulse_rating
from ..observables.base import Stage
from ..observables.batching import at_rows
from ..observables.contact.residuals import pulse_residuals
from ..observables.contact.stage import ContactObservables


def pulse_ratings(
    stages: Sequence[Stage], folds: Sequence[Rows], effects_of_folds: Sequence[Sequence[Effect]]
) -> tuple[float, float] | None:
    """Mean ratings over one run of each held-out configuration; None without measured pulses.

    Records are aligned at half their peak, so that the rating is of size and shape and no trigger counts.
    """
    pairs: list[tuple[float, float]] = []
    for stage in [stage for stage in stages if isinstance(stage, ContactObservables)]:
        for held, effects in zip(folds, effects_of_folds, strict=True):
            contact = [effect for effect in effects if effect.id in stage.shows]
            before = _ratings(stage, held, ())
            pairs += zip(before, _ratings(stage, held, contact) if contact else before, strict=True)
    ratings = np.array(pairs).reshape(-1, 2)
    ratings = ratings[np.isfinite(ratings).all(axis=1)]
    return (float(ratings[:, 0].mean()), float(ratings[:, 1].mean())) if len(ratings) else None


def _ratings(stage: ContactObservables, held: Rows, effects: Sequence[Effect]) -> list[float]:
    """Of each held-out configuration that has a pulse: of its first run with a force and a velocity."""
    runs = stage.record.runs
    usable = [i for i, run in enumerate(runs) if run.force is not None and run.velocity_m_s]
    rows = sorted({runs[i].configuration: i for i in reversed(usable) if runs[i].configuration in held}.values())
    if type(stage) is ContactObservables and rows:  # a physical stage is cut down to these runs, a learned one is not
        stage = ContactObservables(replace(stage.record, runs=tuple(runs[i] for i in rows)))
        rows = list(range(len(rows)))
    if not rows:
        return []
    pulses = pulse_residuals(stage, at_rows(stage.acting(effects), stage.record.configuration_of))
    return [pulse_rating(pulses.measured[row], pulses.simulated[row]) for row in rows]
