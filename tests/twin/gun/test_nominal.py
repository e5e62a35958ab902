"""The nominal gun against its limits, its balance of energy, and the printed table of the
thesis."""

from __future__ import annotations

import csv
import math
import time
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pyroshock.twin.gun.bench import STANDARD_GRAVITY_M_S2, GunBench
from pyroshock.twin.gun.nominal import muzzle_velocity, tank_pressure_for, trajectory

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "first-shots"
#: Table 5.1, predicted column, in test order.
TABLE_5_1 = [10.58, 11.35, 17.53, 14.13, 16.98]

BENCH = GunBench(0.0095, 0.049, 0.048, 0.9, 0.3, 1.4, 0.5)

benches = st.builds(
    GunBench,
    tank_volume_m3=st.floats(1e-3, 0.1),
    bore_diameter_m=st.just(0.06),
    projectile_diameter_m=st.floats(0.01, 0.06),
    travel_m=st.floats(0.1, 3.0),
    friction_coefficient=st.floats(0.0, 3.0),
    heat_capacity_ratio=st.floats(1.0, 1.67),
    efficiency=st.floats(0.1, 1.0),
)
pressures = st.floats(1e3, 2e6)
masses = st.floats(0.05, 2.0)


@pytest.fixture(scope="module")
def first_shots() -> tuple[GunBench, dict[str, np.ndarray]]:
    gun = tomllib.loads((EXAMPLE / "campaign.toml").read_text())["bench"]["gun"]
    with (EXAMPLE / "runs.csv").open(newline="") as handle:
        rows = list(csv.DictReader(handle))
    numbers = ("run", "tank_pressure_bar", "bullet_mass_kg", "measured_velocity_m_s")
    return GunBench(**gun), {key: np.array([float(row[key]) for row in rows]) for key in numbers}


def _predicted(bench: GunBench, shots: dict[str, np.ndarray]) -> np.ndarray:
    return muzzle_velocity(bench, shots["tank_pressure_bar"] * 1e5, shots["bullet_mass_kg"])


def test_table_5_1_is_reproduced(first_shots: tuple[GunBench, dict[str, np.ndarray]]) -> None:
    """With the text's travel as well, and with the thesis's mean absolute error."""
    bench, shots = first_shots
    assert _predicted(bench, shots) == pytest.approx(TABLE_5_1, abs=0.01)
    text = replace(bench, travel_m=0.885, friction_coefficient=0.860)
    assert _predicted(text, shots) == pytest.approx(TABLE_5_1, abs=0.048)
    measured = shots["measured_velocity_m_s"]
    error = 100 * np.abs(measured - _predicted(bench, shots)) / measured
    assert error.mean() == pytest.approx(4.07, abs=0.01)


@settings(max_examples=60)
@given(benches, pressures, masses)
def test_integral_and_trajectory_agree(bench: GunBench, pressure: float, mass: float) -> None:
    velocity = float(muzzle_velocity(bench, pressure, mass))
    # At the threshold itself either route may say 0: the work is a difference of two equal numbers
    # there.
    assume(velocity == 0 or pressure > 1.001 * tank_pressure_for(bench, 0.0, mass))
    assert trajectory(bench, pressure, mass).muzzle_velocity_m_s == pytest.approx(
        velocity, rel=1e-6, abs=0
    )


@settings(max_examples=30)
@given(benches, pressures, masses)
def test_trajectory_balances_energy(bench: GunBench, pressure: float, mass: float) -> None:
    shot = trajectory(bench, pressure, mass, points=2001)
    force = (
        shot.pressure_pa * bench.projectile_area_m2
        - bench.friction_coefficient * STANDARD_GRAVITY_M_S2 * mass
    )
    power = force * shot.velocity_m_s
    work = np.trapezoid(power, shot.time_s)
    scale = np.trapezoid(np.abs(power), shot.time_s)
    assert mass * shot.velocity_m_s[-1] ** 2 / 2 == pytest.approx(work, abs=1e-5 * scale)


def test_endless_tank_pushes_with_constant_pressure_and_a_ratio_of_one_is_isothermal() -> None:
    bench = replace(BENCH, tank_volume_m3=1e9, efficiency=1.0)
    pressure, mass = 4e5, 0.5
    push = (
        pressure * bench.projectile_area_m2 / mass
        - bench.friction_coefficient * STANDARD_GRAVITY_M_S2
    )
    expected = math.sqrt(2 * push * bench.travel_m)
    assert float(muzzle_velocity(bench, pressure, mass)) == pytest.approx(expected, rel=1e-9)
    isothermal = replace(BENCH, heat_capacity_ratio=1.0, friction_coefficient=0.0, efficiency=1.0)
    growth = math.log(
        1 + isothermal.projectile_area_m2 * isothermal.travel_m / isothermal.tank_volume_m3
    )
    expected = math.sqrt(2 * pressure * isothermal.tank_volume_m3 * growth / mass)
    assert float(muzzle_velocity(isothermal, pressure, mass)) == pytest.approx(expected, rel=1e-12)
    free = replace(BENCH, friction_coefficient=0.0)
    assert float(muzzle_velocity(free, 0.0, 0.2)) == 0.0
    assert trajectory(free, 0.0, 0.2).status == "did not start"


@settings(max_examples=50)
@given(benches, st.lists(pressures, min_size=2, max_size=20), masses)
def test_velocity_rises_with_pressure_and_efficiency_scales(
    bench: GunBench, values: list[float], mass: float
) -> None:
    velocity = muzzle_velocity(bench, np.sort(values), mass)
    assert np.all(np.diff(velocity) >= 0)
    ideal = muzzle_velocity(replace(bench, efficiency=1.0), np.sort(values), mass)
    assert velocity == pytest.approx(bench.efficiency * ideal)


@settings(max_examples=50)
@given(benches, st.floats(1.0, 100.0), masses)
def test_pressure_for_a_velocity_gives_it_back(
    bench: GunBench, velocity: float, mass: float
) -> None:
    pressure = tank_pressure_for(bench, velocity, mass)
    assert float(muzzle_velocity(bench, pressure, mass)) == pytest.approx(velocity, rel=1e-6)


def test_threshold_separates_stuck_from_leaving_and_unphysical_shots_are_refused() -> None:
    threshold = float(tank_pressure_for(BENCH, 0.0, 0.5))
    stuck, leaves = muzzle_velocity(BENCH, [0.999 * threshold, 1.001 * threshold], 0.5)
    assert stuck == 0 < leaves
    table = muzzle_velocity(BENCH, np.linspace(1e5, 8e5, 5)[:, None], [0.2, 0.5, 1.0])
    assert table.shape == (5, 3)
    assert table[2, 1] == muzzle_velocity(BENCH, 4.5e5, 0.5)
    with pytest.raises(
        ValueError, match=r"tank_pressure_pa = -2\.0: expected not negative and finite"
    ):
        muzzle_velocity(BENCH, [1e5, -2.0, -3.0], 0.5)
    with pytest.raises(ValueError, match=r"bullet_mass_kg = 0\.0: expected positive and finite"):
        muzzle_velocity(BENCH, 1e5, [0.5, 0.0, -1.0])
    for pressure, mass, name in ((-1.0, 0.5, "tank_pressure_pa"), (1e5, 0.0, "bullet_mass_kg")):
        with pytest.raises(ValueError, match=name):
            trajectory(BENCH, pressure, mass)


def test_trajectory_says_how_and_where_it_ended() -> None:
    # A tank small enough that a shot may start and still not arrive.
    bench = replace(BENCH, tank_volume_m3=0.005, friction_coefficient=1.0)
    least = float(tank_pressure_for(bench, 0.0, 0.5))
    still, stopped, exited = (
        trajectory(bench, fraction * least, 0.5) for fraction in (0.5, 0.97, 1.05)
    )
    assert [shot.status for shot in (still, stopped, exited)] == [
        "did not start",
        "stopped in the barrel",
        "left",
    ]
    assert [math.isnan(shot.exit_time_s) for shot in (still, stopped, exited)] == [
        True,
        True,
        False,
    ]
    assert (still.muzzle_velocity_m_s, stopped.muzzle_velocity_m_s) == (0.0, 0.0)
    assert [still.time_s.tolist(), still.position_m.tolist(), still.velocity_m_s.tolist()] == [
        [0.0]
    ] * 3
    assert still.pressure_pa.tolist() == [0.5 * least]
    assert stopped.velocity_m_s[-1] == pytest.approx(0, abs=1e-6)
    assert 0 < stopped.position_m[-1] < bench.travel_m
    vents = trajectory(BENCH, 3e5, 0.5)
    assert vents.position_m[-1] == pytest.approx(BENCH.travel_m, rel=1e-9)
    expanded_pa = 3e5 * (1 + BENCH.projectile_area_m2 * 0.9 / 0.0095) ** -1.4
    assert vents.pressure_pa[[0, -1]] == pytest.approx([3e5, expanded_pa], rel=1e-9)


def test_trajectory_of_constant_push_is_that_of_constant_acceleration() -> None:
    bench = replace(BENCH, tank_volume_m3=1e9)
    push = 4e5 * bench.projectile_area_m2 / 0.5 - bench.friction_coefficient * STANDARD_GRAVITY_M_S2
    shot = trajectory(bench, 4e5, 0.5)
    assert shot.exit_time_s == pytest.approx(math.sqrt(2 * bench.travel_m / push), rel=1e-8)
    assert (len(shot.time_s), shot.time_s[0], shot.time_s[-1]) == (200, 0.0, shot.exit_time_s)
    np.testing.assert_allclose(shot.velocity_m_s, push * shot.time_s, rtol=1e-8, atol=1e-9)
    assert shot.muzzle_velocity_m_s == pytest.approx(0.5 * push * shot.exit_time_s)


def test_ten_thousand_shots_in_one_call() -> None:
    pressure = np.linspace(1e5, 8e5, 10_000)
    started = time.perf_counter()
    velocity = muzzle_velocity(BENCH, pressure, 0.5)
    assert velocity.shape == (10_000,)
    assert (
        time.perf_counter() - started < 0.1
    )  # one trajectory takes some milliseconds: this is not ten thousand


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("tank_volume_m3", 0.0),
        ("travel_m", -0.9),
        ("bore_diameter_m", math.inf),
        ("projectile_diameter_m", 0.05),
        ("friction_coefficient", -0.1),
        ("heat_capacity_ratio", 0.9),
        ("efficiency", 0.0),
        ("efficiency", 1.2),
        ("efficiency", math.nan),
    ],
)
def test_unphysical_bench_is_refused_by_name(field: str, value: float) -> None:
    """The limits are allowed."""
    with pytest.raises(ValueError, match=f"{field} = {value!r}"):
        replace(BENCH, **{field: value})
    tight = replace(
        BENCH,
        bore_diameter_m=0.048,
        efficiency=1.0,
        friction_coefficient=0.0,
        heat_capacity_ratio=1.0,
    )
    assert float(muzzle_velocity(tight, 1e5, 0.5)) > 0
