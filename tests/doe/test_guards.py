"""The guard: what the bench withstands passes, and one value beyond one limit is refused by that
limit alone."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from itertools import product
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.doe.guards import (
    PlannedShot,
    UnsafeRunError,
    check_run,
    planned_shots,
    pressures_for_levels,
    refuse_unsafe,
)
from pyroshock.doe.limits.bench import BenchLimits
from pyroshock.doe.limits.contact_force import Elastic, hertz_contact

BENCH = BenchLimits()
GENTLE = PlannedShot("1", 1e5, 0.5, 10.0, "steel", peak_force_n=5e4)
MATERIALS = {
    "steel": Elastic(200e9, 0.30),
    "aluminum": Elastic(69.9e9, 0.33),
    "PLA": Elastic(3.5e9, 0.36),
}
LEVELS = {"low": 5.0, "medium": 10.0, "high": 20.0}
MASSES = (0.2, 0.5, 1.0)
ROW = {
    "run": "7",
    "plate_material": "steel",
    "anvil_material": "aluminum",
    "insulator": "polymeric",
    "tip_material": "PLA",
    "tip_radius_mm": "45",
    "bullet_mass_kg": "0.5",
    "velocity_level": "medium",
}


def _energy_model(velocity_m_s: float, bullet_mass_kg: float) -> float:
    """A gun without losses whose gas does 1.5e-3 J per pascal."""
    return bullet_mass_kg * velocity_m_s**2 / 2 / 1.5e-3


PRESSURES = pressures_for_levels(LEVELS, MASSES, _energy_model)


def _names(run: PlannedShot, bench: BenchLimits = BENCH) -> list[str]:
    return [item.limit for item in check_run(run, bench)]


def test_gentle_and_design_shots_pass() -> None:
    assert _names(GENTLE) == []
    refuse_unsafe([GENTLE], BENCH)
    # 1 kg at 80 m/s for 0.1 ms, eq. 2.6: what the bench was sized for, with the heavier plate.
    assert _names(PlannedShot("1", 8e5, 1.0, 80.0, "steel", contact_time_s=1e-4)) == []
    at = PlannedShot("1", 0.8e6, 1.0, 80.0, "steel", peak_force_n=2.24e6)
    assert _names(at) == []


@pytest.mark.parametrize(
    ("change", "exceeded"),
    [
        ({"tank_pressure_pa": 0.8001e6}, ["max_regulated_pressure_pa"]),
        ({"tank_pressure_pa": 2.1e6}, ["max_tank_pressure_pa", "max_regulated_pressure_pa"]),
        (
            {"tank_pressure_pa": 7e6},
            ["max_tank_pressure_pa", "max_regulated_pressure_pa", "max_valve_pressure_pa"],
        ),
        ({"impact_velocity_m_s": 81.0}, ["max_impact_velocity_m_s"]),
        ({"bullet_mass_kg": 1.1}, ["max_bullet_mass_kg"]),
        (
            {"bullet_mass_kg": 1.0, "impact_velocity_m_s": 80.05},
            ["max_impact_velocity_m_s", "max_momentum_kg_m_s"],
        ),
        ({"peak_force_n": 2.241e6}, ["max_contact_force_n"]),
    ],
)
def test_each_limit_is_named(change: dict[str, float], exceeded: list[str]) -> None:
    assert _names(replace(GENTLE, **change)) == exceeded


def test_safety_plate_is_named() -> None:
    shot = replace(GENTLE, bullet_mass_kg=1.0, impact_velocity_m_s=70.0)
    assert _names(shot, replace(BENCH, safety_plate_thickness_m=0.007)) == ["safety_plate"]
    shot = replace(GENTLE, bullet_mass_kg=1.0, impact_velocity_m_s=80.0)
    assert _names(shot) == []
    assert _names(shot, replace(BENCH, safety_plate_margin=2.0)) == ["safety_plate"]


def test_accelerometers_limit_light_plates_and_near_places() -> None:
    # 0.3 m2 of 10 mm aluminium is 8.1 kg: 10000 g at 794 kN.
    shot = replace(GENTLE, plate="aluminum", peak_force_n=8e5)
    (item,) = check_run(shot, BENCH)
    assert item.limit == "max_acceleration_m_s2"
    assert item.value == pytest.approx(8e5 / 8.1)
    assert _names(replace(shot, plate="steel")) == []
    shot = replace(GENTLE, peak_force_n=1e5, contact_time_s=2e-4)
    assert _names(shot) == []
    assert _names(shot, replace(BENCH, accelerometer_distance_m=0.05)) == ["max_acceleration_m_s2"]
    assert _names(shot, replace(BENCH, accelerometer_distance_m=0.6)) == []
    bare = replace(BENCH, max_contact_force_n=math.inf, max_acceleration_m_s2=math.inf)
    assert _names(replace(GENTLE, peak_force_n=1e8), bare) == []


def test_contact_time_and_peak_give_one_another() -> None:
    shot = PlannedShot("1", 1e5, 1.0, 80.0, "steel", contact_time_s=1e-4)
    assert shot.expected_peak_force_n == pytest.approx(1600e3)
    shot = PlannedShot("1", 1e5, 1.0, 80.0, "steel", peak_force_n=1600e3)
    assert shot.expected_contact_time_s == pytest.approx(1e-4)


@settings(max_examples=100)
@given(
    st.floats(1e4, 1e7),
    st.floats(0.05, 2.0),
    st.floats(1.0, 200.0),
    st.floats(1e3, 1e7),
    st.floats(1.0, 3.0),
)
def test_a_harder_shot_is_never_safer(
    pressure: float, mass: float, velocity: float, force: float, by: float
) -> None:
    shot = PlannedShot("1", pressure, mass, velocity, "steel", peak_force_n=force)
    harder = PlannedShot("1", by * pressure, mass, by * velocity, "steel", peak_force_n=by * force)
    assert set(_names(shot)) <= set(_names(harder))


def test_refusal_is_one_line_and_carries_every_run() -> None:
    with pytest.raises(
        UnsafeRunError, match=r"1 of 2 .*run 12: tank pressure 900,000 Pa, allowed 800,000"
    ):
        refuse_unsafe([GENTLE, replace(GENTLE, run="12", tank_pressure_pa=9e5)], BENCH)
    runs = [replace(GENTLE, run=str(number), tank_pressure_pa=9e5) for number in range(1, 21)]
    with pytest.raises(UnsafeRunError, match="and 15 more") as caught:
        refuse_unsafe(runs, BENCH)
    assert "\n" not in str(caught.value)
    assert [run.run for run, _ in caught.value.exceeded] == [run.run for run in runs]
    assert all(items[0].allowed == 0.8e6 for _, items in caught.value.exceeded)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"peak_force_n": None}, "run 1: expected peak_force_n or contact_time_s"),
        ({"tank_pressure_pa": 0.0}, "run 1: tank_pressure_pa = 0.0"),
        ({"bullet_mass_kg": -1.0}, "run 1: bullet_mass_kg = -1.0"),
        ({"impact_velocity_m_s": math.nan}, "run 1: impact_velocity_m_s = nan"),
        ({"contact_time_s": 0.0}, "run 1: contact_time_s = 0.0"),
    ],
)
def test_unusable_shot_is_refused_by_name(change: dict[str, float | None], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(GENTLE, **change)


def test_unknown_plate_is_refused() -> None:
    with pytest.raises(ValueError, match="plate 'copper'"):
        check_run(replace(GENTLE, plate="copper"), BENCH)


def test_pressures_give_the_velocities_back() -> None:
    assert set(PRESSURES) == set(product(LEVELS, MASSES))
    for (level, mass), pressure in PRESSURES.items():
        assert math.sqrt(2 * pressure * 1.5e-3 / mass) == pytest.approx(LEVELS[level])


@pytest.mark.parametrize(
    ("levels", "masses", "pressure", "message"),
    [
        ({"low": 0.0}, [0.5], 1e5, "velocity of level 'low' = 0.0"),
        ({"low": 5.0}, [-0.5], 1e5, "bullet_mass_kg = -0.5"),
        ({"low": 5.0}, [0.5], math.nan, "tank_pressure_pa for level 'low' and 0.5 kg = nan"),
    ],
)
def test_unusable_levels_are_refused(
    levels: dict[str, float], masses: list[float], pressure: float, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        pressures_for_levels(levels, masses, lambda velocity, mass: pressure)


def test_row_becomes_a_shot_on_its_anvil() -> None:
    (shot,) = planned_shots([ROW], LEVELS, PRESSURES, MATERIALS)
    contact = hertz_contact(
        MATERIALS["PLA"],
        MATERIALS["aluminum"],
        tip_radius_m=0.045,
        bullet_mass_kg=0.5,
        impact_velocity_m_s=10.0,
    )
    assert shot == PlannedShot(
        "7", PRESSURES["medium", 0.5], 0.5, 10.0, "steel", "aluminum", *reversed(contact)
    )
    bare, steel = planned_shots(
        [ROW | {"anvil_material": "none"}, ROW | {"anvil_material": "steel"}],
        LEVELS,
        PRESSURES,
        MATERIALS,
    )
    assert bare.peak_force_n == steel.peak_force_n
    rows = [{key: value for key, value in ROW.items() if key != "run"}] * 2
    assert [shot.run for shot in planned_shots(rows, LEVELS, PRESSURES, MATERIALS)] == ["1", "2"]
    with pytest.raises(ValueError, match="run 7: column 'tip_radius_mm'"):
        planned_shots(
            [{key: value for key, value in ROW.items() if key != "tip_radius_mm"}],
            LEVELS,
            PRESSURES,
            MATERIALS,
        )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"tip_material": "oak"}, "run 7: material 'oak'"),
        ({"anvil_material": "oak"}, "run 7: material 'oak'"),
        ({"velocity_level": "top"}, "run 7: velocity level 'top'"),
        ({"bullet_mass_kg": "0.3"}, r"run 7: pressure of level and mass \('medium', 0.3\)"),
        ({"tip_radius_mm": "wide"}, "run 7: tip_radius_mm is 'wide'"),
        ({"bullet_mass_kg": "nan"}, "run 7: bullet_mass_kg is 'nan'"),
    ],
)
def test_row_that_is_not_understood_is_refused(change: dict[str, str], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        planned_shots([ROW | change], LEVELS, PRESSURES, MATERIALS)


def test_table_a1_passes_at_moderate_levels(thesis_tables: Path) -> None:
    with (thesis_tables / "table_a1_lhs_105_runs.csv").open(newline="") as handle:
        shots = planned_shots(list(csv.DictReader(handle)), LEVELS, PRESSURES, MATERIALS)
    refuse_unsafe(shots, BENCH)
    assert len(shots) == 105


def test_table_a1_at_the_benchs_top_speed_is_refused(thesis_tables: Path) -> None:
    levels = {"low": 20.0, "medium": 40.0, "high": 80.0}
    with (thesis_tables / "table_a1_lhs_105_runs.csv").open(newline="") as handle:
        rows = list(csv.DictReader(handle))
    shots = planned_shots(
        rows, levels, pressures_for_levels(levels, MASSES, _energy_model), MATERIALS
    )
    with pytest.raises(UnsafeRunError) as caught:
        refuse_unsafe(shots, BENCH)
    limits = {item.limit for _, items in caught.value.exceeded for item in items}
    assert limits == {
        "max_regulated_pressure_pa",
        "max_tank_pressure_pa",
        "max_contact_force_n",
        "max_acceleration_m_s2",
    }
