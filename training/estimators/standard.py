"""Means and widths of columns, for regressions that want their inputs and outputs near one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...array_types import Floats


@dataclass(frozen=True, eq=False)
class Standard:
    """Columns to mean 0 and standard deviation 1. `mean` and `width` are (d,); width 0 is a column that never varied.

    Such a column always becomes 0, whatever is asked later: nothing was learned about it.
    """

    mean: Floats
    width: Floats

    @classmethod
    def of(cls, columns: Floats) -> Standard:
        """From n x d. Rounding makes the deviation of a constant tiny, not 0: it counts as constant."""
        mean = columns.mean(axis=0)
        width = columns.std(axis=0)
        return cls(mean, np.where(width > 1e-12 * np.abs(mean), width, 0.0))

    def apply(self, columns: Floats) -> Floats:
        return (columns - self.mean) / np.where(self.width > 0, self.width, np.inf)

    def undo(self, columns: Floats) -> Floats:
        return columns * self.width + self.mean
