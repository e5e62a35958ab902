"""What the laboratory measured narrows the parameter that it is of, and is not overruled
silently."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.inference.effect_laws import LawRanges, laws_of
from pyroshock.diagnosis.inference.posterior import HypothesisPosterior
from pyroshock.diagnosis.known_facts import CONTRADICTION_U, contradictions, known_fact_sentences
from pyroshock.diagnosis.observables.gun.stage import GunObservables
from pyroshock.schema.known_facts import KnownFact, effect_parameters
from pyroshock.twin.effects import Effect, catalogue, effect
from support.records.gun_campaigns import gun_record

IDS = ("gun.dead_volume", "gun.valve_flow", "sensor.pressure_offset", "sensor.velocity_gain")
VOLUME = "gun.dead_volume.volume_m3"
GAIN = "sensor.velocity_gain.gain"
DEAD_VOLUME = effect("gun.dead_volume", volume_m3=1e-3)
HIGH_GAIN = effect("sensor.velocity_gain", gain=1.05)


def fact(name: str, value: float, u: float) -> KnownFact:
    return KnownFact(name, value, u, "a certificate")


def ranges_of(*facts: KnownFact) -> LawRanges:
    return LawRanges(
        known_facts={(parameter.effect, parameter.parameter): parameter for parameter in facts}
    )


@cache
def posterior_of(
    planted: Effect | None, *facts: KnownFact, ids: Sequence[str] = IDS
) -> HypothesisPosterior:
    record = replace(gun_record([planted] if planted else [], seed=3), known_facts=facts)
    stage = GunObservables(record)
    return HypothesisPosterior.of(
        GapTable.of(record, [stage]), [stage], [catalogue()[name] for name in ids]
    )


@pytest.mark.parametrize("name", list(effect_parameters()))
def test_measured_parameter_has_its_own_prior_in_every_law_that_has_it(name: str):
    own = effect_parameters()[name]
    value = (own.low + own.high) / 2
    measured = fact(name, value, (own.high - own.low) / 100)
    laws = laws_of(
        catalogue()[measured.effect], ranges_of(measured), {"bullet": ((0, 1), ("a", "b"))}
    )
    having = [law for law in laws if name.rpartition(".")[2] in law.values(np.zeros(law.size))]
    assert having
    for law in having:
        (coordinate,) = (
            item for item in law.coordinates if item.parameter.name == measured.parameter
        )
        places = coordinate.value(np.array([-1.0, 0.0, 1.0]))
        np.testing.assert_allclose(places, value + measured.u * np.array([-1.0, 0.0, 1.0]))
    assert not any("(gross)" in law.name for law in having if len(law.coordinates) == 1)
    effects = [law.effect(np.zeros(law.size)) for law in laws]
    assert all(getattr(each, measured.parameter) == pytest.approx(value) for each in effects), (
        "of all its laws"
    )


def test_certificate_takes_the_gross_error_away_and_does_not_say_that_the_sensor_errs():
    kind = catalogue()["sensor.velocity_gain"]
    assert any("(gross)" in law.name for law in laws_of(kind, LawRanges(), {}))
    (law,) = laws_of(kind, ranges_of(fact(GAIN, 1.0, 0.002)), {})
    assert not law.surely_acts
    (law,) = laws_of(kind, ranges_of(fact(GAIN, 1.05, 0.002)), {})
    assert law.surely_acts
    # a calibration covers the range, unless it says how the gain grows
    both = ranges_of(fact(GAIN, 1.05, 0.002), fact("sensor.velocity_gain.growth", 1.0, 0.1))
    assert {law.name for law in laws_of(kind, both, {})} == {"gain (known)", "gain+growth (known)"}
    # a law of another regime leaves out what was measured
    (law,) = laws_of(
        catalogue()["gun.valve_flow"],
        ranges_of(fact("gun.valve_flow.opening_time_s", 0.1, 0.01)),
        {},
    )
    assert "steady" not in law.name
    # how an effect acts is not whether
    shape = fact("contact.tip_geometry.reference_indentation_m", 3e-4, 1e-5)
    assert not any(
        law.surely_acts
        for law in laws_of(catalogue()["contact.tip_geometry"], ranges_of(shape), {})
    )
    for name, value in (
        ("sensor.pressure_offset.fading_1_pa", 2.5e-6),
        ("sensor.velocity_gain.growth", 1.0),
    ):
        shape = fact(name, value, 0.01 * value)
        laws = laws_of(catalogue()[shape.effect], ranges_of(shape), {})
        assert not any(law.surely_acts for law in laws)
        assert {law.name.partition(" (")[0].count("+") for law in laws} == {
            0,
            1,
        }  # with the shape and without it


@pytest.mark.parametrize(
    ("planted", "measured"),
    [(DEAD_VOLUME, fact(VOLUME, 1e-3, 2e-5)), (HIGH_GAIN, fact(GAIN, 1.05, 0.001))],
)
def test_fact_narrows_the_posterior_of_its_parameter(planted: Effect, measured: KnownFact):
    def width(posterior: HypothesisPosterior) -> float:
        (own,) = posterior.parameters(measured.effect)
        assert own.ci90[0] <= measured.value <= own.ci90[1]
        return own.ci90[1] - own.ci90[0]

    free, known = posterior_of(planted), posterior_of(planted, measured)
    assert width(known) < 0.5 * width(free)
    assert width(known) <= 2 * 1.645 * measured.u * 1.001
    assert known.inclusion(measured.effect) > 0.99 > known.inclusion("gun.valve_flow") + 0.9
    assert known.best.effects[0] == measured.effect
    assert list(known_fact_sentences(known)) == [
        f"known: {measured.name} = {measured.words}, taken as the prior of this parameter"
    ]


@pytest.mark.parametrize(
    ("planted", "measured", "true"),
    [
        (HIGH_GAIN, fact(GAIN, 1.0, 0.002), 1.05),
        (DEAD_VOLUME, fact(VOLUME, 1e-4, 1e-5), 1e-3),
        (None, fact(VOLUME, 1e-3, 1e-5), 0.0),
        (effect("gun.valve_flow", loss_coefficient=30.0, opening_time_s=0.05),
         fact("gun.valve_flow.opening_time_s", 0.3, 0.002), 0.05),
    ],
)  # fmt: skip
def test_fact_that_the_record_contradicts_is_held_and_both_are_named(
    planted: Effect | None, measured: KnownFact, true: float
):
    posterior = posterior_of(planted, measured)
    for fitted in posterior.parameters(measured.effect):
        if fitted.parameter == measured.parameter:
            assert abs(fitted.value - measured.value) < 4.5 * measured.u
    (contradiction,) = contradictions(posterior)
    assert contradiction.uncertainties > CONTRADICTION_U
    low, high = contradiction.fitted.ci90
    assert abs(contradiction.fitted.value - true) < max(
        0.6 * abs(measured.value - true), 1.2 * (high - low) / 2
    )
    sentence = list(known_fact_sentences(posterior))[-1]
    value = f"{contradiction.fitted.value:.4g}"
    assert sentence.startswith(
        f"{measured.name}: campaign.toml states {measured.words}, and the record is explained"
    )
    assert value in sentence


@pytest.mark.parametrize(
    ("planted", "measured"),
    [
        (None, fact(GAIN, 1.0, 0.002)),
        (None, fact("gun.valve_flow.opening_time_s", 0.02, 1e-3)),
        (DEAD_VOLUME, fact(GAIN, 1.0, 0.002)),
        (effect("gun.valve_flow", loss_coefficient=30.0, opening_time_s=0.05),
         fact("gun.valve_flow.opening_time_s", 0.05, 0.002)),
    ],
)  # fmt: skip
def test_true_fact_is_not_contradicted(planted: Effect | None, measured: KnownFact):
    assert not list(contradictions(posterior_of(planted, measured)))


def test_fact_of_what_is_not_looked_for_is_said_not_to_be_used():
    measured = fact("plate.stiffness.frequency_factor", 1.0, 0.001)
    (sentence,) = known_fact_sentences(posterior_of(None, measured, ids=("gun.dead_volume",)))
    assert sentence.endswith("not used: plate.stiffness was not looked for in this campaign")
