"""Measured shots that are nearest to a setting, and how they differ from it in words."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pyroshock.app.operations.predict.nearest_shots import (
    SHOWN,
    MeasuredShot,
    difference_text,
    distance,
    nearest,
    nearest_rows,
    velocity_basis,
)

WANTED = {
    "tank_pressure_pa": 5e5,
    "bullet_mass_kg": 0.5,
    "tip_radius_m": 0.045,
    "tip_material": "steel",
}


def shot(
    run: int = 1, velocity_m_s: float | None = 8.0, impact: int | None = 3, **setting: Any
) -> MeasuredShot:
    return MeasuredShot(impact, run, 1, WANTED | setting, velocity_m_s, 5e-4, 2e4, [0.0, 1.0, 0.0])


def test_factor_of_two_counts_as_another_material():
    assert distance(WANTED, shot(tank_pressure_pa=1e6)) == pytest.approx(1.0)
    assert distance(WANTED, shot(tip_material="PLA")) == 1.0
    assert distance(WANTED, shot(tip_material="Steel")) == 0.0


def test_nearest_comes_first_and_at_most_five_are_shown():
    shots = [shot(run, tank_pressure_pa=5e5 + 1e4 * run) for run in range(9, 0, -1)]
    assert [near.run for near in nearest(WANTED, shots)] == list(range(1, SHOWN + 1))


def test_shot_without_any_measured_value_is_left_out():
    assert not nearest(WANTED, [MeasuredShot(None, 1, 1, WANTED, None, None, None, ())])


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ({}, "the same settings"),
        (
            {"tank_pressure_pa": 1.65e5, "bullet_mass_kg": 0.4},
            "3.35 bar less pressure, 0.1 kg lighter",
        ),
        ({"tip_radius_m": 0.06, "tip_material": "PLA"}, "15 mm more tip radius, tip material PLA"),
    ],
)
def test_differences_are_said_in_the_units_of_the_bench(setting, words):
    assert difference_text(WANTED, shot(**setting)) == words


def test_velocity_that_is_asked_for_is_compared_with_the_measured_one():
    wanted = {**WANTED, "impact_velocity_m_s": 10.0}
    assert difference_text(wanted, shot()) == "2 m/s slower"


def test_row_links_the_impact_where_there_is_one():
    with_impact, without = nearest_rows(WANTED, [shot(), shot(impact=None)])
    assert (
        with_impact["address"] == "/impacts/3"
        and with_impact["peak_force"] == "20"
        and without["address"] is None
    )


def gun(*pressures_pa: float) -> Any:
    members = {"tank_pressure_pa": np.array(pressures_pa), "__len__": lambda _: len(pressures_pa)}
    shots: Any = type("Shots", (), members)
    return SimpleNamespace(
        twin=SimpleNamespace(gun=SimpleNamespace(shots=shots() if pressures_pa else None))
    )


def test_basis_of_the_velocity_says_where_it_extrapolates():
    inside, beyond = (str(velocity_basis(gun(0.39e5, 1.65e5), pressure)) for pressure in (1e5, 5e5))
    assert inside == "The velocity band stands on 2 measured shots between 0.39 and 1.65 bar."
    assert beyond == f"{inside.removesuffix('.')}; at 5 bar it is an extrapolation."
    assert (
        str(velocity_basis(gun(1e5), 1e5))
        == "The velocity band stands on 1 measured shot at 1 bar."
    )
    assert "No measured shot" in str(velocity_basis(gun(), 1e5))
    assert velocity_basis(gun(1e5), None) is None
