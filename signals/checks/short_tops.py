"""Short tops: a crest of a few samples that was cut, of which only one or two stand at the rail.

Three samples at one level are what `plateaus` looks for. Two are told from a crest that was sampled evenly by two
things at once: they are equal to the converter's step, which is chance for a crest that falls by many steps from one
sample to the next; and what surrounds them is lopsided. A smooth crest f whose two highest samples are equal is even
about their middle: its neighbours differ by its third derivative alone.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .levels import Scale
from .plateaus import MIN_DEVIATION_SHARE, Plateaus
from .runs import SampleRuns

#: Chance of two equal samples, as the step's share of the fall beside them: crests in a thousand.
MAX_STEP_SHARE = 2e-3
#: Difference of the two neighbours, as a share of the larger fall. A half sine has 0, and an even one none at all.
MIN_LOPSIDED = 0.2


def find_short_top(x: NDArray[np.float64], scale: Scale, polarity: int, band: float) -> Plateaus | None:
    """The two samples at the maximum of `x` (n,) (`polarity` 1) or minimum (-1) that are a cut; None otherwise."""
    highest, lowest = float(x.max()), float(x.min())
    level = highest if polarity > 0 else lowest
    if polarity * (level - scale.rest) < MIN_DEVIATION_SHARE * max(highest - scale.rest, scale.rest - lowest):
        return None
    at = np.flatnonzero(x >= level - band if polarity > 0 else x <= level + band)
    if at.size != 2 or at[1] != at[0] + 1 or at[0] == 0 or at[1] == x.size - 1:
        return None
    before, after = (polarity * (level - float(x[i])) for i in (at[0] - 1, at[1] + 1))
    fall = max(before, after)
    spread = max(abs(float(x[at[1]] - x[at[0]])), scale.step)
    if spread > MAX_STEP_SHARE * fall or abs(before - after) < max(MIN_LOPSIDED * fall, 3.0 * scale.noise):
        return None
    return Plateaus(float(x[at[0]]), SampleRuns(at[:1], np.array([2], np.int64)))


def find_code_limit(recorded: NDArray[Any], polarity: int) -> NDArray[np.int64]:
    """Samples of whole numbers (n,) at the largest (`polarity` 1) or smallest (-1) that their type holds, which is the
    converter's end; empty for other types, and for one-byte counts, which hold states."""
    if recorded.dtype.kind != "i" or recorded.dtype.itemsize < 2:
        return np.empty(0, np.int64)
    info = np.iinfo(recorded.dtype)
    return np.flatnonzero(recorded == (info.max if polarity > 0 else info.min))
