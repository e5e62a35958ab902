"""A shot asked in SI is the one of the command line; its sliders stay in the bench, its warnings in
lab units."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest
from pyroshock.app.common.quantities import shown_in
from pyroshock.app.operations.predict.controls import sliders
from pyroshock.app.operations.predict.figures import prediction_figure
from pyroshock.app.operations.predict.request import ShotRequest
from pyroshock.app.operations.predict.tables import quantity_rows
from pyroshock.app.operations.predict.validity import (
    domain_sentences,
    extrapolation_sentence,
    field_warnings,
    warning_sentences,
)
from pyroshock.app.twins.benches import shipped_bench
from pyroshock.app.twins.building import BuiltTwin, TwinRequest, twin_of
from pyroshock.dataset.domain import Domain
from pyroshock.dataset.rows import by_name
from pyroshock.dataset.validity_limits import BETWEEN_LEVELS
from pyroshock.doe.space import hammer_space, shipped_factors, space_from_text
from pyroshock.signals.srs.spectrum import octave_grid
from pyroshock.training.models.analytic import Analytic
from pyroshock.training.registry.contact_stage import RegisteredContact
from pyroshock.training.registry.records import Cost, DatasetName, RegisteredModel, Version
from pyroshock.twin.chain import Twin
from pyroshock.twin.contact.stage import LawContact
from pyroshock.twin.contact_interface import Extrapolation, OutOfDomain
from pyroshock.twin.gun.stage import GunStage
from pyroshock.twin.prediction import RestsOn
from pyroshock.twin.setting import THESIS
from support.records.predicted_shots import predicted_json
from support.records.pulse_tables import PREDICTORS, pulse_table
from support.records.twin_parts import BENCH, HalfSine, setting

# --- A shot asked in SI is the one that the command line asks in units, and its sliders stay within
# the bench -------
LINES = tuple(octave_grid(200.0, 4000.0, 3).tolist())


@pytest.fixture
def bench(quick_twins):
    return twin_of(None, "sqlite:///none.db", TwinRequest(frequency_hz=LINES))


def test_sliders_stay_within_the_bench_and_their_defaults_can_be_fired(bench):
    controls = sliders(bench)
    numbers = controls["numbers"]
    assert (numbers["tank_pressure_pa"]["low"], numbers["tank_pressure_pa"]["high"]) == (0.2e5, 8e5)
    assert numbers["bullet_mass_kg"]["levels"] == [0.2, 0.5, 1.0]
    assert numbers["tip_radius_m"]["levels"] == pytest.approx([0.03, 0.045, 0.06])
    for name, range_slider in numbers.items():
        assert range_slider["low"] <= range_slider["default"] <= range_slider["high"], name
        assert range_slider["domain"] is None
    choices = controls["choices"]
    assert (
        choices["tip_material"]["default"] == "steel"
        and choices["anvil_material"]["options"][0]["name"] == "none"
    )
    assert [option["name"] for option in choices["impact_position"]["options"]] == ["#1", "#2"]
    assert all(option["known"] for choice in choices.values() for option in choice["options"])
    names = [option["name"] for option in choices["tip_material"]["options"]]
    assert sorted(names) == sorted({material.name for material in bench.materials.values()})
    own = {name: choice["default"] for name, choice in choices.items()}
    own |= {
        name: slider["default"] for name, slider in numbers.items() if name != "impact_velocity_m_s"
    }
    assert predicted_json(bench, ShotRequest(**own), draws=8) == predicted_json(
        bench, ShotRequest(), draws=8
    )
    json.dumps(controls, allow_nan=False)
    text = (
        shipped_factors("gun")
        + "\n[bench]\nmax_regulated_pressure_pa = 0.6e6\nmax_bullet_mass_kg = 0.8\n"
    )
    numbers = sliders(bench, space_from_text(text))["numbers"]
    assert (numbers["tank_pressure_pa"]["high"], numbers["bullet_mass_kg"]["high"]) == (6e5, 0.8)
    with pytest.raises(ValueError, match="expected one of them"):
        predicted_json(bench, ShotRequest(tank_pressure_pa=1e5, impact_velocity_m_s=3.0))
    with pytest.raises(ValueError, match="no numbers of bullet_mass"):
        sliders(bench, hammer_space())


def test_sliders_show_what_a_model_has_learned():
    """Tips of radius 15 and 30 mm, of aluminum, delrin and polyurethane; anvils of all three
    kinds."""
    table = pulse_table(np.random.default_rng(0), repetitions=2)
    ids = ("key", "run", "0" * 64)
    version = Version("hertz", 4, DatasetName("spring", "5" * 64, "hammer"), "repetitions", 0, {},
    Cost(1.0, 1.0), *ids,
                      datetime(2026, 1, 1, tzinfo=UTC))  # fmt: skip
    model = RegisteredModel(version, Analytic("hertz").fit(table, np.random.default_rng(0)),
    PREDICTORS,
                            Domain.of(table), {})  # fmt: skip
    materials = by_name(THESIS.values(), {})
    built = BuiltTwin(
        Twin(RegisteredContact(model)), shipped_bench(), materials["aluminum"], materials
    )
    controls = sliders(built)
    assert controls["numbers"]["tip_radius_m"]["domain"] == [0.015, 0.03]
    velocity = table.column("impact_velocity")
    assert controls["numbers"]["impact_velocity_m_s"]["domain"] == [velocity.min(), velocity.max()]
    seen_tips = {
        option["name"]: option["known"] for option in controls["choices"]["tip_material"]["options"]
    }
    assert seen_tips["aluminum"] and seen_tips["delrin"] and not seen_tips["steel"]
    anvils = {
        option["name"]: option["known"]
        for option in controls["choices"]["anvil_material"]["options"]
    }
    assert anvils["none"] and anvils["steel"] and not anvils["delrin"]
    assert (
        sliders(replace(built, twin=Twin(LawContact("hertz"))))["numbers"]["tip_radius_m"]["domain"]
        is None
    )


# --- warnings beside a prediction: in the units of the lab, each quantity once, in the same words
# everywhere --------
PRESSURE = Extrapolation("tank_pressure_pa", 10e5, 0.5e5, 6.7e5)


def prediction(*extrapolation, outside=(), **own):
    twin = Twin(HalfSine(), gun=GunStage(BENCH, 0.05))
    shot = twin.predict(setting(**own), draws=4, rng=np.random.default_rng(0))
    return replace(
        shot,
        extrapolation=extrapolation,
        outside=tuple(outside),
        rests_on=RestsOn(3, "half-sine", "Three."),
    )


@pytest.mark.parametrize(("item", "text"), [
    (PRESSURE,
     "Tank pressure 10 bar is above the 0.5 to 6.7 bar of the shots that were learned from."),
    (Extrapolation("impactor_mass", 1.0, 0.32, 0.32),
     "Impactor mass 1 kg is above the 0.32 kg of the shots that were learned from."),
    (Extrapolation("impactor_mass", 8.1, 9.31, 9.31),
     "Impactor mass 8.1 kg is below the 9.31 kg of the shots that were learned from."),
    (Extrapolation("impact_velocity_m_s", 31.4159, 2.0, 20.0),
     "Impact velocity 31.42 m/s is above the 2 to 20 m/s of the shots that were learned from."),
    (Extrapolation("tip_radius_m", 0.06, 0.015, 0.03),
     "Tip radius 60 mm is above the 15 to 30 mm of the shots that were learned from."),
    (Extrapolation("plate_youngs_modulus", 69.9e9, 2e11, 2.1e11),
     "Plate Young's modulus 69.9 GPa is below the 200 to 210 GPa of the shots that were learned "
     "from."),
    (Extrapolation("tip_density", 1240.0, 2700.0, 7800.0),
     "Tip density 1240 kg/m³ is below the 2700 to 7800 kg/m³ of the shots that were learned "
     "from."),
    (Extrapolation("humidity", 0.9, 0.2, 0.5),
     "Humidity 0.9 is above the 0.2 to 0.5 of the shots that were learned from."),
])  # fmt: skip
def test_range_is_told_in_units_of_the_lab(item, text):
    assert extrapolation_sentence(item).text == text


def test_warnings_are_told_in_words_once_by_the_field_that_sets_the_quantity(tmp_path):
    shot = prediction(
        outside=[
            OutOfDomain("impact_velocity_m_s", 22.1284, "up to 5.2"),
            OutOfDomain("insulator", "foam", "none"),
        ]
    )
    assert tuple(map(str, warning_sentences(shot))) == (
        "Impact velocity 22.13 m/s lies outside of the domain of the contact "
        "(half-sine): up to 5.2.",
        "Insulator foam lies outside of the domain of the contact (half-sine): none.",
    )
    levels = OutOfDomain("tip_radius", 0.045, "0.03 to 0.06", BETWEEN_LEVELS, (0.03, 0.06))
    tip = OutOfDomain("tip_material", "delrin", "PLA, steel", "was never recorded")
    pair = OutOfDomain(
        "impactor_mass",
        0.4,
        "0.4 to 0.8",
        "was never recorded together with anvil none",
        (0.4, 0.8),
    )
    assert tuple(map(str, domain_sentences(prediction(outside=[levels, tip, pair])))) == (
        "Tip radius 45 mm lies between the measured 30 and 60 mm; half-sine was not trained there.",
        "Tip material delrin was never recorded; half-sine was trained on PLA, steel.",
        "Impactor mass 0.4 kg was never recorded together with anvil none; "
        "half-sine was trained on 0.4 to 0.8 kg.",
    )
    with shown_in("si"):
        assert (
            "0.045 m lies between the measured 0.03 and 0.06 m"
            in domain_sentences(prediction(outside=[levels]))[0].text
        )
    beyond = Extrapolation("impact_velocity_m_s", 22.0, 1.0, 9.0)
    shot = prediction(beyond, outside=[OutOfDomain("impact_velocity", 22.0, "1 to 9")])
    assert (
        tuple(map(str, warning_sentences(shot))) == (extrapolation_sentence(beyond).text,)
        and domain_sentences(shot) == ()
    )
    heavy = Extrapolation("impactor_mass", 1.0, 0.3, 0.5)
    shot = prediction(
        PRESSURE, heavy, Extrapolation("plate_density", 1.0, 2.0, 3.0), tank_pressure_pa=10e5
    )
    assert field_warnings(shot) == {
        "tank_pressure_pa": extrapolation_sentence(PRESSURE).text,
        "bullet_mass_kg": extrapolation_sentence(heavy).text,
    }
    gun, contact = (
        Extrapolation(name, 1.2, 0.2, 0.8) for name in ("bullet_mass_kg", "impactor_mass")
    )
    other = Extrapolation("impactor_mass", 1.2, 0.3, 0.5)
    shot = prediction(gun, contact, other, tank_pressure_pa=3e5)
    assert tuple(map(str, warning_sentences(shot))) == (
        extrapolation_sentence(gun).text,
        extrapolation_sentence(other).text,
    )
    assert (
        field_warnings(shot)["bullet_mass_kg"]
        == f"{extrapolation_sentence(gun)} {extrapolation_sentence(other)}"
    )
    beyond = prediction(PRESSURE, tank_pressure_pa=10e5)
    assert prediction_figure(beyond).notes[-1] == warning_sentences(beyond)[-1].text
    plain = replace(prediction(tank_pressure_pa=3e5), rests_on=RestsOn(0, "half-sine", ""))
    assert prediction_figure(plain).notes == ()


@pytest.mark.parametrize(("own", "item", "number"), [
    ({"tank_pressure_pa": 10e5}, PRESSURE, "impact velocity"),
    ({"tank_pressure_pa": 3e5}, Extrapolation("bullet_mass_kg", 0.5, 0.6, 0.9), "impact velocity"),
    # a velocity is given: no gun
    ({}, Extrapolation("bullet_mass_kg", 0.5, 0.6, 0.9), "peak force"),
    ({"tank_pressure_pa": 3e5}, Extrapolation("tip_radius", 0.045, 0.05, 0.06), "peak force"),
])  # fmt: skip
def test_warning_stands_beside_the_number_that_it_makes_unsure(own, item, number):
    rows = list(quantity_rows(prediction(item, **own)))
    assert {row["quantity"]: row.get("warning") for row in rows if "warning" in row} == {
        number: extrapolation_sentence(item).text
    }
