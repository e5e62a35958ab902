"""Warnings beside a prediction: in the units of the lab, each quantity once, in the same words everywhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.app.predict.predicting import domain_warnings, extrapolation_text, field_warnings, warnings
from pyroshock.app.predict.tables import plot_prediction, quantity_rows
from pyroshock.twin.chain import Twin
from pyroshock.twin.contact_interface import Extrapolation, OutOfDomain
from pyroshock.twin.gun.stage import GunStage
from pyroshock.twin.prediction import RestsOn
from support.records.twin_parts import BENCH, HalfSine, setting

PRESSURE = Extrapolation("tank_pressure_pa", 10e5, 0.5e5, 6.7e5)


def prediction(*extrapolation, outside=(), **own):
    twin = Twin(HalfSine(), gun=GunStage(BENCH, 0.05))
    shot = twin.predict(setting(**own), draws=4, rng=np.random.default_rng(0))
    return replace(
        shot, extrapolation=extrapolation, outside=tuple(outside), rests_on=RestsOn(3, "half-sine", "Three.")
    )


@pytest.mark.parametrize(
    ("item", "text"),
    [
        (PRESSURE, "Tank pressure 10 bar is beyond the 0.5 to 6.7 bar of the shots that were learned from."),
        (Extrapolation("impactor_mass", 1.0, 0.32, 0.32),
         "Impactor mass 1 kg is beyond the 0.32 kg of the shots that were learned from."),
        (Extrapolation("impact_velocity_m_s", 31.4159, 2.0, 20.0),
         "Impact velocity 31.42 m/s is beyond the 2 to 20 m/s of the shots that were learned from."),
        (Extrapolation("tip_radius_m", 0.06, 0.015, 0.03),
         "Tip radius 60 mm is beyond the 15 to 30 mm of the shots that were learned from."),
        (Extrapolation("plate_youngs_modulus", 69.9e9, 2e11, 2.1e11),
         "Plate youngs modulus 69.9 GPa is beyond the 200 to 210 GPa of the shots that were learned from."),
        (Extrapolation("tip_density", 1240.0, 2700.0, 7800.0),
         "Tip density 1240 kg/m3 is beyond the 2700 to 7800 kg/m3 of the shots that were learned from."),
        (Extrapolation("humidity", 0.9, 0.2, 0.5),
         "Humidity 0.9 is beyond the 0.2 to 0.5 of the shots that were learned from."),
    ],
)  # fmt: skip
def test_range_is_told_in_units_of_the_lab(item, text):
    assert extrapolation_text(item) == text


def test_domain_is_told_in_words_with_the_unit_of_the_value():
    shot = prediction(
        outside=[OutOfDomain("impact_velocity_m_s", 22.1284, "up to 5.2"), OutOfDomain("insulator", "foam", "none")]
    )
    assert warnings(shot) == (
        "Impact velocity 22.13 m/s lies outside of the domain of the contact (half-sine): up to 5.2.",
        "Insulator foam lies outside of the domain of the contact (half-sine): none.",
    )


def test_quantity_beyond_and_outside_is_named_once():
    beyond = Extrapolation("impact_velocity_m_s", 22.0, 1.0, 9.0)
    shot = prediction(beyond, outside=[OutOfDomain("impact_velocity", 22.0, "1 to 9")])
    assert warnings(shot) == (extrapolation_text(beyond),)
    assert domain_warnings(shot) == ()


@pytest.mark.parametrize(
    ("own", "item", "number"),
    [
        ({"tank_pressure_pa": 10e5}, PRESSURE, "impact velocity"),
        ({"tank_pressure_pa": 3e5}, Extrapolation("bullet_mass_kg", 0.5, 0.6, 0.9), "impact velocity"),
        ({}, Extrapolation("bullet_mass_kg", 0.5, 0.6, 0.9), "peak force"),  # a velocity is given: no gun
        ({"tank_pressure_pa": 3e5}, Extrapolation("tip_radius", 0.045, 0.05, 0.06), "peak force"),
    ],
)
def test_warning_stands_beside_the_number_that_it_makes_unsure(own, item, number):
    rows = list(quantity_rows(prediction(item, **own)))
    assert {row["quantity"]: row.get("warning") for row in rows if "warning" in row} == {
        number: extrapolation_text(item)
    }


def test_warnings_go_by_the_field_that_sets_the_quantity():
    heavy = Extrapolation("impactor_mass", 1.0, 0.3, 0.5)
    shot = prediction(PRESSURE, heavy, Extrapolation("plate_density", 1.0, 2.0, 3.0), tank_pressure_pa=10e5)
    assert field_warnings(shot) == {
        "tank_pressure_pa": extrapolation_text(PRESSURE),
        "bullet_mass_kg": extrapolation_text(heavy),
    }


def test_picture_says_what_the_bands_rest_on(tmp_path):
    plot_prediction(prediction(PRESSURE, tank_pressure_pa=10e5), tmp_path / "shot.svg")
    plain = prediction(tank_pressure_pa=3e5)
    plot_prediction(replace(plain, rests_on=RestsOn(0, "half-sine", "")), tmp_path / "plain.svg")
    assert (tmp_path / "shot.svg").stat().st_size > (tmp_path / "plain.svg").stat().st_size


def test_mass_that_gun_and_contact_learned_from_alike_is_named_once():
    gun, contact = (Extrapolation(name, 1.2, 0.2, 0.8) for name in ("bullet_mass_kg", "impactor_mass"))
    other = Extrapolation("impactor_mass", 1.2, 0.3, 0.5)
    shot = prediction(gun, contact, other, tank_pressure_pa=3e5)
    assert warnings(shot) == (extrapolation_text(gun), extrapolation_text(other))
    assert field_warnings(shot)["bullet_mass_kg"] == f"{extrapolation_text(gun)} {extrapolation_text(other)}"
