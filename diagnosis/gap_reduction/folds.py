"""Which configurations are held out together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..localisation.rules import column_of, short_between
from ..record import Configuration

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

#: Folds by configuration; with fewer configurations each is held out alone.
FOLDS = 5
#: The part of the configurations that makes a corner, and the part beyond which it is cut down by another factor.
_CORNER, _LARGE = 0.25, 0.4
#: Configurations on either side.
_LEAST = 3


@dataclass(frozen=True, eq=False)
class Split:
    """`folds`: the configurations held out in turn. `name` as the report says it."""

    name: str
    folds: tuple[Rows, ...]

    @property
    def held_out(self) -> Rows:
        return np.concatenate(self.folds)


def by_configuration(rows: Rows, rng: np.random.Generator, folds: int = FOLDS) -> Split:
    """These configurations in turn, spread at random over the folds."""
    shuffled = rng.permutation(rows)
    parts = np.array_split(shuffled, min(folds, len(rows)))
    return Split("configuration", tuple(np.sort(part) for part in parts))


def corner(configurations: Sequence[Configuration], rows: Rows, size: Floats) -> Split | None:
    """About a quarter of the configurations, at one end of the numeric factor that the gap goes with most.

    `size` (C,) is how large the gap of each configuration is; the end is the one with the larger gap, where an
    extrapolation has the most to lose. Where that end is far more than a quarter (a factor of two levels) it is taken
    together with the end of the next factor. None where no number varies, or too few configurations would be left.
    """
    names = dict.fromkeys(name for row in rows for name in configurations[row].factors)
    tables = {name: [configurations[row].factors.get(name) for row in rows] for name in names}
    numbers = {
        k: np.array(v, dtype=np.float64) for k, v in tables.items() if all(isinstance(x, int | float) for x in v)
    }
    ends = [_end(name, values, size[rows]) for name, values in numbers.items() if len(np.unique(values)) > 1]
    ends.sort(key=lambda each: -each.influence)
    chosen = ends[:1]
    for other in ends[1:]:
        if np.mean(_inside(chosen)) > _LARGE and _inside([*chosen, other]).sum() >= _LEAST:
            chosen.append(other)
    if not chosen or not _LEAST <= _inside(chosen).sum() <= min(len(rows) // 2, len(rows) - _LEAST):
        return None
    return Split(f"corner: {' and '.join(each.text for each in chosen)}", (rows[_inside(chosen)],))


@dataclass(frozen=True, eq=False)
class _End:
    """One end of a factor, `influence` being how closely the gap goes with the factor."""

    text: str
    inside: NDArray[np.bool_]
    influence: float


def _inside(ends: Sequence[_End]) -> NDArray[np.bool_]:
    return np.asarray(np.all([each.inside for each in ends], axis=0))


def _end(name: str, values: Floats, size: Floats) -> _End:
    from scipy.stats import rankdata

    levels = np.unique(values)
    correlation = np.corrcoef(rankdata(values), rankdata(size))[0, 1] if np.ptp(size) > 0 else 0.0
    above = [values > level for level in levels[:-1]]
    candidates = above if correlation >= 0 else [~each for each in above]
    at = int(np.argmin([abs(np.mean(each) - _CORNER) for each in candidates]))
    column, unit = column_of(name)
    edge = short_between(levels[at] / unit, levels[at + 1] / unit)
    text = f"{column} {'>' if correlation >= 0 else '<='} {edge:g}"
    return _End(text, candidates[at], abs(float(correlation)))
