"""Over which configurations a gap that nothing explains may spread."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .creep import Creep
from .factors import each_level, smooth

Floats = NDArray[np.float64]

#: Ranges over factors scaled to [0, 1] (0: from configuration to configuration).
_LENGTHS = {"smooth": 0.8, "rough": 0.3, "each": 0.0}
#: What a level limits begins at these shares of the configurations.
_LIMITS = (0.25, 0.5, 0.7, 0.85)
SAME = "same"
#: A smaller difference of loudness, in logarithms, is none.
_ALIKE = 1e-6


@dataclass(frozen=True, eq=False)
class Course:
    """`root` (C, k): configurations have root root' in common, of variance 1 where the course touches them; but for
    a drift, whose mean over shuffled runs varies less. `within` (C, k): what each adds to `Creep.slope`.

    `name`: the "same" in all, "smooth" over the factors, "rough", from "each" configuration to the next, a "drift" over
    the order of runs, in one "level" of a factor alone, or beyond a "limit" of how loud a run is.
    """

    name: str
    root: Floats
    within: Floats | None = None


def courses(
    distance: Floats, creep: Creep, factors: Sequence[dict[str, str | float]], loudness: Floats
) -> list[Course]:
    """Of C configurations: `distance` (C, C) squared over the factors; `loudness` (C,)
    the logarithm of what the nominal simulator says a run is like, NaN where it has no answer."""
    over = {name: smooth(distance, length) if length else np.eye(len(distance)) for name, length in _LENGTHS.items()}
    found = [Course(SAME, np.ones((len(distance), 1)))]
    found += [Course(name, np.asarray(np.linalg.cholesky(one + 1e-6 * np.eye(len(one))))) for name, one in over.items()]
    found.append(Course("drift", creep.means, creep.within))
    found += [Course("level", inside.astype(np.float64)[:, None]) for inside in each_level(factors)]
    return found + [Course("limit", ramp[:, None]) for ramp in _ramps(loudness)]


def _ramps(loudness: Floats) -> list[Floats]:
    """(C,) each: nothing up to a level, and in proportion to the logarithm beyond: rails, valves, yield."""
    known = np.isfinite(loudness)
    if known.sum() < 3 or np.ptp(loudness[known]) < _ALIKE:
        return []
    found: list[Floats] = []
    for start in np.unique(np.quantile(loudness[known], _LIMITS)):
        ramp = np.where(known, np.nan_to_num(loudness) - start, 0.0)
        ramp[ramp < _ALIKE] = 0.0
        if (ramp > 0).sum() >= 2:
            found.append(ramp / np.sqrt((ramp[ramp > 0] ** 2).mean()))
    return found
