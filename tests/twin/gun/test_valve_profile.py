"""Valves that open and close by a profile: limits, and balances written out anew."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from pyroshock.signals.valve_profile import ValveProfile
from pyroshock.twin.effects import effect
from pyroshock.twin.gun.shot import GunEffect, Instant, ShotInputs
from pyroshock.twin.gun.shots import Status, gun_velocity
from pyroshock.twin.gun.stage import GunStage
from pyroshock.twin.sensors.chain import SensorChain
from pyroshock.twin.setting import ElasticMaterial, Setting
from support.records.scalar_gun import THESIS_GUN as BENCH
from support.records.scalar_gun import scalar_guns

CLOSING = ValveProfile.parse("0:0,0.1:1,0.12:1,0.16:0")


@pytest.mark.parametrize(
    ("profile", "pressure_pa", "mass_kg"),
    [
        (ValveProfile.parse("0:0,0.1:1"), 4e5, 0.5),
        (CLOSING, 4e5, 0.5),
        (
            ValveProfile.parse("0:0,0.03:0.2,0.06:0.2,0.07:0"),
            6e5,
            1.0,
        ),  # shut long before it leaves
        (
            ValveProfile.parse("0:0,0.05:0.3,0.1:0,0.4:0,0.5:1"),
            1e5,
            0.2,
        ),  # a valve that opens twice
    ],
)
def test_velocity_is_that_of_the_balances(
    profile: ValveProfile, pressure_pa: float, mass_kg: float
) -> None:
    valve = effect("gun.valve_flow", loss_coefficient=20.0)
    (alone,) = scalar_guns(BENCH, np.array([pressure_pa]), np.array([mass_kg]), [valve])
    alone.profile = profile
    velocity = alone.velocity("LSODA", 1e-10)
    shots = gun_velocity(BENCH, pressure_pa, mass_kg, [valve], valve_profiles=[profile])
    assert shots.velocity_m_s[0] == pytest.approx(velocity, rel=2e-5)
    assert shots.exit_time_s[0] == pytest.approx(alone.exit_s, rel=2e-5)


def test_wide_open_valves_are_none_closed_ones_keep_the_projectile_and_profiles_are_times() -> None:
    pressure, mass = np.array([0.5e5, 2e5, 6e5]), np.array([0.1428, 0.5, 1.0])
    wide = effect("gun.valve_flow", loss_coefficient=1e-4)
    shots = gun_velocity(
        BENCH, pressure, mass, [wide], valve_profiles=[ValveProfile.parse("0:1")] * 3
    )
    np.testing.assert_allclose(
        shots.velocity_m_s, gun_velocity(BENCH, pressure, mass).velocity_m_s, rtol=1e-3
    )
    # Without a volume behind the valve only its own passage, a ten-thousandth of the tank, could
    # push; with one the pressure there is the atmosphere's, and nothing moves at all.
    closed = [
        effect("gun.valve_flow", loss_coefficient=1.0),
        effect("gun.dead_volume", volume_m3=5e-3),
    ]
    shots = gun_velocity(
        BENCH, [2e5, 8e5], 0.5, closed, valve_profiles=[ValveProfile.parse("0:0")] * 2
    )
    assert shots.velocity_m_s.tolist() == [0.0, 0.0]
    assert not shots.left.any()
    pressure = np.array([1e5, 4e5, 8e5])
    by_time = effect("gun.valve_flow", loss_coefficient=5.0, opening_time_s=0.13)
    other = effect("gun.valve_flow", loss_coefficient=5.0, opening_time_s=0.4)
    profiles = [ValveProfile.of_controller(0.13)] * 3
    shots = gun_velocity(BENCH, pressure, 0.5, [other], valve_profiles=profiles)
    np.testing.assert_array_equal(
        shots.velocity_m_s, gun_velocity(BENCH, pressure, 0.5, [by_time]).velocity_m_s
    )
    full_bore = gun_velocity(BENCH, 4e5, 0.5, [effect("gun.valve_flow")], valve_profiles=[CLOSING])
    shots = gun_velocity(BENCH, [4e5, 4e5], 0.5, valve_profiles=[CLOSING, None])
    assert shots.velocity_m_s[0] == full_bore.velocity_m_s[0]
    assert shots.velocity_m_s[1] == gun_velocity(BENCH, 4e5, 0.5).velocity_m_s[0]
    with pytest.raises(ValueError, match="1 valve profiles: expected one for each of 2 shots"):
        gun_velocity(BENCH, [2e5, 3e5], 0.5, [effect("gun.valve_flow")], valve_profiles=[CLOSING])


def test_closing_slows_stops_or_changes_nothing_after_the_exit() -> None:
    valve = effect("gun.valve_flow", loss_coefficient=20.0)
    opens = ValveProfile.of_controller(0.1)
    exit_s = gun_velocity(BENCH, 4e5, 0.5, [valve], valve_profiles=[opens]).exit_time_s[0]
    starts = [0.2 * exit_s, 0.5 * exit_s, 0.8 * exit_s, 1.01 * exit_s]
    closing = [ValveProfile.of_controller(0.1, start, 0.01) for start in starts]
    shots = gun_velocity(BENCH, [4e5] * 5, 0.5, [valve], valve_profiles=[*closing, None])
    assert np.all(np.diff(shots.velocity_m_s[:4]) > 0)
    without_closing = gun_velocity(BENCH, 4e5, 0.5, [valve], valve_profiles=[opens]).velocity_m_s[0]
    assert shots.velocity_m_s[3] == pytest.approx(without_closing, rel=1e-6)
    assert (
        shots.velocity_m_s[4] == gun_velocity(BENCH, 4e5, 0.5, [valve]).velocity_m_s[0]
    )  # of the effect's own time
    effects = [effect("gun.valve_flow", loss_coefficient=20.0), effect("gun.back_pressure")]
    profile = ValveProfile.parse("0:0,0.02:0.1,0.03:0")
    shots = gun_velocity(BENCH, 2e5, 1.0, effects, valve_profiles=[profile])
    assert shots.status[0] == Status.STOPPED


@dataclass(frozen=True)
class Hooked(GunEffect):
    """Does nothing, by a hook: `ode.run` integrates in place of the compiled motion."""

    id = "gun.hooked"
    law, source = "0", "none"
    moves: ClassVar[bool] = True

    def off(self, shots: int) -> np.ndarray:
        return np.zeros(shots, dtype=bool)

    def resistance_n(self, shot: ShotInputs, instant: Instant) -> np.ndarray:
        return np.zeros(instant.time_s.shape)


def test_steps_of_both_integrators_meet_a_short_opening() -> None:
    """The valve opens for 4 ms after a second of rest: a step that has grown would pass it by."""
    profile = ValveProfile.parse("1:0,1.002:0.5,1.004:0")
    effects = [
        effect("gun.valve_flow", loss_coefficient=2.0),
        effect("gun.dead_volume", volume_m3=2e-3),
    ]
    compiled = gun_velocity(BENCH, 4e5, 0.2, effects, valve_profiles=[profile])
    hooked = gun_velocity(BENCH, 4e5, 0.2, [*effects, Hooked()], valve_profiles=[profile])
    assert compiled.left[0]
    assert compiled.exit_time_s[0] > 1.0
    np.testing.assert_allclose(hooked.velocity_m_s, compiled.velocity_m_s, rtol=1e-5)


def test_the_stage_takes_the_profile_of_a_setting() -> None:
    material = ElasticMaterial("steel", 200e9, 0.3, 7800.0)
    own = {"impactor_mass_kg": 0.5, "tip": material, "tip_radius_m": 0.045, "plate": material}
    own |= {"plate_thickness_m": 0.01, "plate_mass_kg": 20.0}
    settings = [
        Setting(**own, tank_pressure_pa=4e5, valve_profile=CLOSING),
        Setting(**own, tank_pressure_pa=4e5),
        Setting(**own, impact_velocity_m_s=7.0),
    ]
    stage = GunStage(BENCH, 0.05, (effect("gun.valve_flow", loss_coefficient=20.0),))
    expected = gun_velocity(
        BENCH, [4e5] * 2, 0.5, stage.effects, valve_profiles=[CLOSING, None]
    ).velocity_m_s
    np.testing.assert_array_equal(stage.velocities(settings, SensorChain()), [*expected, 7.0])
    with pytest.raises(ValueError, match="valve_profile without tank_pressure_pa"):
        Setting(**own, impact_velocity_m_s=7.0, valve_profile=CLOSING)
