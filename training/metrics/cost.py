"""The cost of a predicted pulse (thesis, eq. 5.4): how many of its elements miss a tolerance in time and force."""

from __future__ import annotations

import numpy as np

from ...array_types import Floats

#: Spreads of eq. 5.4: in time by the measured contact time, in force by the measured peak.
TIME_SPREAD, FORCE_SPREAD = 0.05, 0.1


def pulse_cost(measured_n: Floats, measured_time_s: Floats, predicted_n: Floats, predicted_time_s: Floats) -> Floats:
    """Cost (n,) from 0 for equal pulses to m for pulses without an element in common; forces n x m, times (n,).

    Element i of either time vector is i / (m - 1) of its contact time (linspace, section 4.2.2). As the thesis does
    not print its m, only ratios of costs compare with its Table 5.2.
    """
    phase = np.linspace(0.0, 1.0, measured_n.shape[1])
    late = (measured_time_s - predicted_time_s) / (TIME_SPREAD * measured_time_s)
    peak = measured_n.max(axis=1, keepdims=True)
    exponent = ((measured_n - predicted_n) / (FORCE_SPREAD * peak)) ** 2
    exponent += late[:, None] ** 2 * phase**2
    cost: Floats = -np.expm1(-exponent / 2).sum(axis=1)
    return cost
