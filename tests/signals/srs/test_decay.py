from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.signals.srs.coefficients import extremes

values = st.floats(-10, 10)


@given(values, values, st.floats(1e-6, 0.95))
def test_extremes_are_those_of_a_fine_series(start, slope, zeta):
    """1,200 points a turn: a peak falls between two by a share of 4e-6 at most."""
    delta = np.sqrt(1 - zeta**2)
    tau = np.linspace(0, 4 * np.pi / delta, 2401)
    series = np.exp(-zeta * tau) * (start * np.cos(delta * tau) + (slope + zeta * start) / delta * np.sin(delta * tau))
    largest, least = extremes(np.array([start]), np.array([slope]), zeta)
    size = np.hypot(start, (slope + zeta * start) / delta)
    for exact, sampled in ((largest[0], series.max()), (-least[0], -series.min())):
        assert -1e-12 * (1 + size) <= exact - sampled <= 2e-5 * size


def test_rest_stays_at_rest():
    largest, least = extremes(np.zeros(2), np.zeros(2), 0.05)
    assert not np.any(largest) and not np.any(least)
