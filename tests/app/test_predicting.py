"""A shot asked in SI is the one that the command line asks in units, and its sliders stay within the bench."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest
from click.testing import CliRunner
from pyroshock.app.predict.cli import predict
from pyroshock.app.predict.predicting import ShotRequest, predicted_json
from pyroshock.app.predict.shots import sliders
from pyroshock.app.twins import building as twins
from pyroshock.app.twins.benches import shipped_bench
from pyroshock.app.twins.building import BuiltTwin, TwinRequest, twin_of
from pyroshock.dataset.domain import Domain
from pyroshock.dataset.rows import by_name
from pyroshock.doe.space import hammer_space, shipped_factors, space_from_text
from pyroshock.signals.srs.spectrum import octave_grid
from pyroshock.training.models.analytic import Analytic
from pyroshock.training.registry.contact_stage import RegisteredContact
from pyroshock.training.registry.records import Cost, DatasetName, RegisteredModel, Version
from pyroshock.twin.chain import Twin
from pyroshock.twin.contact.stage import LawContact
from pyroshock.twin.setting import THESIS
from support.records.pulse_tables import PREDICTORS, pulse_table
from support.records.twin_parts import unsolved

LINES = tuple(octave_grid(200.0, 4000.0, 3).tolist())


@pytest.fixture
def bench(tmp_path, monkeypatch):
    """The shipped bench, its plate without a solution."""
    monkeypatch.chdir(tmp_path)
    for name in ("MLFLOW_TRACKING_URI", "PYROSHOCK_DB"):
        monkeypatch.delenv(name, raising=False)

    monkeypatch.setattr(twins, "solved", unsolved)
    return twin_of(None, "sqlite:///none.db", TwinRequest(frequency_hz=LINES))


@pytest.mark.parametrize(
    ("words", "shot"),
    [
        ((), ShotRequest()),
        (("--tank-pressure", "3bar", "--bullet-mass", "0.2kg", "--impact-position", "#2"),
         ShotRequest(tank_pressure_pa=3e5, bullet_mass_kg=0.2, impact_position="#2")),
        (("--velocity", "8m/s", "--tip", "PLA", "--tip-radius", "3cm", "--anvil", "steel", "--insulator", "polymeric"),
         ShotRequest(impact_velocity_m_s=8.0, tip_material="PLA", tip_radius_m=0.03, anvil_material="steel",
              insulator="polymeric")),
    ],
)  # fmt: skip
def test_json_is_that_of_the_command_line(bench, words, shot):
    result = CliRunner().invoke(
        predict, [*words, "--draws", "8", "--frequencies", "200:4000:3", "--seed", "3", "--json"]
    )
    assert result.exit_code == 0, result.stderr
    assert json.loads(result.stdout) == json.loads(json.dumps(predicted_json(bench, shot, draws=8, seed=3)))


def test_both_pressure_and_velocity_are_refused(bench):
    with pytest.raises(ValueError, match="expected exactly one of them"):
        predicted_json(bench, ShotRequest(tank_pressure_pa=1e5, impact_velocity_m_s=3.0))


def test_sliders_stay_within_the_bench(bench):
    found = sliders(bench)
    numbers = found["numbers"]
    assert (numbers["tank_pressure_pa"]["low"], numbers["tank_pressure_pa"]["high"]) == (0.2e5, 8e5)
    assert numbers["bullet_mass_kg"]["levels"] == [0.2, 0.5, 1.0]
    assert numbers["tip_radius_m"]["levels"] == pytest.approx([0.03, 0.045, 0.06])
    for name, each in numbers.items():
        assert each["low"] <= each["default"] <= each["high"], name
        assert each["domain"] is None
    choices = found["choices"]
    assert choices["tip_material"]["default"] == "steel"
    assert choices["anvil_material"]["options"][0]["name"] == "none"
    assert [each["name"] for each in choices["impact_position"]["options"]] == ["#1", "#2"]
    assert all(option["known"] for each in choices.values() for option in each["options"])
    json.dumps(found, allow_nan=False)


def test_defaults_of_the_sliders_can_be_fired(bench):
    found = sliders(bench)
    own = {name: each["default"] for name, each in found["choices"].items()}
    own |= {name: each["default"] for name, each in found["numbers"].items() if name != "impact_velocity_m_s"}
    assert predicted_json(bench, ShotRequest(**own), draws=8) == predicted_json(bench, ShotRequest(), draws=8)


def test_every_material_is_offered_once(bench):
    names = [each["name"] for each in sliders(bench)["choices"]["tip_material"]["options"]]
    assert sorted(names) == sorted({material.name for material in bench.materials.values()})


def test_lab_of_its_own_limits_the_sliders(bench):
    text = shipped_factors("gun") + "\n[bench]\nmax_regulated_pressure_pa = 0.6e6\nmax_bullet_mass_kg = 0.8\n"
    numbers = sliders(bench, space_from_text(text))["numbers"]
    assert (numbers["tank_pressure_pa"]["high"], numbers["bullet_mass_kg"]["high"]) == (6e5, 0.8)


def test_factors_without_bullets_are_refused(bench):
    with pytest.raises(ValueError, match="no numbers of bullet_mass"):
        sliders(bench, hammer_space())


def test_sliders_show_what_a_model_has_learned():
    """Tips of radius 15 and 30 mm, of aluminum, delrin and polyurethane; anvils of all three kinds."""
    table = pulse_table(np.random.default_rng(0), repetitions=2)
    ids = ("key", "run", "0" * 64)
    version = Version("hertz", 4, DatasetName("spring", "5" * 64, "hammer"), "repetitions", 0, {}, Cost(1.0, 1.0), *ids,
                      datetime(2026, 1, 1, tzinfo=UTC))  # fmt: skip
    model = RegisteredModel(version, Analytic("hertz").fit(table, np.random.default_rng(0)), PREDICTORS,
                            Domain.of(table), {})  # fmt: skip
    materials = by_name(THESIS.values(), {})
    built = BuiltTwin(Twin(RegisteredContact(model)), shipped_bench(), materials["aluminum"], materials)
    found = sliders(built)
    assert found["numbers"]["tip_radius_m"]["domain"] == [0.015, 0.03]
    velocity = table.column("impact_velocity")
    assert found["numbers"]["impact_velocity_m_s"]["domain"] == [velocity.min(), velocity.max()]
    known = {each["name"]: each["known"] for each in found["choices"]["tip_material"]["options"]}
    assert known["aluminum"] and known["delrin"] and not known["steel"]
    anvils = {each["name"]: each["known"] for each in found["choices"]["anvil_material"]["options"]}
    assert anvils["none"] and anvils["steel"] and not anvils["delrin"]
    law = replace(built, twin=Twin(LawContact("hertz")))
    assert sliders(law)["numbers"]["tip_radius_m"]["domain"] is None
