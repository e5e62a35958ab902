"""The contact's stage beside the virtual bench: another code, other integrators, and for some effects other laws."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.diagnosis.observables.contact.features import OBSERVABLES
from pyroshock.diagnosis.observables.contact.stage import ContactObservables
from pyroshock.diagnosis.record import CampaignRecord, Series
from pyroshock.twin.effects import Effect, effect
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.effects import EffectSwitch as Played
from pyroshock.virtualbench.impact.build import Impactor, ImpactTarget, contact_material, target
from pyroshock.virtualbench.impact.strike import STEP_S, strike_many
from support.records.contact_campaigns import MASS_KG, hammer_record

TOLERANCE = np.array([one.tolerance for one in OBSERVABLES])
RATE_HZ = 102_400.0
BARE = (("aluminum", 0.03, "none", "none"), ("delrin", 0.03, "none", "none"), ("steel", 0.015, "none", "none"))


def played(strengths: Mapping[str, float]) -> CampaignRecord:
    """The runs of an elastic campaign, struck again on the virtual bench: a rigid impactor and a face without mass."""
    record, rng = hammer_record(settings=BARE, repetitions=2), np.random.default_rng(0)
    tips = [contact_material(BARE[run.configuration][0]) for run in record.runs]
    strikers = [Impactor(tip, BARE[run.configuration][1], MASS_KG) for tip, run in zip(tips, record.runs, strict=True)]
    acting = Effects(tuple(Played(name, strength=value) for name, value in strengths.items()))
    speeds = [run.velocity_m_s for run in record.runs if run.velocity_m_s is not None]
    targets: list[ImpactTarget] = [target("aluminum", 0.01)] * len(strikers)
    hits = strike_many(strikers, targets, acting, speeds, np.random.default_rng(1), tail_s=0.0)
    forces = [sampled(hit.force_n, rng) for hit in hits]
    runs = tuple(replace(run, force=force) for run, force in zip(record.runs, forces, strict=True))
    return replace(record, runs=runs)


def sampled(force_n: np.ndarray, rng: np.random.Generator) -> Series:
    last = force_n.size * STEP_S
    time = (np.arange(-20, int(1.3 * last * RATE_HZ) + 20) + rng.random()) / RATE_HZ
    return Series(np.interp(time, STEP_S * np.arange(force_n.size), force_n, left=0, right=0), RATE_HZ, float(time[0]))


def residual(strengths: Mapping[str, float], effects: list[Effect]) -> np.ndarray:
    stage = ContactObservables(played(strengths))
    return np.asarray(np.abs((stage.measured() - stage.simulated(effects)) / TOLERANCE).max(axis=0))


def test_ideal_bench_is_nominal() -> None:
    assert residual({}, []).max() < 0.15


@pytest.mark.parametrize(
    ("played_as", "strength", "same"),
    [
        ("contact.plate_compliance", 0.3, effect("contact.plate_compliance", share=0.3)),
        ("contact.effective_mass", 4.0, effect("contact.effective_mass", mass_factor=1.2)),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_effect_of_the_bench_is_the_twins(played_as: str, strength: float, same: Effect) -> None:
    before, after = residual({played_as: strength}, []), residual({played_as: strength}, [same])
    assert before.max() > 3
    assert after.max() < 0.5


@pytest.mark.parametrize("pressure", [1.5, 3.0, 5.0, 7.0, 9.0])
def test_yield_of_the_bench_is_not_the_twins(pressure: float) -> None:
    """Zhao, Maietta and Chang's loading beside Thornton's: no pressure brings all observables near their tolerance."""
    same = effect("contact.plastic_yield", pressure_over_yield_strength=pressure)
    assert residual({"contact.plastic_yield": 1.0}, [same]).max() > 5
