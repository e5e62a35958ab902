"""How the predictors hang together (thesis, Fig. 4.8), and which values they took."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..array_types import Floats
from .table import Inputs


@dataclass(frozen=True, eq=False)
class Correlation:
    """Pearson's correlation of the predictors, `matrix` (d x d); NaN for one that never varied."""

    names: tuple[str, ...]
    matrix: Floats

    def as_json(self) -> dict[str, Any]:
        """Names and rows; what is not known is null."""
        rows = [[None if np.isnan(value) else float(value) for value in row] for row in self.matrix]
        return {"predictors": list(self.names), "correlation": rows}


def correlation(inputs: Inputs) -> Correlation:
    """Correlation over all rows. A category counts by the position of its level, as in the thesis."""
    x = inputs.x
    spread = np.ptp(x, axis=0) if len(x) else np.zeros(x.shape[1])
    varied = spread > 1e-12 * np.abs(x).max(axis=0, initial=0.0)
    matrix = np.full((x.shape[1], x.shape[1]), np.nan)
    # Scaled first: moduli of 1e11 Pa beside Poisson ratios lose digits otherwise.
    z = (x[:, varied] - x[:, varied].mean(axis=0)) / spread[varied]
    z /= np.sqrt((z**2).sum(axis=0))
    products = np.clip(z.T @ z, -1.0, 1.0)
    matrix[np.ix_(varied, varied)] = np.where(np.abs(products) < 1e-12, 0.0, products)
    return Correlation(tuple(predictor.name for predictor in inputs.predictors), matrix)


def ranges(inputs: Inputs) -> list[dict[str, Any]]:
    """One row per predictor: its unit, smallest and largest value, distinct values; of a category its level counts."""
    rows = []
    for predictor, column in zip(inputs.predictors, inputs.x.T, strict=True):
        row: dict[str, Any] = {"predictor": predictor.name, "unit": predictor.unit, "min": None, "max": None}
        row |= {"distinct": len(np.unique(column)), "levels": None}
        if predictor.levels:
            counts = {level: int((column == i).sum()) for i, level in enumerate(predictor.levels)}
            row["levels"] = counts
        else:
            row |= {"min": float(column.min()), "max": float(column.max())}
        rows.append(row)
    return rows
