"""Which configurations are held out together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats, Rows
from ...doe.factor_rules import short_between
from ...schema.known_factors import column_of
from ..record import RunConfiguration

#: Folds by configuration; with fewer configurations each is held out alone.
_FOLDS = 5
#: The part of the configurations that makes a corner, and the part beyond which it is cut down by another factor.
_CORNER, _LARGE = 0.25, 0.4
#: Configurations on either side.
_LEAST = 3


@dataclass(frozen=True, eq=False)
class ConfigurationFolds:
    """`folds`: the configurations held out in turn. `name` as the report says it."""

    name: str
    folds: tuple[Rows, ...]

    @property
    def held_out(self) -> Rows:
        return np.concatenate(self.folds)


def by_configuration(rows: Rows, rng: np.random.Generator) -> ConfigurationFolds:
    """These configurations in turn, spread at random over the folds."""
    parts = np.array_split(rng.permutation(rows), min(_FOLDS, len(rows)))
    return ConfigurationFolds("configuration", tuple(np.sort(part) for part in parts))


def corner(configurations: Sequence[RunConfiguration], rows: Rows, size: Floats) -> ConfigurationFolds | None:
    """About a quarter of the configurations, at one end of the numeric factor that the gap goes with most.

    `size` (C,) is how large the gap of each configuration is; the end is the one with the larger gap, where an
    extrapolation has the most to lose. Where that end is far more than a quarter (a factor of two levels) it is taken
    together with the end of the next factor. None where no number varies, or too few configurations would be left.
    """
    names = dict.fromkeys(name for row in rows for name in configurations[row].factors)
    ends = []
    for name in names:
        values = [configurations[row].factors.get(name) for row in rows]
        if all(isinstance(value, int | float) for value in values) and len(set(values)) > 1:
            ends.append(_end(name, np.array(values, dtype=np.float64), size[rows]))
    texts: list[str] = []
    inside = np.ones(len(rows), dtype=bool)
    for text, part, _ in sorted(ends, key=lambda end: -end[2]):
        if not texts or (np.mean(inside) > _LARGE and (inside & part).sum() >= _LEAST):
            texts.append(text)
            inside &= part
    if not _LEAST <= inside.sum() <= min(len(rows) // 2, len(rows) - _LEAST):
        return None
    return ConfigurationFolds(f"corner: {' and '.join(texts)}", (rows[inside],))


def _end(name: str, values: Floats, size: Floats) -> tuple[str, NDArray[np.bool_], float]:
    """One end of a factor as a rule, the configurations in it, and how closely the gap goes with the factor."""
    from scipy.stats import spearmanr

    levels = np.unique(values)
    correlation = spearmanr(values, size).statistic if np.ptp(size) > 0 else 0.0
    above = [values > level for level in levels[:-1]]
    candidates = above if correlation >= 0 else [~part for part in above]
    nearest = int(np.argmin([abs(np.mean(part) - _CORNER) for part in candidates]))
    column, unit = column_of(name)
    edge = short_between(levels[nearest] / unit, levels[nearest + 1] / unit)
    return f"{column} {'>' if correlation >= 0 else '<='} {edge:g}", candidates[nearest], abs(float(correlation))
