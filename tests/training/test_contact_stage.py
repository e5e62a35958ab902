"""A registered model in the twin: asked with settings as with rows of a dataset, random as its spread says."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import numpy as np
import pytest
from pyroshock.dataset.domain import Domain
from pyroshock.dataset.predictors import shipped
from pyroshock.training.contact_stage import RegisteredContact
from pyroshock.training.models.analytic import Analytic
from pyroshock.training.models.base import ContactPrediction
from pyroshock.training.models.calibrated import Calibrated
from pyroshock.training.records import Cost, DatasetName, RegisteredModel, Version
from pyroshock.twin.chain import Twin
from pyroshock.twin.contact.stage import LawContact
from pyroshock.twin.materials import THESIS
from pyroshock.twin.plates import PlateStage
from pyroshock.twin.setting import Setting
from pyroshock.twin.strikes import Strikes
from support.records.pulse_tables import PREDICTORS, pulse_table
from support.records.twin_parts import ringing_plate

TABLE = pulse_table(np.random.default_rng(0), repetitions=2)


def registered(model: Any, champion_of: str | None = "hammer") -> RegisteredModel:
    when = datetime(2026, 1, 1, tzinfo=UTC)
    dataset = DatasetName("spring", "5" * 64, "hammer")
    cost = Cost(1.0, 1.0)
    version = Version("gp", 3, dataset, "repetitions", 0, {}, cost, "key", "run", "0" * 64, when, champion_of)
    return RegisteredModel(version, model, PREDICTORS, Domain.of(TABLE), {})


def hertz() -> RegisteredModel:
    return registered(Analytic("hertz").fit(TABLE, np.random.default_rng(0)))


class WithSpread:
    """Half a sine of 100 N over 1 ms, points uncertain by 10 N, the time by 0.1 ms."""

    def predict(self, inputs: Any) -> ContactPrediction:
        n = len(inputs)
        force = np.tile(100 * np.sin(np.pi * np.linspace(0, 1, 20)), (n, 1))
        return ContactPrediction(force, np.full(n, 1e-3), np.full((n, 20), 10.0), np.full(n, 1e-4))


def hit(**own: Any) -> Setting:
    """Of the table: a hammer with a tip of delrin on aluminium."""
    given: dict[str, Any] = {
        "impactor_mass_kg": 0.32,
        "tip": THESIS["delrin"],
        "tip_radius_m": 0.03,
        "plate": THESIS["aluminum"],
        "plate_thickness_m": 0.01,
        "plate_mass_kg": 8.0,
        "impact_velocity_m_s": 1.0,
    }
    return Setting(**given | own)


def strikes(*settings: Setting) -> Strikes:
    return Strikes(settings, np.array([setting.impact_velocity_m_s for setting in settings]))


def test_a_setting_asks_as_its_row_of_the_dataset_does():
    column = [p.name for p in PREDICTORS].index("boundary_conditions")
    rows = np.flatnonzero((TABLE.tip_material == "delrin") & (TABLE.x[:, column] == 0))
    settings = []
    for row in rows:
        anvil, soft = (int(TABLE.inputs.column(name)[row]) for name in ("anvil_material", "insulator"))
        layer = (None, THESIS["aluminum"], THESIS["steel"])[anvil]
        velocity = float(TABLE.inputs.column("impact_velocity")[row])
        settings.append(hit(anvil=layer, insulator=("none", "polymeric")[soft], impact_velocity_m_s=velocity))
    asked = RegisteredContact(hertz()).inputs(strikes(*settings))
    np.testing.assert_array_equal(asked.x, TABLE.x[rows])
    np.testing.assert_array_equal(asked.impactor_mass_kg, TABLE.impactor_mass_kg[rows])


def test_guns_predictors_have_bullet_and_plate_mass():
    gun = shipped("gun")
    asked = RegisteredContact(
        replace(hertz(), predictors=gun.predictors, domain=None),  # not asked for
        gun,
    ).inputs(strikes(hit(impactor_mass_kg=0.7, plate_mass_kg=9.3)))
    assert asked.column("bullet_mass") == [0.7] and asked.column("plate_mass") == [9.3]


def test_a_law_that_was_registered_is_the_law():
    asked = strikes(hit(), hit(impact_velocity_m_s=2.0, anvil=THESIS["steel"]))
    mine, theirs = RegisteredContact(hertz()).pulses(asked), LawContact("hertz").pulses(asked)
    np.testing.assert_allclose(mine.contact_time_s, theirs.contact_time_s, rtol=1e-12)
    phases = np.linspace(0, 1, 65)
    for few, many in zip(mine.force_n, theirs.force_n, strict=True):
        np.testing.assert_allclose(few, np.interp(np.linspace(0, 1, 20), phases, many), atol=2e-3 * many.max())


def test_random_pulse_moves_by_its_spread():
    stage = RegisteredContact(registered(WithSpread()))
    z = np.array([[0.0, 0.0], [1.0, -2.0], [-30.0, -30.0]])
    pulses = stage.pulses(strikes(hit(), hit(), hit()), z)
    mean = stage.pulses(strikes(hit()))
    np.testing.assert_allclose(pulses.force_n[0], mean.force_n[0])
    np.testing.assert_allclose(pulses.force_n[1, 1:-1], mean.force_n[0, 1:-1] + 10.0)
    np.testing.assert_allclose(pulses.contact_time_s[:2], [1e-3, 8e-4])
    assert np.all(pulses.force_n >= 0) and np.all(pulses.contact_time_s > 0)
    assert np.all(pulses.force_n[:, [0, -1]] == 0)


def test_compression_ends_at_the_peak():
    pulses = RegisteredContact(registered(WithSpread())).pulses(strikes(hit()))
    assert pulses.compression_time_s[0] == pytest.approx(0.5e-3, rel=0.06)


def test_what_lies_outside_is_told():
    told, inside = RegisteredContact(hertz()).outside(strikes(hit(impact_velocity_m_s=9.0), hit()))
    assert (told[0].predictor, told[0].value) == ("impact_velocity", 9.0)
    assert " to " in told[0].range
    assert inside == ()


@pytest.mark.parametrize(("champion", "label"), [("hammer", "models:/gp@champion"), (None, "models:/gp/3")])
def test_label_is_mlflows(champion, label):
    assert RegisteredContact(registered(WithSpread(), champion)).label == label


def test_other_predictors_are_refused():
    with pytest.raises(ValueError, match="gp@3 learned from other predictors than the set 'gun'"):
        RegisteredContact(hertz(), shipped("gun"))


def test_what_a_setting_does_not_tell_is_named():
    soft = replace(THESIS["delrin"], yield_strength_pa=None)
    with pytest.raises(ValueError, match="asks for tip_yield_strength, which this setting does not tell"):
        RegisteredContact(hertz()).pulses(strikes(hit(tip=soft)))


def test_twin_has_the_models_bands():
    model = Calibrated(Analytic("hertz")).fit(TABLE, np.random.default_rng(0))
    twin = Twin(RegisteredContact(registered(model)), plate=PlateStage({"aluminum": ringing_plate()}), samples=2_000)
    shot = twin.predict(hit(), draws=32)
    low, high = shot.peak_force_n.ci90
    assert low < 0.95 * shot.peak_force_n.mean < 1.05 * shot.peak_force_n.mean < high
    assert shot.models["contact"] == "models:/gp@champion"
