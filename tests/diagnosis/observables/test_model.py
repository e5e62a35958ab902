"""Any contact model as a simulator: Hertz' law in a model's place, and a model that never saw the
mass."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pyroshock.array_types import Floats
from pyroshock.dataset.predictors import shipped
from pyroshock.diagnosis.observables.contact.features import NAMES, OBSERVABLES
from pyroshock.diagnosis.observables.contact.registered_model import RegisteredContactStage
from pyroshock.diagnosis.observables.contact.stage import ContactObservables
from pyroshock.diagnosis.record import CampaignRecord
from pyroshock.training.models.analytic import Analytic
from pyroshock.training.registry.contact_stage import RegisteredContact
from pyroshock.twin.contact.impacts import ContactEffect
from pyroshock.twin.contact.stage import LawContact
from pyroshock.twin.contact_interface import ForcePulses, ImpactBatch, OutOfDomain
from pyroshock.twin.effects import catalogue, effect
from support.records.contact_campaigns import MASS_KG, hammer_record
from support.records.pulse_tables import pulse_table

TOLERANCE = np.array([one.tolerance for one in OBSERVABLES])
BARE = (
    ("aluminum", 0.03, "none", "none"),
    ("delrin", 0.03, "steel", "polymeric"),
    ("steel", 0.02, "aluminum", "none"),
)
RECORD = hammer_record(settings=BARE)
RECORD_OF_TABLE = hammer_record(settings=BARE[:2])
LAW = RegisteredContactStage(RECORD, LawContact())
CONTACT = [kind() for kind in catalogue().values() if issubclass(kind, ContactEffect)]


@dataclass(frozen=True)
class OneMass:
    """A model of few phases that was trained with one hammer, and is not asked for the mass."""

    factor: float = 1.1
    label: str = "models:/few-phases@champion"
    normals: int = 0

    def pulses(self, strikes: ImpactBatch, z: Floats | None = None) -> ForcePulses:
        hammer = [replace(setting, impactor_mass_kg=MASS_KG) for setting in strikes.settings]
        law_pulses = LawContact().pulses(ImpactBatch(hammer, strikes.impact_velocity_m_s), z)
        return ForcePulses(
            law_pulses.contact_time_s,
            self.factor * law_pulses.force_n[:, ::4],
            law_pulses.compression_time_s,
        )

    def outside(self, strikes: ImpactBatch) -> list[tuple[OutOfDomain, ...]]:
        return [()] * len(strikes)


def shots(mass_kg: float) -> CampaignRecord:
    """Bullets of another mass, whose true pulses are Hertz'."""
    heavier = hammer_record(
        [effect("contact.effective_mass", mass_factor=mass_kg / MASS_KG)], settings=BARE
    )
    runs = tuple(replace(run, bullet_mass_kg=mass_kg) for run in heavier.runs)
    return replace(heavier, kind="gun", runs=runs)


@pytest.mark.parametrize("each", CONTACT, ids=lambda each: each.id)
def test_effects_correct_as_they_change_the_law(each: ContactEffect) -> None:
    off = (LAW.changes([[each]]) - ContactObservables(RECORD).changes([[each]])) / TOLERANCE
    assert np.abs(off).max() < 0.3


def test_bias_of_the_model_is_its_gap() -> None:
    stage = RegisteredContactStage(RECORD, OneMass())
    assert stage.residuals()[:, 0] == pytest.approx(-np.log(1.1), abs=0.01)
    assert stage.simulator == "models:/few-phases@champion"
    stage = RegisteredContactStage(shots(0.5), OneMass(factor=1.0))
    ratio = 0.5 / MASS_KG
    assert stage.residuals().mean(axis=0)[NAMES.index("ln_impulse")] == pytest.approx(
        np.log(ratio), abs=0.01
    )
    heavier = stage.measured() - stage.simulated(
        [effect("contact.effective_mass", mass_factor=ratio)]
    )
    assert np.abs((heavier / TOLERANCE).mean(axis=0)).max() < 0.4


def test_registered_model_of_twenty_points() -> None:
    predictors = shipped("hammer")
    table = pulse_table(np.random.default_rng(0), repetitions=2)
    version = SimpleNamespace(name="gp", version=3, champion_of="hammer", label="gp/3")
    law = Analytic("hertz").fit(table, np.random.default_rng(0))
    model: Any = SimpleNamespace(version=version, model=law, predictors=predictors.predictors)
    stage = RegisteredContactStage(RECORD_OF_TABLE, RegisteredContact(model, predictors))
    assert stage.simulator == "models:/gp@champion"
    off = (stage.simulated() - ContactObservables(RECORD_OF_TABLE).simulated()) / TOLERANCE
    assert np.abs(off).max() < 0.5


def test_what_a_model_asks_for_must_be_given() -> None:
    class Asking(OneMass):
        registered = SimpleNamespace(predictors=[SimpleNamespace(name="plate_mass")])

    with pytest.raises(
        ValueError, match=r"few-phases.* asks for the plate's mass.*give plate_mass_kg"
    ):
        RegisteredContactStage(RECORD, Asking())
    assert (
        RegisteredContactStage(RECORD, Asking(), plate_mass_kg=8.0).settings[0].plate_mass_kg == 8.0
    )
    unknown = hammer_record(settings=(("delrin", 0.03, "none", "polymeric"),))
    with pytest.raises(ValueError, match="insulator = 'polymeric' without an anvil"):
        RegisteredContactStage(unknown, LawContact())


def test_hertz_as_a_model_is_hertz() -> None:
    assert LAW.simulator == "contact:hertz"
    off = (LAW.simulated() - ContactObservables(RECORD).simulated()) / TOLERANCE
    assert np.abs(off).max() < 0.2
    change = LAW.changes([[effect("sensor.velocity_gain", gain=1.1)]])[0]
    assert change[:, NAMES.index("ln_impulse")] == pytest.approx(-np.log(1.1), abs=5e-3)
    runs = (replace(RECORD.runs[0], velocity_m_s=None), *RECORD.runs[1:])
    stage = RegisteredContactStage(replace(RECORD, runs=runs), LawContact())
    assert np.isnan(stage.simulated()).all(axis=1).tolist() == [True] + [False] * (len(runs) - 1)
