"""What every unmodelled effect of the sensors may change: between what happened and what a record
shows.

Recursive filters along the last axis, with parameters that may differ from row to row.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

import numpy as np

from ...array_types import Complexes, Floats
from ..effects import Effect, Value

#: Goings back and forth that undo an effect on the force without an inverse of its own.
_ROUNDS = 40


class SensorEffect(Effect):
    """An error of one channel. Hooks are identity unless an effect says otherwise.

    Series are (..., n) in equal steps of `dt_s`. A parameter that is an array (k,) goes with the
    first axis.
    """

    #: Where along the chain it acts, from the mount (0) over the sensing element (1) and its gain
    #: (2) to the rest (3).
    place: ClassVar[int] = 2

    def true_pressure_pa(self, reading_pa: Floats) -> Floats:
        """Gauge pressure in the tank, from the transducer's reading by which the operator sets it.

        Parameters:
            reading_pa: What the transducer reads, an array of any shape.
        """
        return reading_pa

    def measured_pressure_pa(self, pressure_pa: Floats) -> Floats:
        """What the transducer reads (Pa). Of an empty tank the reading may be negative, while
        `true_pressure_pa` is never below the atmosphere.

        Parameters:
            pressure_pa: Gauge pressures in the tank, an array of any shape.
        """
        return pressure_pa

    def measured_velocity_m_s(self, velocity_m_s: Floats) -> Floats:
        """What the velocity measurement shows.

        Parameters:
            velocity_m_s: True velocities, an array of any shape.
        """
        return velocity_m_s

    def true_velocity_m_s(self, reading_m_s: Floats) -> Floats:
        """The velocity under a reading, m/s; an effect on the velocity has its own inverse.

        Parameters:
            reading_m_s: What the velocity measurement shows, an array of any shape.
        """
        return reading_m_s

    def measured_force_n(self, force_n: Floats, dt_s: float) -> Floats:  # noqa: ARG002 - a hook
        """What the force channel shows, (..., n).

        Parameters:
            force_n: True forces (..., n) in equal steps; the channel is at rest before them.
            dt_s: Length of a step.
        """
        return force_n

    def true_force_n(self, reading_n: Floats, dt_s: float) -> Floats:
        """The force under a reading, (n,).

        It is found by iteration, which converges where an effect changes the force by less than
        itself.

        Parameters:
            reading_n: What the force channel shows (n,), in equal steps.
            dt_s: Length of a step.
        """
        if type(self).measured_force_n is SensorEffect.measured_force_n:
            return reading_n
        force_n = reading_n
        for _ in range(_ROUNDS):
            force_n = force_n + reading_n - self.measured_force_n(force_n, dt_s)
        return force_n

    # A hook.
    def measured_acceleration_m_s2(self, acceleration_m_s2: Floats, dt_s: float) -> Floats:  # noqa: ARG002
        """What an accelerometer's channel shows, (..., n).

        Parameters:
            acceleration_m_s2: True accelerations (..., n) in equal steps; the channel is at rest
                before them.
            dt_s: Length of a step.
        """
        return acceleration_m_s2

    # A hook.
    def measured_amplitude(self, amplitude: Complexes, poles: Complexes) -> Complexes:  # noqa: ARG002
        """What an accelerometer's channel shows of accelerations A exp(lambda t), as amplitudes.

        Effects without a closed form leave the amplitudes as they are.

        Parameters:
            amplitude: A (k, K) for k sensors, or (1, K) where they are common; complex.
            poles: lambda (K,), complex, 1/s.
        """
        return amplitude


def along_first(value: Value, series: Floats) -> Value:
    """A parameter ready to meet series: an array (k,) gets axes after its own.

    Parameters:
        value: The parameter, one number or an array (k,).
        series: Series (k, ..., n); for one number, of any shape.

    Raises:
        ValueError: For another k, and for an array with one series of (n,), whose axis is time.
    """
    if isinstance(value, float | int) or np.ndim(value) == 0:
        return float(value)
    if series.ndim < 2 or series.shape[0] != np.shape(value)[0]:
        raise ValueError(
            f"{np.shape(value)[0]} values of a parameter for series of shape {series.shape}"
        )
    return np.asarray(value).reshape(-1, *[1] * (series.ndim - 1))


#: One row's parameters to (b, a) of its filter.
Design = Callable[..., tuple[Floats, Floats]]


def filtered(series: Floats, design: Design, *parameters: Value) -> Floats:
    """Series filtered from rest, (..., n).

    A filter is designed once for all rows that share its parameters.

    Parameters:
        series: Series (..., n) in equal steps.
        design: Gives the coefficients (b, a) of the filter for the parameters of one row.
        parameters: What the design takes, one number each, or arrays (k,) that go with the first
            axis.

    Raises:
        ValueError: For arrays of another k.
    """
    from scipy.signal import lfilter

    if all(np.ndim(parameter) == 0 for parameter in parameters):
        return np.asarray(lfilter(*design(*map(float, parameters)), series, axis=-1))
    columns = [
        np.broadcast_to(np.ravel(along_first(parameter, series)), series.shape[:1])
        for parameter in parameters
    ]
    output, (different, which) = (
        np.empty(series.shape),
        np.unique(columns, axis=1, return_inverse=True),
    )
    for number, row in enumerate(different.T):
        alike = which.ravel() == number
        output[alike] = lfilter(*design(*map(float, row)), series[alike], axis=-1)
    return output
