"""Static calibration of a transducer: points of reference and reading to a straight line with its
uncertainty.

Reading = offset + sensitivity x reference, by least squares with the uncertainties of both: the
exact solution for independent points by York, Evensen, López Martínez and De Basabe Delgado, Am. J.
Phys. 72 (2004) 367, which is the generalised distance regression of ISO/TS 28037:2010, clause 7.
Without any uncertainty it is ordinary least squares with variances from the residuals, as in the
GUM's example H.3 (JCGM 100:2008).
"""

from __future__ import annotations

import datetime as dt
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ..array_types import Floats

#: Fewer points leave no residual to judge the line by.
FEWEST_POINTS = 3
_MOST_ITERATIONS, _WITHIN = 200, 1e-14


@dataclass(frozen=True)
class Line:
    """reading = `offset` + `sensitivity` x reference, with standard uncertainties and the
    covariance of both.

    `residual_sd` is the standard deviation of the readings about the line. `chi_square` is None
    where no uncertainty was given. `enlarged` is the factor by which the points' own uncertainties
    had to grow to agree with the residuals (the Birge ratio, at least 1).
    """

    offset: float
    sensitivity: float
    offset_u: float
    sensitivity_u: float
    covariance: float
    residual_sd: float
    degrees_of_freedom: int
    chi_square: float | None = None
    enlarged: float = 1.0

    @property
    def correlation(self) -> float:
        return (
            self.covariance / (self.offset_u * self.sensitivity_u)
            if self.offset_u * self.sensitivity_u
            else 0.0
        )


def fit_line(
    reference: ArrayLike,
    reading: ArrayLike,
    reference_u: ArrayLike = 0.0,
    reading_u: ArrayLike = 0.0,
) -> Line:
    """The line through points (n,). `reference_u` and `reading_u` are standard uncertainties, for
    all or (n,).

    Raises `ValueError` for fewer than three points, references that are all alike, numbers that are
    not finite, uncertainties that are negative, and points without any beside points with one.
    """
    x, y = np.asarray(reference, dtype=np.float64), np.asarray(reading, dtype=np.float64)
    x_u, y_u = (
        np.broadcast_to(np.asarray(u, dtype=np.float64), x.shape) for u in (reference_u, reading_u)
    )
    _check(x, y, x_u, y_u)
    if not (x_u.any() or y_u.any()):
        return _ordinary(x, y)
    return _york(x, y, x_u**2, y_u**2)


def _check(x: Floats, y: Floats, x_u: Floats, y_u: Floats) -> None:
    if x.ndim != 1 or x.shape != y.shape or x.size < FEWEST_POINTS:
        raise ValueError(
            f"{x.size} references and {y.size} readings; expected as many of "
            f"both, {FEWEST_POINTS} or more"
        )
    if not all(np.all(np.isfinite(values)) for values in (x, y, x_u, y_u)):
        raise ValueError("a point of the calibration is not finite; expected numbers")
    if np.ptp(x) == 0:
        raise ValueError(f"all references are {x[0]:g}; expected different ones")
    if min(x_u.min(), y_u.min()) < 0:
        raise ValueError(f"an uncertainty is {min(x_u.min(), y_u.min()):g}; expected 0 or more")
    without = (x_u == 0) & (y_u == 0)
    if without.any() and not without.all():
        raise ValueError(
            f"point {int(np.argmax(without)) + 1} has no uncertainty and "
            f"others have one; state it for all"
        )


def _ordinary(x: Floats, y: Floats) -> Line:
    freedom = x.size - 2
    centre, spread = x.mean(), np.sum((x - x.mean()) ** 2)
    slope = float(np.sum((x - centre) * (y - y.mean())) / spread)
    offset = float(y.mean() - slope * centre)
    variance = float(np.sum((y - offset - slope * x) ** 2)) / freedom
    slope_v = variance / spread
    return Line(
        offset,
        slope,
        math.sqrt(variance / x.size + centre**2 * slope_v),
        math.sqrt(slope_v),
        float(-centre * slope_v),
        math.sqrt(variance),
        freedom,
    )


def _york(x: Floats, y: Floats, x_v: Floats, y_v: Floats) -> Line:
    """York's equations 13; x_v and y_v are variances."""
    slope = float(np.polyfit(x, y, 1)[0])
    for _ in range(_MOST_ITERATIONS):
        weight = 1 / (y_v + slope**2 * x_v)
        x_mean, y_mean = np.average(x, weights=weight), np.average(y, weights=weight)
        u, v = x - x_mean, y - y_mean
        beta = weight * (u * y_v + slope * v * x_v)
        new = float(np.sum(weight * beta * v) / np.sum(weight * beta * u))
        done, slope = abs(new - slope) <= _WITHIN * abs(new), new
        if done:
            break
    else:
        raise ValueError("the line does not settle; expected points that lie along one")
    offset = float(y_mean - slope * x_mean)
    adjusted = x_mean + beta
    centre = np.average(adjusted, weights=weight)
    slope_v = 1 / np.sum(weight * (adjusted - centre) ** 2)
    freedom = x.size - 2
    residual = y - offset - slope * x
    chi_square = float(np.sum(weight * residual**2))
    enlarged = max(1.0, math.sqrt(chi_square / freedom))
    return Line(
        offset,
        slope,
        enlarged * math.sqrt(1 / np.sum(weight) + centre**2 * slope_v),
        enlarged * math.sqrt(slope_v),
        float(-centre * slope_v) * enlarged**2,
        math.sqrt(float(np.sum(residual**2)) / freedom),
        freedom,
        chi_square,
        enlarged,
    )


@dataclass(frozen=True)
class Calibration:
    """A line from a channel's unit to volts, and when it was measured on how many points.

    `common_u` is a standard uncertainty, in the channel's unit, that all references share: that of
    the instrument which gave them. It moves the line as a whole and no number of points makes it
    smaller.
    """

    line: Line
    date: dt.date
    points: int
    common_u: float = 0.0

    def uncertainty(self, value: float) -> float:
        """Standard uncertainty of a value of the channel, in its unit, that comes from the
        calibration alone."""
        line = self.line
        variance = line.offset_u**2 + value**2 * line.sensitivity_u**2 + 2 * value * line.covariance
        return math.hypot(math.sqrt(max(variance, 0.0)) / abs(line.sensitivity), self.common_u)

    def as_json(self) -> dict[str, Any]:
        """What `from_json` reads back."""
        return {
            "date": self.date.isoformat(), "points": self.points, "common_u": self.common_u,
            "line": asdict(self.line)
        }  # fmt: skip

    @classmethod
    def from_json(cls, table: Mapping[str, Any]) -> Self:
        return cls(
            Line(**table["line"]),
            dt.date.fromisoformat(table["date"]),
            int(table["points"]),
            float(table["common_u"]),
        )
