"""Stretches of a record that stay at its extreme, and whether a smooth crest could have looked like
that.

Near its top a crest is a parabola. A stretch of L samples of it, watched m samples further out on
either side, has already fallen within itself by r = ((L - 1) / (L - 1 + 2m))**2 of the drop D seen
out there. A stretch whose own spread is far below r * D was cut. The quantisation step counts as
spread, so that a crest rounded to one code is no cut, however slow the signal; no other setting is
needed, and neither rate nor unit enters.

Short tops: a crest of a few samples that was cut, of which only one or two stand at the rail.

Three samples at one level are what `find_plateaus` finds. Two are told from a crest that was
sampled evenly by two things at once: they are equal to the converter's step, which is chance for a
crest that falls by many steps from one sample to the next; and what surrounds them is lopsided. A
smooth crest f whose two highest samples are equal is even about their middle: its neighbours differ
by its third derivative alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .levels import SampleRuns, Scale, run_heads, runs_of

#: Two equal neighbours straddle the top of any symmetric pulse; three need a cut, or a slow crest,
#: which `r` tells.
MIN_SAMPLES = 3
#: Spread allowed, as a share of what a parabola has. One rounded to a step q has r * D <= 2 q at
#: most, that is a share of 0.5 or more; two crests run together (fourth power at the top) have 0.44
#: or more from L = 5. Half of those.
MAX_SPREAD_SHARE = 0.25
#: Looked at this far out at least: the very next sample may have come back from the rail by a hair.
MIN_BESIDE = 2
#: Noise may press three or four samples of a crest into one step. Where that is likelier than this
#: (only runs at the very extreme are looked at, a few per record), the noise counts as spread.
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
    """Cut stretches of `x` (n,) within `band` of its maximum (`polarity` 1) or minimum (-1); None
    if there are none.

    Stretches that touch an end of the record are left out: a record may begin or end at rest, and
    only one side of it is known.
    """
    top, bottom = float(x.max()), float(x.min())
    level = top if polarity > 0 else bottom
    if abs(level - scale.rest) < MIN_DEVIATION_SHARE * max(top - scale.rest, scale.rest - bottom):
        return None
    at = np.flatnonzero(x >= level - band if polarity > 0 else x <= level + band)
    head, runs = run_heads(at), runs_of(at)
    spread = np.maximum(
        np.maximum.reduceat(x[at], head) - np.minimum.reduceat(x[at], head), scale.step
    )
    spread = np.where(
        _by_chance(runs.samples, spread, scale.noise), np.maximum(spread, scale.noise), spread
    )
    whole = (runs.samples >= min_samples) & (runs.first > 0) & (runs.last < x.size - 1)
    cut = runs.where(whole & _is_cut(x, level, runs, spread))
    return Plateaus(level, cut) if cut.first.size else None


def _by_chance(
    samples: NDArray[np.int64], spread: NDArray[np.float64], noise: float
) -> NDArray[np.bool_]:
    """Per run (k,): could noise on a crest have brought its samples so close together? It spreads
    them over 3 sigma."""
    closeness = np.minimum(spread / (3.0 * noise), 1.0) if noise > 0.0 else np.ones(samples.size)
    return np.asarray(closeness ** (samples - 1) > MAX_CHANCE)


def _is_cut(
    x: NDArray[np.float64], level: float, runs: SampleRuns, spread: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Per run (k,): is its spread too small for a parabola through what surrounds it?"""
    beside = np.maximum(MIN_BESIDE, -(-runs.samples // 4))
    before = np.abs(x[np.maximum(runs.first - beside, 0)] - level)
    after = np.abs(x[np.minimum(runs.last + beside, x.size - 1)] - level)
    share = ((runs.samples - 1) / (runs.samples - 1 + 2 * beside)) ** 2
    return np.asarray(spread < MAX_SPREAD_SHARE * share * np.minimum(before, after))


#: Chance of two equal samples, as the step's share of the fall beside them: crests in a thousand.
MAX_STEP_SHARE = 2e-3
#: Difference of the two neighbours, as a share of the larger fall. A half sine has 0, and an even
#: one none at all.
MIN_LOPSIDED = 0.2


def find_short_top(
    x: NDArray[np.float64], scale: Scale, polarity: int, band: float
) -> Plateaus | None:
    """The two samples at the maximum of `x` (n,) (`polarity` 1) or minimum (-1) that are a cut;
    None otherwise."""
    highest, lowest = float(x.max()), float(x.min())
    level = highest if polarity > 0 else lowest
    if polarity * (level - scale.rest) < MIN_DEVIATION_SHARE * max(
        highest - scale.rest, scale.rest - lowest
    ):
        return None
    at = np.flatnonzero(x >= level - band if polarity > 0 else x <= level + band)
    if at.size != 2 or at[1] != at[0] + 1 or at[0] == 0 or at[1] == x.size - 1:
        return None
    before, after = (polarity * (level - float(x[i])) for i in (at[0] - 1, at[1] + 1))
    fall = max(before, after)
    spread = max(abs(float(x[at[1]] - x[at[0]])), scale.step)
    if spread > MAX_STEP_SHARE * fall or abs(before - after) < max(
        MIN_LOPSIDED * fall, 3.0 * scale.noise
    ):
        return None
    return Plateaus(float(x[at[0]]), SampleRuns(at[:1], np.array([2], np.int64)))


def find_code_limit(recorded: NDArray[Any], polarity: int) -> NDArray[np.int64]:
    """Samples of whole numbers (n,) at the largest (`polarity` 1) or smallest (-1) that their type
    holds, which is the converter's end; empty for other types, and for one-byte counts, which hold
    states."""
    if recorded.dtype.kind != "i" or recorded.dtype.itemsize < 2:
        return np.empty(0, np.int64)
    info = np.iinfo(recorded.dtype)
    return np.flatnonzero(recorded == (info.max if polarity > 0 else info.min))
