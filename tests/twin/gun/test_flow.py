"""Flow through an opening: the nozzle's figures, both ways, and next to nothing."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pyroshock.twin.gun.chambers import choked_flow, critical_ratio
from pyroshock.twin.gun.motion_kernel import ellipse, mass_flow
from pyroshock.twin.gun.shot import GAS_CONSTANT


def test_air_has_the_figures_of_the_books_and_isothermal_gas_their_limit():
    assert critical_ratio(1.4) == pytest.approx(0.5283, abs=5e-5)
    assert choked_flow(1.4) == pytest.approx(0.6847, abs=5e-5)
    for ratio in (1.0, 1 + 1e-12):
        assert critical_ratio(ratio) == pytest.approx(math.exp(-0.5), rel=1e-6)
        assert choked_flow(ratio) == pytest.approx(math.exp(-0.5), rel=1e-6)


def flow(here_pa, there_pa, here_k=300.0, there_k=400.0):
    area, gas, critical = 1e-4 * choked_flow(1.4), GAS_CONSTANT, critical_ratio(1.4)
    pairs = zip(np.atleast_1d(here_pa), np.atleast_1d(there_pa), strict=True)
    return np.array([mass_flow(area, p, gas * here_k, q, gas * there_k, critical) for p, q in pairs])


def test_flow_hangs_on_what_is_upstream_and_turns_with_the_pressures():
    expected = 1e-4 * 6e5 * choked_flow(1.4) / math.sqrt(GAS_CONSTANT * 300.0)
    np.testing.assert_allclose(flow([6e5, 6e5], [1e5, 3e5]), [expected] * 2, rtol=6e-4)
    assert flow(6e5, 1e5) == flow(6e5, 3e5)
    forth, back = flow([6e5, 2e5, 1e5], [1e5, 1.5e5, 1e5]), flow([1e5, 1.5e5, 1e5], [6e5, 2e5, 1e5], 400.0, 300.0)
    np.testing.assert_allclose(back, -forth, rtol=1e-14)
    assert forth[2] == 0.0
    mixed = flow([6e5, 1e5], [1e5, 6e5])
    assert mixed[1] == pytest.approx(-mixed[0] * math.sqrt(300 / 400))


def test_next_to_equal_pressures_it_is_laminar():
    """In proportion to the drop below 1e-5, with its root well above."""
    critical = critical_ratio(1.4)
    one, two = (ellipse(ratio, critical)[0] for ratio in (1 - 1e-7, 1 - 2e-7))
    assert two / one == pytest.approx(2, rel=1e-3)
    few, many = (ellipse(ratio, critical)[0] for ratio in (0.99, 0.96))
    assert many / few == pytest.approx(2, rel=0.05)
    assert one == pytest.approx(2e-7 / (1 - critical) / math.sqrt(1e-3), rel=1e-3)
