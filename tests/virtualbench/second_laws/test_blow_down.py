"""The shot past its exit against closed forms and books."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.virtualbench.gun.build import GunBuild, Projectile
from pyroshock.virtualbench.gun.gas import CHOKED, CP, CV, GAMMA, GAS_CONSTANT
from pyroshock.virtualbench.second_laws import SPLITS, blow_down
from pyroshock.virtualbench.second_laws import gun as law
from pyroshock.virtualbench.second_laws.blow_down import ValveClosing, emptying_rates, follow_shot
from pyroshock.virtualbench.second_laws.gun import muzzle_velocity_m_s
from pyroshock.virtualbench.second_laws.sensors import pressure_bar, pressure_read_bar

GUN = GunBuild(tank_volume_m3=4e-3, friction_coefficient=0.1)
BULLET = Projectile(0.2)
PRESSURE = 1.5e5
ALL = {
    "gun.back_pressure": 1.0,
    "gun.blow_by": 0.5,
    "gun.valve_flow": 0.6,
    "gun.barrel_loss": 1.0,
    "gun.sliding_friction": 1.0,
    "gun.heat_exchange": 20.0,
    "gun.dead_volume": 2.0,
}


@pytest.mark.parametrize("split", SPLITS)
@pytest.mark.parametrize("strengths", [{}, {"gun.back_pressure": 1.0}, ALL])
def test_pressure_falls_from_the_set_one_to_the_surroundings(
    split: str, strengths: dict[str, float]
) -> None:
    shot = follow_shot(GUN, strengths, split, PRESSURE, BULLET, until_s=1.2)
    assert shot.muzzle_velocity_m_s == muzzle_velocity_m_s(GUN, strengths, split, PRESSURE, BULLET)
    assert shot.time_s[-1] == pytest.approx(1.2)
    assert np.all(np.diff(shot.time_s) > 0)
    assert shot.tank_pressure_pa[0] == pytest.approx(PRESSURE)
    assert shot.tank_pressure_pa[-1] == pytest.approx(0.0, abs=blow_down.PUMPED_PA + 30.0)
    falling = shot.tank_pressure_pa > 0.02 * PRESSURE
    assert np.all(np.diff(shot.tank_pressure_pa[falling]) <= 1e-3)


@pytest.mark.parametrize("split", SPLITS)
def test_valve_that_closes_keeps_what_is_there_and_the_wall_warms_it(split: str) -> None:
    cold = {
        name: value for name, value in ALL.items() if name != "gun.heat_exchange"
    }  # a law's heat warms the tank
    for strengths in ({}, cold):
        exit_s = follow_shot(GUN, strengths, split, PRESSURE, BULLET, until_s=0.0).exit_s
        closing = ValveClosing(exit_s + 0.005, 0.01, math.inf)
        shut_in_pa = follow_shot(
            GUN, strengths, split, PRESSURE, BULLET, until_s=1.0, closing=closing
        )
        closed = shut_in_pa.time_s > closing.at_s + 0.011
        still = shut_in_pa.tank_pressure_pa[closed]
        assert still[0] > 0.02 * PRESSURE
        np.testing.assert_allclose(still, still[0], rtol=1e-6)
        warmed = follow_shot(
            GUN,
            strengths,
            split,
            PRESSURE,
            BULLET,
            until_s=1.0,
            closing=replace(closing, wall_s=0.1),
        ).tank_pressure_pa
        assert warmed[-1] > still[-1] * 1.01
    with pytest.raises(ValueError, match="before the exit"):
        follow_shot(GUN, {}, split, PRESSURE, BULLET, until_s=1.0, closing=ValveClosing(1e-3, 0.01))


def emptying_figures(split: str, **changes: float) -> np.ndarray:
    """Of a tank without a valve whose projectile is gone."""
    figures = np.append(
        law.shot_figures(GUN, {"gun.back_pressure": 1.0}, split, BULLET), np.zeros(6)
    )
    figures[blow_down.VENT_M2] = 4e-4
    figures[[blow_down.VENT_AT, blow_down.VENT_R, blow_down.MUZZLE_AT]] = 0.885, 0.006, 1.56
    figures[blow_down.WALL_S] = math.inf
    for name, value in changes.items():
        figures[getattr(blow_down, name)] = value
    return figures


def test_vessel_empties_as_the_closed_form_of_choked_flow() -> None:
    """p / p0 = (1 + (gamma - 1) / 2 C A sqrt(R T0) t / V)^(-2 gamma / (gamma - 1)), into a
    vacuum."""
    figures = emptying_figures("development", AMBIENT=1e-2)
    volume = figures[law.TANK_M3] + figures[law.BREECH_M3] + figures[law.AREA] * 1.56
    mass = 2e5 * volume / (GAS_CONSTANT * 293.15)
    state = np.array([mass, mass * CV * 293.15, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0])
    time, rows = law.integrated(emptying_rates, state, 0.0, 0.2, figures)
    pressure = (GAMMA - 1) * (rows[:, 1] + rows[:, 3]) / volume
    rate = CHOKED * 4e-4 * math.sqrt(GAS_CONSTANT * 293.15) / volume
    wanted = 2e5 * (1 + (GAMMA - 1) / 2 * rate * time) ** (-2 * GAMMA / (GAMMA - 1))
    np.testing.assert_allclose(pressure, wanted, rtol=1e-4)


@pytest.mark.parametrize("split", SPLITS)
@pytest.mark.parametrize(
    "strengths", [{"gun.back_pressure": 1.0}, {"gun.back_pressure": 1.0, "gun.valve_flow": 0.6}]
)
def test_books_of_mass_and_energy_balance(split: str, strengths: dict[str, float]) -> None:
    """What the chambers lose has gone through the holes: energy leaves as the enthalpy of the gas
    that leaves."""
    figures = np.append(law.shot_figures(GUN, strengths, split, BULLET), np.zeros(6))
    figures[[blow_down.VENT_M2, blow_down.VENT_AT, blow_down.VENT_R, blow_down.MUZZLE_AT]] = (
        4e-4,
        0.885,
        0.006,
        1.56,
    )
    figures[[blow_down.MUZZLE_M2, blow_down.WALL_S]] = 1e-3, math.inf
    air = figures[law.AMBIENT] / (GAS_CONSTANT * 293.15)
    tank, barrel = figures[law.TANK_M3], figures[law.BREECH_M3] + figures[law.AREA] * 1.56
    masses = np.array([2.5 * air * tank, 1.8 * air * barrel])
    state = np.array(
        [masses[0], masses[0] * CV * 280, masses[1], masses[1] * CV * 260, 0, 0, 1.56, 0.0]
    )
    time, rows = law.integrated(emptying_rates, state, 0.5, 0.6, figures)
    rates = np.array([emptying_rates(t, row, figures) for t, row in zip(time, rows, strict=True)])
    gone, energy_gone = rates[:, [0, 2]].sum(axis=1), rates[:, [1, 3]].sum(axis=1)
    assert np.all(gone < 1e-5 * abs(gone[0]))
    volume = tank + barrel if figures[law.MERGED] else barrel
    own = [0, 1, 2, 3] if figures[law.MERGED] else [2, 3]
    held = rows[:, own].reshape(len(time), -1, 2).sum(axis=1)
    temperature = held[:, 1] / (held[:, 0] * CV)
    leaving = gone < -1e-6
    np.testing.assert_allclose(energy_gone[leaving], (gone * CP * temperature)[leaving], rtol=1e-9)
    # The rates are those of the books: their integral is what is there.
    total = rows[:, [0, 2]].sum(axis=1)
    lost = np.concatenate([[0.0], np.cumsum((gone[1:] + gone[:-1]) / 2 * np.diff(time))])
    np.testing.assert_allclose(total - total[0], lost, atol=2e-3 * total[0])
    assert total[-1] < 0.97 * total[0]
    assert volume > 0


@pytest.mark.parametrize("split", SPLITS)
@pytest.mark.parametrize("strength", [0.1, -0.1])
def test_reading_is_the_inverse_of_the_true_pressure(split: str, strength: float) -> None:
    for acting in ({"sensor.pressure_offset": strength}, {"sensor.pressure_gain": strength}):
        readings = np.array([0.3, 0.6, 1.0, 2.5, 4.0])
        true = np.array([pressure_bar(float(read), acting, split) for read in readings])
        np.testing.assert_allclose(pressure_read_bar(true, acting, split), readings, atol=2e-4)
    assert pressure_read_bar(np.array([1.0]), {"sensor.pressure_gain": 0.1}, "")[
        0
    ] == pytest.approx(1.1)
