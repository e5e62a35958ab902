"""The scores of one predicted quantity over all measured shots.

Measured values beside the draws that predicted them, value by value.

The share of measured values inside of a band, with an interval that knows that repetitions resemble
each other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...training.evaluation.summary import clustered, ensemble_crps

#: Quantiles that are kept of the draws; Hazen's, as the bands of a prediction (`prediction.Band`).
_QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


@dataclass(frozen=True, eq=False)
class ComparedValues:
    """n measured values and what was predicted of them; every array is (n,), all in one unit
    (logarithm or dB).

    `median` and the ends of the 50 and 90 % bands are of the draws. `rank` is the place of the
    measured value among the draws, from 0 to 1: its probability integral transform. `crps` is its
    continuous ranked probability score.
    """

    measured: Floats
    median: Floats
    low50: Floats
    high50: Floats
    low90: Floats
    high90: Floats
    rank: Floats
    crps: Floats

    @classmethod
    def of(cls, draws: Floats, measured: Floats) -> Self:
        """From draws (d, n) and measured values (n,). Raises `ValueError` for other shapes and
        values not finite."""
        crps = ensemble_crps(draws, measured)
        if not (np.isfinite(draws).all() and np.isfinite(measured).all()):
            raise ValueError(
                "draws and measured values must be finite: leave out what was not measured"
            )
        low90, low50, median, high50, high90 = np.quantile(
            draws, _QUANTILES, axis=0, method="hazen"
        )
        below = (draws < measured).sum(axis=0) + 0.5 * (draws == measured).sum(axis=0)
        # d draws part the line into d + 1 intervals that a further draw hits alike; the middle of
        # one is taken.
        rank = (below + 0.5) / (len(draws) + 1)
        return cls(measured, median, low50, high50, low90, high90, rank, crps)

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """The values of all parts, one part after the other."""
        return cls(
            *(np.concatenate([getattr(part, item.name) for part in parts]) for item in fields(cls))
        )

    def __len__(self) -> int:
        return len(self.measured)

    def take(self, rows: NDArray[np.intp] | NDArray[np.bool_]) -> Self:
        """Some of the values, by their rows."""
        return type(self)(*(getattr(self, item.name)[rows] for item in fields(self)))

    @property
    def residual(self) -> Floats:
        """Measured less the median of the prediction."""
        return self.measured - self.median

    @property
    def inside50(self) -> NDArray[np.bool_]:
        return (self.measured >= self.low50) & (self.measured <= self.high50)

    @property
    def inside90(self) -> NDArray[np.bool_]:
        return (self.measured >= self.low90) & (self.measured <= self.high90)

    @property
    def width90(self) -> Floats:
        """Of the 90 % band: the sharpness of the prediction."""
        return self.high90 - self.low90


#: The share of intervals that miss.
ERROR = 0.05


@dataclass(frozen=True)
class Coverage:
    """`share` of `values` measured values inside of a band. `effective` is the number of
    independent values that the share is as well known from; values of one configuration
    (repetitions, and lines of one spectrum) count as less than as many.
    """

    share: float
    values: int
    configurations: int
    effective: float

    @classmethod
    def of(cls, inside: NDArray[np.bool_], configuration: NDArray[np.intp]) -> Self:
        """Of values (n,) that lie inside or not, and the configuration (n,) of each. Raises
        `ValueError` for none."""
        groups = clustered(inside.astype(np.float64)[:, None], configuration)
        share = float(groups.mean[0])
        effective = _effective_number(groups.sums[:, 0] - share * groups.sizes, share, len(inside))
        return cls(share, len(inside), len(groups), effective)

    def interval(self, comparisons: int = 1) -> tuple[float, float]:
        """The 95 % interval of the share, exact for the binomial law of the effective number of
        values (Clopper and Pearson, Biometrika 26 (1934) 404; for clusters Korn and Graubard); so
        many `comparisons` share the 5 % of errors (Bonferroni).
        """
        from scipy.special import betaincinv

        hits, tail = self.share * self.effective, ERROR / (2 * comparisons)
        misses = self.effective - hits
        low = float(betaincinv(hits, misses + 1, tail)) if hits > 0 else 0.0
        return low, float(betaincinv(hits + 1, misses, 1 - tail)) if misses > 1e-9 else 1.0


def _effective_number(deviations: NDArray[np.float64], share: float, values: int) -> float:
    """How many independent values give a share of the same variance as k configurations do (Korn
    and Graubard, Survey Methodology 24 (1998) 193): p (1 - p) over k / (k - 1) times the sum of
    their squared `deviations` over n^2.

    Never more than the values. Where all are inside, or none is, nothing can be said of how alike
    repetitions are: then a configuration counts as a single value.
    """
    k = len(deviations)
    variance = k / (k - 1) * float(deviations @ deviations) / values**2 if k > 1 else 0.0
    if variance <= 0:
        return float(k)
    return min(float(values), share * (1 - share) / variance)


#: Bins of the probability-integral histogram, equally wide.
BINS = 10


@dataclass(frozen=True)
class Measure:
    """What is compared: `name` for programs, `words` for people ("peak force"), and the unit of
    errors and scores.

    `unit` is "ln" for natural logarithms of values, whose errors are near to shares, or "dB" (20
    log10). `quantity_unit` is the SI unit of the quantity itself.
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
    """Scores of a quantity over `shots` shots; widths, errors and `crps` are in the unit of the
    measure.

    `bias` is the mean of measured less predicted median, `sharpness` the median width of the 90 %
    band, `histogram` (10,) the share of ranks in each tenth: one tenth everywhere for bands that
    mean what they say.
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
        cls,
        measure: Measure,
        values: ComparedValues,
        shot: NDArray[np.intp],
        configuration: NDArray[np.intp],
    ) -> Self:
        """Of values (n,), with the shot (n,) and the configuration (n,) of each. Raises
        `ValueError` for no value."""
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
