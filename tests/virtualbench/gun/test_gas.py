"""Flow through holes and the valve, friction of projectile and air column, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.gun.build import GunBuild, GunSetting, Projectile, setting_of
from pyroshock.virtualbench.gun.gas import (
    CHOKED,
    CP,
    CRITICAL_RATIO,
    CV,
    DEAD_SHARE,
    GAS_CONSTANT,
    RANGEABILITY,
    Gas,
    ValveWay,
    exchange,
    gas_of,
    iso6358_flow,
    nozzle_flow,
    open_share,
)
from pyroshock.virtualbench.gun.motion import column_loss, sliding_friction

AREA = 1e-4


def air(pressure_pa: float, temperature_k: float = 293.15) -> Gas:
    return Gas(pressure_pa, temperature_k, pressure_pa / (GAS_CONSTANT * temperature_k))


def test_choked_air_is_the_textbook_figure_and_small_differences_bernoulli() -> None:
    """Fliegner's formula, 0.0404 sqrt(K) s/m times p A / sqrt(T); mass flow by density and speed of
    sound at the throat, where T = 2 T0 / (gamma + 1)."""
    assert nozzle_flow(air(5e5), 0.2, AREA) == pytest.approx(
        0.0404 * 5e5 * AREA / math.sqrt(293.15), rel=1e-3
    )
    assert pytest.approx(0.5283, abs=1e-4) == CRITICAL_RATIO
    assert pytest.approx(0.6847, abs=1e-4) == CHOKED
    temperature = 293.15 * 2 / 2.4
    density = CRITICAL_RATIO * 5e5 / (GAS_CONSTANT * temperature)
    sonic = density * math.sqrt(1.4 * GAS_CONSTANT * temperature) * AREA
    assert nozzle_flow(air(5e5), 0.3, AREA) == pytest.approx(sonic, rel=1e-12)
    assert iso6358_flow(air(5e5), 0.1, AREA, 0.35) == pytest.approx(
        nozzle_flow(air(5e5), 0.1, AREA), rel=1e-12
    )
    gas = air(1.01e5)
    flow = nozzle_flow(gas, 0.98, AREA)
    assert flow == pytest.approx(AREA * math.sqrt(2 * gas.density * 0.02 * gas.pressure), rel=0.02)
    flows = [nozzle_flow(air(1e5), 1 - apart, AREA) for apart in (1e-7, 2e-7)]
    assert flows[1] == pytest.approx(2 * flows[0], rel=1e-6)


@pytest.mark.parametrize(
    "law", [nozzle_flow, lambda gas, ratio, area: iso6358_flow(gas, ratio, area, 0.35)]
)
def test_flow_falls_smoothly_with_the_ratio(law) -> None:
    ratios = np.linspace(0, 1 - 1e-9, 20_001)
    flow = np.array([law(air(2e5), ratio, AREA) for ratio in ratios])
    assert np.diff(flow).max() <= 1e-15
    assert np.all(flow[ratios < 0.34] == flow[0])
    assert flow[-1] < 1e-6 * flow[0]


def test_exchange_is_antisymmetric_and_state_is_of_mass_and_energy() -> None:
    high, low = air(2e5, 350.0), air(1.5e5, 290.0)
    there, back = exchange(high, low, nozzle_flow, AREA), exchange(low, high, nozzle_flow, AREA)
    assert there == (-back[0], -back[1])
    assert there[1] == pytest.approx(there[0] * CP * 350.0)
    assert exchange(air(1e5, 300.0), air(1e5, 280.0), nozzle_flow, AREA) == (0.0, 0.0)
    gas = gas_of(0.0114, 0.0114 * CV * 300.0, 9.5e-3)
    assert gas.temperature == pytest.approx(300.0)
    assert gas.pressure == pytest.approx(0.0114 * GAS_CONSTANT * 300.0 / 9.5e-3)
    assert gas_of(-1e-15, 0.0, 1e-3).pressure == 0.0


def test_port_opens_by_equal_percentage_from_nothing_to_all() -> None:
    shares = [open_share(turned) for turned in np.linspace(-0.1, 1.2, 131)]
    assert np.diff(shares).min() >= 0
    assert (shares[0], open_share(DEAD_SHARE), open_share(1.0), shares[-1]) == (0.0, 0.0, 1.0, 1.0)
    # IEC 60534-2-4: R^(h - 1) of the flow, here less what it leaves at h = 0, over the span of the
    # rest.
    travel = np.linspace(0, 1, 11)
    flows = np.array([open_share(DEAD_SHARE + h * (1 - DEAD_SHARE)) for h in travel])
    law = RANGEABILITY ** (travel - 1)
    np.testing.assert_allclose(flows, (law - law[0]) / (1 - law[0]), atol=1e-12)
    steps = np.diff(flows)
    np.testing.assert_allclose(steps[1:] / steps[:-1], RANGEABILITY**0.1, rtol=1e-9)


def test_kinks_are_where_the_port_begins_to_open_and_where_the_ball_turns_otherwise() -> None:
    valve = ValveWay((0.1, 0.5, 0.6, 0.8), (0.0, 1.0, 1.0, 0.1))
    begin, end = 0.1 + 0.4 * DEAD_SHARE, 0.6 + 0.2 * (1 - DEAD_SHARE) / 0.9
    assert valve.kinks_s == pytest.approx((0.1, begin, 0.5, 0.6, end, 0.8))
    for moment, opens in (
        (begin - 1e-9, False),
        (begin + 1e-3, True),
        (end - 1e-3, True),
        (end + 1e-9, False),
    ):
        assert (open_share(valve.position(moment)) > 0.0) is opens
    assert [valve.position(t) for t in (0.0, 0.3, 0.55, 0.7, 5.0)] == pytest.approx(
        [0.0, 0.5, 1.0, 0.55, 0.1]
    )
    for moments, positions in (
        ((), ()),
        ((0.0, 0.0), (0.0, 1.0)),
        ((0.0,), (1.2,)),
        ((-1.0,), (0.0,)),
        ((0.0, 1.0), (0.0,)),
    ):
        with pytest.raises(ValueError, match="expected rising moments"):
            ValveWay(moments, positions)


AIR = Gas(101_325.0, 293.15, 1.204)


def setting(effects: Effects) -> GunSetting:
    return setting_of(GunBuild(), effects, 1e5, Projectile(), np.random.default_rng(0))


def test_sliding_friction_is_coulombs_with_stribecks_hump_and_a_seal() -> None:
    """Odd, and through zero; the gas presses the seal from behind only."""
    assert sliding_friction(setting(Effects.none()), 1.0, 1e5) == pytest.approx(
        0.30 * 0.1428 * 9.80665
    )
    default = setting(Effects.default())
    assert sliding_friction(default, 0.0, 1e5) == 0.0
    assert sliding_friction(default, -0.3, 1e5) == -sliding_friction(default, 0.3, 1e5)
    figures = setting(Effects.only("gun.sliding_friction"))
    slow, fast = (sliding_friction(figures, velocity, 0.0) for velocity in (0.01, 1.0))
    assert slow - fast == pytest.approx(GunBuild().breakaway_force_n, rel=0.02)
    free, pressed, pulled = (sliding_friction(figures, 1.0, dp) for dp in (0.0, 1e5, -1e5))
    assert pressed - free == pytest.approx(0.02 * 1e5 * Projectile().area_m2)
    assert pulled == free


def test_column_loss_is_blasius_in_turbulent_flow_and_poiseuille_when_slow() -> None:
    figures = setting(Effects.only("gun.barrel_loss"))
    reynolds = 1.204 * 15.0 * 0.049 / 1.82e-5
    turbulent_pa = 0.3164 / reynolds**0.25 * 0.8 / 0.049 * 1.204 * 15.0**2 / 2
    laminar_pa = 32 * 1.82e-5 * 0.8 * 0.1 / 0.049**2
    for velocity, drop_pa in ((15.0, turbulent_pa), (0.1, laminar_pa)):
        assert column_loss(figures, velocity, AIR, 0.8, 0.0) == pytest.approx(
            drop_pa * Projectile().area_m2
        )
    twice = setting(Effects.only("gun.barrel_loss", 2.0))
    assert column_loss(twice, -15.0, AIR, 0.8, 0.5) == -column_loss(twice, 15.0, AIR, 0.8, 0.5)
    assert column_loss(setting(Effects.none()), 15.0, AIR, 0.8, 0.5) == 0.0
