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
        """Gauge pressure in the tank, from the transducer's reading by which the operator sets
        it."""
        return reading_pa

    def measured_pressure_pa(self, pressure_pa: Floats) -> Floats:
        """What the transducer reads (Pa) of a gauge pressure in the tank. Of an empty tank it may
        read less than nothing, while `true_pressure_pa` is never below the atmosphere."""
        return pressure_pa

    def measured_velocity_m_s(self, velocity_m_s: Floats) -> Floats:
        """What the velocity measurement shows of a true velocity."""
        return velocity_m_s

    def true_velocity_m_s(self, reading_m_s: Floats) -> Floats:
        """The velocity under a reading, m/s; an effect on the velocity has its own inverse."""
        return reading_m_s

    def measured_force_n(self, force_n: Floats, dt_s: float) -> Floats:  # noqa: ARG002 - a hook
        """What the force channel shows of a true force (..., n), at rest before it."""
        return force_n

    def true_force_n(self, reading_n: Floats, dt_s: float) -> Floats:
        """The force under a reading (n,).

        By going back and forth, which closes in on the force where an effect changes it by less
        than itself.
        """
        if type(self).measured_force_n is SensorEffect.measured_force_n:
            return reading_n
        force_n = reading_n
        for _ in range(_ROUNDS):
            force_n = force_n + reading_n - self.measured_force_n(force_n, dt_s)
        return force_n

    # A hook.
    def measured_acceleration_m_s2(self, acceleration_m_s2: Floats, dt_s: float) -> Floats:  # noqa: ARG002
        """What an accelerometer's channel shows of a true acceleration (..., n), at rest before
        it."""
        return acceleration_m_s2

    # A hook.
    def measured_amplitude(self, amplitude: Complexes, poles: Complexes) -> Complexes:  # noqa: ARG002
        """What an accelerometer's channel shows of accelerations A exp(lambda t) with `poles`
        lambda (K,).

        Amplitudes A are (k, K), or (1, K) where they are common. Effects without a closed form
        leave them as they are.
        """
        return amplitude


def along_first(value: Value, series: Floats) -> Value:
    """A parameter ready to meet (..., n): an array (k,) gets axes after its own.

    `ValueError` for another k, and for one series of (n,): its axis is time.
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
    """(..., n) filtered from rest by `design(*parameters)`; parameters that are arrays (k,) go with
    the first axis.

    A filter is designed once for all rows that share its parameters. `ValueError` for arrays of
    another k.
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
