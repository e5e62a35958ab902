"""The recursive filters of ISO 18431-4 as they are printed (thesis, eq. 1.3 to 1.8): another form
of our recursion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pyroshock.array_types import Floats
from pyroshock.signals.srs.coefficients import Steps, steps


@dataclass(frozen=True, eq=False)
class RampInvariantFilter:
    """H(z) = (b0 + b1/z + b2/z^2) / (a0 + a1/z + a2/z^2): both (3, f), a0 = 1; `lfilter` of SciPy
    takes a column."""

    b: Floats
    a: Floats


def absolute_acceleration(
    omega_rad_s: Floats, time_step_s: float, damping_ratio: float
) -> RampInvariantFilter:
    """Base acceleration to absolute acceleration, eq. 1.4 to 1.8.

    1 - S / theta of eq. 1.4 is written as H + 2 zeta G / theta, which does not lose digits; so are
    the others.
    """
    step_values = steps(np.asarray(omega_rad_s * time_step_s), damping_ratio)
    rest = step_values.h + 2 * damping_ratio * step_values.g / step_values.theta
    b1 = 2 * (step_values.g + damping_ratio * step_values.s - rest)
    return RampInvariantFilter(
        np.stack([rest, b1, np.expm1(-2 * damping_ratio * step_values.theta) + rest]),
        _poles(step_values),
    )


def relative_displacement(
    omega_rad_s: Floats, time_step_s: float, damping_ratio: float
) -> RampInvariantFilter:
    """Base acceleration, m/s2, to displacement relative to the base, m."""
    step_values = steps(np.asarray(omega_rad_s * time_step_s), damping_ratio)
    held, slope = step_values.g - step_values.h, step_values.g / step_values.theta
    stay = 1 - step_values.g - 2 * damping_ratio * step_values.s
    b = np.stack(
        [
            step_values.h,
            held - stay * step_values.h + step_values.s * slope,
            step_values.s * (step_values.s - slope) - stay * held,
        ]
    )
    return RampInvariantFilter(-b / np.asarray(omega_rad_s) ** 2, _poles(step_values))


def _poles(step: Steps) -> Floats:
    cosine = 1 - step.g - step.damping_ratio * step.s
    return np.stack(
        [np.ones_like(cosine), -2 * cosine, np.exp(-2 * step.damping_ratio * step.theta)]
    )
