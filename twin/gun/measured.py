"""Measured muzzle velocities beside predicted ones: section 5.1 of the thesis.

Corner's relation between leakage and velocity (eq. 5.3): v / v_tight = (1 - psi)^0.7.

psi is 0 for a perfect seal and 1 for gas that all blows by. Source: Corner, Theory of the Interior Ballistics of Guns
(Wiley, 1950), as the thesis quotes it. The thesis puts psi of its gun between 0.4 and 0.6.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...array_types import Floats
from .bench import checked


def velocity_uncertainty_m_s(
    velocity_m_s: ArrayLike, bullet_length_m: ArrayLike, length_error_m: ArrayLike, time_error_s: ArrayLike
) -> Floats:
    """Eq. 5.2 for v = L / t, from the errors of L and t: sqrt((dL / t)^2 + (L dt / t^2)^2) (GUM, section 5.1.2)."""
    velocity = checked("velocity_m_s", velocity_m_s)
    time = checked("bullet_length_m", bullet_length_m) / velocity
    return np.asarray(np.hypot(np.asarray(length_error_m) / time, velocity * np.asarray(time_error_s) / time))


def percentage_error(measured: ArrayLike, predicted: ArrayLike) -> Floats:
    """Eq. 5.1, in percent of the measured value; negative where the prediction is too fast."""
    reading = np.asarray(measured, dtype=np.float64)
    return np.asarray((reading - np.asarray(predicted, dtype=np.float64)) / reading * 100)


@dataclass(frozen=True)
class VelocitySpread:
    """ln(measured / predicted) over `shots` shots: mean, and standard deviation about it."""

    log_mean: float
    log_sd: float
    shots: int


def velocity_spread(measured_m_s: ArrayLike, predicted_m_s: ArrayLike) -> VelocitySpread:
    """Of the shots that left the barrel in both. Raises `ValueError` for fewer than two of them, or other shapes."""
    measured, predicted = np.asarray(measured_m_s, dtype=np.float64), np.asarray(predicted_m_s, dtype=np.float64)
    if measured.shape != predicted.shape:
        raise ValueError(f"measured velocities have shape {measured.shape}, predicted ones {predicted.shape}")
    both = (measured > 0) & (predicted > 0)
    if both.sum() < 2:
        raise ValueError(f"{int(both.sum())} shots with both velocities: a spread needs two")
    ratio = np.log(measured[both] / predicted[both])
    return VelocitySpread(float(ratio.mean()), float(ratio.std(ddof=1)), int(both.sum()))


#: Thesis, Table 5.1, in m/s: measured, and predicted by eq. 2.16 with an efficiency of 0.5.
_MEASURED = (10.37, 11.87, 13.80, 16.35, 18.97)
_PREDICTED = (10.58, 11.35, 14.13, 16.98, 17.53)


def thesis_spread() -> VelocitySpread:
    """Of the thesis's five shots: 5 %, from so few that it is itself known to a third only."""
    return velocity_spread(_MEASURED, _PREDICTED)


_EXPONENT = 0.7


def corner_velocity_ratio(leakage: ArrayLike) -> NDArray[np.float64]:
    """v / v_tight for psi in [0, 1]. Raises `ValueError` naming the first value outside."""
    return np.asarray((1 - _share("leakage", leakage)) ** _EXPONENT)


def corner_leakage(velocity_ratio: ArrayLike) -> NDArray[np.float64]:
    """psi for v / v_tight in [0, 1], the efficiency of eq. 2.18 for example. Raises as the other way round."""
    return np.asarray(1 - _share("velocity_ratio", velocity_ratio) ** (1 / _EXPONENT))


def _share(name: str, value: ArrayLike) -> NDArray[np.float64]:
    values = np.asarray(value, dtype=np.float64)
    good = (values >= 0) & (values <= 1)
    if not np.all(good):
        raise ValueError(f"{name} = {float(values[~good].flat[0])!r}: expected 0 to 1")
    return values
