"""The scores of one predicted quantity over all measured shots."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .compared_values import ComparedValues
from .coverage import Coverage

#: Bins of the probability-integral histogram, equally wide.
BINS = 10


@dataclass(frozen=True)
class Measure:
    """What is compared: `name` for programs, `words` for people ("peak force"), and the unit of errors and scores.

    `unit` is "ln" for natural logarithms of values, whose errors are near to shares, or "dB" (20 log10).
    `quantity_unit` is the SI unit of the quantity itself.
    """

    name: str
    words: str
    unit: str
    quantity_unit: str

    def level(self, values: Floats) -> Floats:
        """Values in the unit of the scores; NaN where a value is not positive."""
        with np.errstate(invalid="ignore", divide="ignore"):
            logarithm = np.log(np.where(values > 0, values, np.nan))
        return np.asarray(logarithm if self.unit == "ln" else 20 / math.log(10) * logarithm)

    def error_words(self, error: float) -> str:
        """An error of this unit for a person: "12 %" or "1.5 dB"."""
        return f"{error:.1f} dB" if self.unit == "dB" else f"{100 * math.expm1(error):.0f} %"

    def share(self, difference: float) -> float:
        """The factor that a difference stands for, less 1."""
        return math.expm1(difference if self.unit == "ln" else difference * math.log(10) / 20)


@dataclass(frozen=True, eq=False)
class QuantityScore:
    """Scores of a quantity over `shots` shots; widths, errors and `crps` are in the unit of the measure.

    `bias` is the mean of measured less predicted median, `sharpness` the median width of the 90 % band, `histogram`
    (10,) the share of ranks in each tenth: one tenth everywhere for bands that mean what they say.
    """

    measure: Measure
    shots: int
    coverage50: Coverage
    coverage90: Coverage
    crps: float
    median_abs_error: float
    bias: float
    sharpness: float
    histogram: Floats

    @classmethod
    def of(
        cls, measure: Measure, values: ComparedValues, shot: NDArray[np.intp], configuration: NDArray[np.intp]
    ) -> Self:
        """Of values (n,), with the shot (n,) and the configuration (n,) of each. Raises `ValueError` for no value."""
        counts = np.histogram(values.rank, bins=BINS, range=(0.0, 1.0))[0]
        return cls(
            measure=measure,
            shots=len(np.unique(shot)),
            coverage50=Coverage.of(values.inside50, configuration),
            coverage90=Coverage.of(values.inside90, configuration),
            crps=float(values.crps.mean()),
            median_abs_error=float(np.median(np.abs(values.residual))),
            bias=float(values.residual.mean()),
            sharpness=float(np.median(values.width90)),
            histogram=counts / counts.sum(),
        )

    def as_json(self) -> dict[str, Any]:
        """A row of `quantities` in `validate --json`."""
        return {
            "name": self.measure.name,
            "unit": self.measure.unit,
            "quantity_unit": self.measure.quantity_unit,
            "shots": self.shots,
            "configurations": self.coverage90.configurations,
            "values": self.coverage90.values,
            "effective_values": self.coverage90.effective,
            "coverage50": self.coverage50.share,
            "coverage50_ci95": list(self.coverage50.interval()),
            "coverage90": self.coverage90.share,
            "coverage90_ci95": list(self.coverage90.interval()),
            "crps": self.crps,
            "median_abs_error": self.median_abs_error,
            "bias": self.bias,
            "sharpness90": self.sharpness,
            "pit_histogram": self.histogram.tolist(),
        }
