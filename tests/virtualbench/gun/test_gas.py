"""Flow through holes, against the closed forms of gas dynamics."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pyroshock.virtualbench.gun.gas import (
    CHOKED,
    CP,
    CRITICAL_RATIO,
    CV,
    GAS_CONSTANT,
    Gas,
    exchange,
    gas_of,
    iso6358_flow,
    nozzle_flow,
)

AREA = 1e-4


def air(pressure_pa: float, temperature_k: float = 293.15) -> Gas:
    return Gas(pressure_pa, temperature_k, pressure_pa / (GAS_CONSTANT * temperature_k))


def test_choked_air_is_the_textbook_figure() -> None:
    """Fliegner's formula: 0.0404 sqrt(K) s/m times p A / sqrt(T)."""
    assert nozzle_flow(air(5e5), 0.2, AREA) == pytest.approx(0.0404 * 5e5 * AREA / math.sqrt(293.15), rel=1e-3)
    assert pytest.approx(0.5283, abs=1e-4) == CRITICAL_RATIO


def test_choked_flow_is_sonic_at_the_throat() -> None:
    """Mass flow by density and speed of sound at the throat, where T = 2 T0 / (gamma + 1)."""
    temperature = 293.15 * 2 / 2.4
    density = CRITICAL_RATIO * 5e5 / (GAS_CONSTANT * temperature)
    sonic = density * math.sqrt(1.4 * GAS_CONSTANT * temperature) * AREA
    assert nozzle_flow(air(5e5), 0.3, AREA) == pytest.approx(sonic, rel=1e-12)


@pytest.mark.parametrize("law", [nozzle_flow, lambda gas, ratio, area: iso6358_flow(gas, ratio, area, 0.35)])
def test_flow_falls_smoothly_with_the_ratio(law) -> None:
    ratios = np.linspace(0, 1 - 1e-9, 20_001)
    flow = np.array([law(air(2e5), ratio, AREA) for ratio in ratios])
    assert np.diff(flow).max() <= 1e-15
    assert np.all(flow[ratios < 0.34] == flow[0])
    assert flow[-1] < 1e-6 * flow[0]


def test_iso6358_is_choked_like_the_nozzle() -> None:
    assert iso6358_flow(air(5e5), 0.1, AREA, 0.35) == pytest.approx(nozzle_flow(air(5e5), 0.1, AREA), rel=1e-12)


def test_small_difference_is_bernoulli() -> None:
    gas = air(1.01e5)
    flow = nozzle_flow(gas, 0.98, AREA)
    assert flow == pytest.approx(AREA * math.sqrt(2 * gas.density * 0.02 * gas.pressure), rel=0.02)


def test_smallest_difference_is_laminar() -> None:
    flows = [nozzle_flow(air(1e5), 1 - apart, AREA) for apart in (1e-7, 2e-7)]
    assert flows[1] == pytest.approx(2 * flows[0], rel=1e-6)


def test_exchange_is_antisymmetric() -> None:
    high, low = air(2e5, 350.0), air(1.5e5, 290.0)
    there, back = exchange(high, low, nozzle_flow, AREA), exchange(low, high, nozzle_flow, AREA)
    assert there == (-back[0], -back[1])
    assert there[1] == pytest.approx(there[0] * CP * 350.0)


def test_equal_pressures_do_not_flow() -> None:
    assert exchange(air(1e5, 300.0), air(1e5, 280.0), nozzle_flow, AREA) == (0.0, 0.0)


def test_state_from_mass_and_energy() -> None:
    gas = gas_of(0.0114, 0.0114 * CV * 300.0, 9.5e-3)
    assert gas.temperature == pytest.approx(300.0)
    assert gas.pressure == pytest.approx(0.0114 * GAS_CONSTANT * 300.0 / 9.5e-3)
    assert gas_of(-1e-15, 0.0, 1e-3).pressure == 0.0


def test_choked_constant() -> None:
    assert pytest.approx(0.6847, abs=1e-4) == CHOKED
