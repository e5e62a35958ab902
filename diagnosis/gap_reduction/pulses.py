"""ISO 18571 ratings of the force pulses, before and after."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...twin.effects import Effect
from ..localisation.means import Floats
from ..observables.base import Stage
from ..observables.batching import at_rows
from ..observables.contact.residuals import pulse_residuals
from ..observables.contact.stage import ContactStage
from .iso18571 import rating

#: Samples to which a pulse is brought: its rating needs its shape, not its rate.
_SAMPLES = 256
#: A pulse and its surroundings: from before its rise to where the longest one has died out.
_QUIET = 0.01


def pulse_ratings(
    stages: Sequence[Stage], folds: Sequence[NDArray[np.intp]], chosen: Sequence[Sequence[Effect]]
) -> tuple[float, float] | None:
    """Mean ratings over one run of each held-out configuration; None without measured pulses.

    Records are aligned at half their peak, so that the rating is of size and shape and no trigger counts.
    """
    contact = next((stage for stage in stages if isinstance(stage, ContactStage)), None)
    if contact is None:
        return None
    before: list[float] = []
    after: list[float] = []
    for held, effects in zip(folds, chosen, strict=True):
        shown = [effect for effect in effects if effect.id in contact.shows]
        before += _ratings(contact, held, ())
        after += _ratings(contact, held, shown) if shown else before[len(after) :]
    both = np.array([before, after])
    rated = both[:, np.isfinite(both).all(axis=0)]
    return (float(rated[0].mean()), float(rated[1].mean())) if rated.size else None


def _ratings(stage: ContactStage, held: NDArray[np.intp], effects: Sequence[Effect]) -> list[float]:
    """Of each held-out configuration that has a pulse."""
    part, rows = _one_run_each(stage, held)
    if not rows:
        return []
    pulses = pulse_residuals(part, at_rows(effects, part.record.configuration_of))
    return [_rated(pulses.measured[row], pulses.simulated[row]) for row in rows]


def _one_run_each(stage: ContactStage, configurations: NDArray[np.intp]) -> tuple[ContactStage, list[int]]:
    """The first run of each configuration that has a force and a velocity; a physical stage is cut down to them."""
    runs = stage.record.runs
    usable = [i for i, run in enumerate(runs) if run.force is not None and run.velocity_m_s]
    first = {runs[i].configuration: i for i in reversed(usable) if runs[i].configuration in configurations}
    rows = sorted(first.values())
    if type(stage) is not ContactStage or not rows:
        return stage, rows
    return ContactStage(replace(stage.record, runs=tuple(runs[i] for i in rows))), list(range(len(rows)))


def _rated(measured: Floats, simulated: Floats) -> float:
    if not (np.isfinite(measured).all() and np.isfinite(simulated).all()):
        return float("nan")
    top = max(np.abs(measured).max(), np.abs(simulated).max())
    loud = np.flatnonzero(np.maximum(np.abs(measured), np.abs(simulated)) > _QUIET * top)
    if loud.size < 2:
        return float("nan")
    place = np.linspace(loud[0], loud[-1], _SAMPLES)
    at = np.arange(measured.size)
    return rating(np.interp(place, at, measured), np.interp(place, at, simulated))
