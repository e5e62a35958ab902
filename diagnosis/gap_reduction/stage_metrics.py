"""Further figures of a shrinkage, each before and after: by stage, in dB, and of pulses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...twin.effects import Effect
from ..localisation.means import Floats
from ..observables.base import Stage
from .folds import Split
from .gaps import Gaps

Pair = tuple[float, float]


def further(
    stages: Sequence[Stage],
    gaps: Gaps,
    split: Split,
    chosen: Sequence[Sequence[Effect]],
    correction: Floats,
    pulses: bool,
) -> dict[str, Pair]:
    """By name. Of held-out configurations only; `chosen` of each fold, `correction` (C, D) what they add."""
    rows = split.held_out
    found = {**_by_stage(gaps, rows, correction), **_levels(gaps, rows, correction)}
    if pulses:
        found |= _rated(stages, split, chosen)
    return found


def _by_stage(gaps: Gaps, rows: NDArray[np.intp], correction: Floats) -> dict[str, Pair]:
    """The same rms as the whole, of each stage alone."""
    found: dict[str, Pair] = {}
    names = [item.stage for item in gaps.observables]
    for name in dict.fromkeys(names):
        columns = np.flatnonzero(np.array(names) == name)
        part = gaps.mean[np.ix_(rows, columns)]
        if np.isfinite(part).any():
            left = part - correction[np.ix_(rows, columns)]
            found[f"rms of {name}"] = (_rms(part), _rms(left))
    return found


def _levels(gaps: Gaps, rows: NDArray[np.intp], correction: Floats) -> dict[str, Pair]:
    """Of lines of spectra, in dB: median and 95th percentile of the deviation, and the shares within 3 and 6 dB."""
    lines = np.flatnonzero([item.unit == "dB" and item.frequency_hz is not None for item in gaps.observables])
    if not lines.size:
        return {}
    scale = gaps.scale[np.isfinite(gaps.scale)][lines]
    before = np.abs(gaps.mean[np.ix_(rows, lines)] * scale)
    after = np.abs((gaps.mean - correction)[np.ix_(rows, lines)] * scale)
    if not np.isfinite(before).any():
        return {}
    pair = [each[np.isfinite(each)] for each in (before, after)]
    return {
        "dB, median": (float(np.median(pair[0])), float(np.median(pair[1]))),
        "dB, 95th percentile": (float(np.quantile(pair[0], 0.95)), float(np.quantile(pair[1], 0.95))),
        "share of lines within 3 dB": (float(np.mean(pair[0] <= 3)), float(np.mean(pair[1] <= 3))),
        "share of lines within 6 dB": (float(np.mean(pair[0] <= 6)), float(np.mean(pair[1] <= 6))),
    }


def _rated(stages: Sequence[Stage], split: Split, chosen: Sequence[Sequence[Effect]]) -> dict[str, Pair]:
    from .pulses import pulse_ratings

    ratings = pulse_ratings(stages, split.folds, chosen)
    return {} if ratings is None else {"ISO 18571 rating of the force": ratings}


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.nanmean(values**2)))
