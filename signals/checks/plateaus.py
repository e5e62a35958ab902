"""Stretches of a record that stay at its extreme, and whether a smooth crest could have looked like that.

Near its top a crest is a parabola. A stretch of L samples of it, watched m samples further out on either side, has
already fallen within itself by r = ((L - 1) / (L - 1 + 2m))**2 of the drop D seen out there. A stretch whose own spread
is far below r * D was cut. The quantisation step counts as spread, so that a crest rounded to one code is no cut,
however slow the signal; no other setting is needed, and neither rate nor unit enters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .levels import Scale
from .runs import SampleRuns, run_heads, runs_of

#: Two equal neighbours straddle the top of any symmetric pulse; three need a cut, or a slow crest, which `r` tells.
MIN_SAMPLES = 3
#: Spread allowed, as a share of what a parabola has. One rounded to a step q has r * D <= 2 q at most, that is a share
#: of 0.5 or more; two crests run together (fourth power at the top) have 0.44 or more from L = 5. Half of those.
MAX_SPREAD_SHARE = 0.25
#: Looked at this far out at least: the very next sample may have come back from the rail by a hair.
MIN_BESIDE = 2
#: Noise may press three or four samples of a crest into one step. Where that is likelier than this (only runs at the
#: very extreme are looked at, a few per record), the noise counts as spread.
MAX_CHANCE = 1e-4
#: An extreme nearer to the baseline than this share of the largest deviation is rest, not a rail.
MIN_DEVIATION_SHARE = 0.2


@dataclass(frozen=True)
class Plateaus:
    """The flat stretches at one rail, and its level in SI."""

    level: float
    runs: SampleRuns


def find_plateaus(
    x: NDArray[np.float64], scale: Scale, polarity: int, band: float, min_samples: int = MIN_SAMPLES
) -> Plateaus | None:
    """Cut stretches of `x` (n,) within `band` of its maximum (`polarity` 1) or minimum (-1); None if there are none.

    Stretches that touch an end of the record are left out: a record may begin or end at rest, and only one side of it
    is known.
    """
    top, bottom = float(x.max()), float(x.min())
    level = top if polarity > 0 else bottom
    if abs(level - scale.rest) < MIN_DEVIATION_SHARE * max(top - scale.rest, scale.rest - bottom):
        return None
    at = np.flatnonzero(x >= level - band if polarity > 0 else x <= level + band)
    head, runs = run_heads(at), runs_of(at)
    spread = np.maximum(np.maximum.reduceat(x[at], head) - np.minimum.reduceat(x[at], head), scale.step)
    spread = np.where(_by_chance(runs.samples, spread, scale.noise), np.maximum(spread, scale.noise), spread)
    whole = (runs.samples >= min_samples) & (runs.first > 0) & (runs.last < x.size - 1)
    cut = runs.where(whole & _is_cut(x, level, runs, spread))
    return Plateaus(level, cut) if cut.first.size else None


def _by_chance(samples: NDArray[np.int64], spread: NDArray[np.float64], noise: float) -> NDArray[np.bool_]:
    """Per run (k,): could noise on a crest have brought its samples so close together? It spreads them over 3 sigma."""
    closeness = np.minimum(spread / (3.0 * noise), 1.0) if noise > 0.0 else np.ones(samples.size)
    return np.asarray(closeness ** (samples - 1) > MAX_CHANCE)


def _is_cut(x: NDArray[np.float64], level: float, runs: SampleRuns, spread: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Per run (k,): is its spread too small for a parabola through what surrounds it?"""
    beside = np.maximum(MIN_BESIDE, -(-runs.samples // 4))
    before = np.abs(x[np.maximum(runs.first - beside, 0)] - level)
    after = np.abs(x[np.minimum(runs.last + beside, x.size - 1)] - level)
    share = ((runs.samples - 1) / (runs.samples - 1 + 2 * beside)) ** 2
    return np.asarray(spread < MAX_SPREAD_SHARE * share * np.minimum(before, after))
