"""The response of one oscillator over time, for a plot: a spectrum keeps no series."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...array_types import Floats
from .coefficients import steps
from .spectrum import checked_damping, checked_lines, checked_rate, checked_records


@dataclass(frozen=True, eq=False)
class Response:
    """At each sample of the record, (n,): what the mass feels, and how far it is from its place on the base."""

    frequency_hz: float
    damping_ratio: float
    absolute_acceleration_m_s2: Floats
    relative_displacement_m: Floats


def oscillator_response(
    acceleration: Floats,
    sampling_rate_hz: float,
    frequency_hz: float,
    *,
    q: float | None = None,
    damping_ratio: float | None = None,
) -> Response:
    """Of one record (n,), m/s2, from rest. Q is 10 by default. Raises `ValueError` as a spectrum does."""
    from .kernel import run_series

    record, rate = checked_records(acceleration), checked_rate(sampling_rate_hz)
    if record.ndim != 1:
        raise ValueError(f"acceleration has shape {record.shape}: expected one record (n,)")
    zeta, omega = checked_damping(q, damping_ratio), 2 * np.pi * checked_lines([frequency_hz], rate)
    step_values = steps(omega / rate, zeta)
    series = np.empty((2, record.size))
    run_series(
        record,
        step_values.g[0],
        step_values.s[0],
        step_values.h[0],
        (step_values.g / step_values.theta)[0],
        2 * zeta,
        series,
    )
    p, v = series
    return Response(float(frequency_hz), zeta, p + 2 * zeta * v, -p / omega[0] ** 2)
