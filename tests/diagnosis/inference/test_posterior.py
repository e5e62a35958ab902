"""What the inference says of effects and sets: probabilities, credible sets, parameters, and the
case for unknown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from pyroshock.diagnosis.gap import GapMetric, GapTable
from pyroshock.diagnosis.inference.credible_sets import credible_sets, inclusion
from pyroshock.diagnosis.inference.model_search import ModelLibrary, fit_sets
from pyroshock.diagnosis.inference.posterior import (
    HypothesisPosterior,
    _fit_neighbours,
    common_effects,
    fitted_effects,
    fitted_parameters,
)
from pyroshock.diagnosis.inference.subset_fit import no_effects
from pyroshock.diagnosis.inference.unexplained_gap import UnexplainedEvidence
from pyroshock.diagnosis.observables.gun.stage import GunObservables
from pyroshock.twin.effects import Effect, catalogue, effect
from scipy.stats import norm
from support.records.gun_campaigns import gun_record
from support.records.linear_problems import linear_problem
from support.records.toy_bench import (
    Design,
    Scatter,
    ToyLayer,
    ToyLoss,
    ToyMass,
    campaign,
    stages_of,
)

IDS = ("gun.dead_volume", "sensor.pressure_offset", "sensor.velocity_gain")
COUNT = 10


@cache
def gun_posterior(planted: Effect | None = None, seed: int = 3) -> HypothesisPosterior:
    record = gun_record([planted] if planted else [], seed=seed)
    stage = GunObservables(record)
    return HypothesisPosterior.of(
        GapTable.of(record, [stage]), [stage], [catalogue()[name] for name in IDS]
    )


@cache
def toy_posterior(*planted: Effect) -> HypothesisPosterior:
    """Gun and contact of the toy bench."""
    scatter = Scatter(run=(0.004, 0.01, 0.1))
    record = campaign(
        planted,
        np.random.default_rng(1),
        Design((0.5, 2.0), (0.25, 1.0), ("none", "polymeric"), 2),
        scatter,
    )
    stages = stages_of(record)[:2]
    kinds = (ToyLoss, ToyMass, ToyLayer)
    return HypothesisPosterior.of(GapTable.of(record, stages), stages, kinds)


def linear_posterior(
    responses: np.ndarray, gap: np.ndarray, sets: Sequence[Sequence[str]]
) -> HypothesisPosterior:
    """Of effects with these responses (m, C) to a gap (C,) in tolerances; these sets alone are in
    the library."""
    problem = linear_problem(responses[:, :, None], gap[:, None], 0.01 * np.eye(COUNT))
    library = ModelLibrary(problem, {(): no_effects(problem)})
    for names in sets:  # one by one: each from what is the best so far
        fit_sets(problem, library, [names])
    return HypothesisPosterior(
        problem.gap, library, GapMetric.of(problem.gap), tuple(library.weights())
    )


DEAD_VOLUME = effect("gun.dead_volume", volume_m3=1e-3)
GAIN = effect("sensor.velocity_gain", gain=1.05)


@pytest.mark.parametrize("planted", [DEAD_VOLUME, GAIN])
def test_planted_effect_is_in_the_best_set_within_its_interval(planted: Effect):
    posterior = gun_posterior(planted)
    assert posterior.major(posterior.best)[0] == planted.id
    others = [posterior.inclusion(name) for name in posterior.effects if name != planted.id]
    assert posterior.inclusion(planted.id) > max(
        0.75, *others
    )  # evidence counts for less than it says
    assert posterior.taken(posterior.best) > 0.9
    (own,) = gun_posterior(planted).parameters(planted.id)
    item = next(item for item in planted.parameters() if item.name == own.name)
    low, high = own.ci90
    width = high - low  # nine intervals of ten hold it: none of two may be far off
    assert low - 0.5 * width <= getattr(planted, own.name) <= high + 0.5 * width
    assert low <= own.value <= high
    assert own.unit == item.unit


def test_best_set_is_known_without_each_of_its_effects():
    """Else nothing says what an effect gains. The library begins with a set that is better without
    two of its three."""
    rng = np.random.default_rng(6)
    responses = 5 * rng.standard_normal((3, COUNT))
    problem = linear_problem(responses[:, :, None], responses[0][:, None], 0.01 * np.eye(COUNT))
    library = ModelLibrary(problem, {(): no_effects(problem)})
    fit_sets(problem, library, [list(problem.effects)])
    _fit_neighbours(problem, library)
    assert library.best().effects == ("gun.linear_0",)
    assert {frozenset(fit.effects) for fit in library.fits.values()} >= {
        frozenset(library.best().effects) - {name} for name in library.best().effects
    }


@pytest.mark.parametrize(
    "planted", [(ToyLoss(0.15),), (ToyMass(1.4), ToyLayer(0.3))], ids=["one", "two"]
)
def test_effects_between_stages_are_told_apart(planted: tuple[Effect, ...]):
    posterior = toy_posterior(*planted)
    assert set(posterior.major(posterior.best)) == {each.id for each in planted}


def test_inclusion_is_the_weight_of_the_sets_that_have_it():
    posterior = gun_posterior(GAIN)
    for name in posterior.effects:
        without = sum(weight for fit, weight in posterior.weighted if name not in fit.effects)
        assert posterior.inclusion(name) == pytest.approx(1 - without)
    assert gun_posterior().none_probability > 0.95
    assert gun_posterior(effect("sensor.velocity_gain", gain=1.004)).none_probability > 0.9
    assert gun_posterior(DEAD_VOLUME).none_probability < 0.01
    posterior = gun_posterior(DEAD_VOLUME)
    none, *poor = posterior.poor_sets
    assert none.laws == ()
    assert all(posterior.taken(fit) < 0.5 for fit in poor)
    assert posterior.best not in poor
    assert posterior.taken(posterior.library.fits[()]) == pytest.approx(0.0)
    (row,) = posterior.parameters("gun.dead_volume")
    fit = next(fit for fit, _ in posterior.weighted if "gun.dead_volume" in fit.effects)
    (own,) = [
        fitted_effect
        for fitted_effect in fitted_effects(fit)
        if fitted_effect.id == "gun.dead_volume"
    ]
    assert own.as_json()["volume_m3"] == pytest.approx(row.value)


@pytest.mark.parametrize("planted", [None, DEAD_VOLUME, GAIN])
def test_sets_and_none_have_probability_one(planted: Effect | None):
    posterior = gun_posterior(planted)
    sets = posterior.set_probabilities()
    assert not sets or sum(sets.values()) + posterior.none_probability == pytest.approx(1.0)
    assert sets or posterior.none_probability > 0.97


def test_set_near_the_tolerance_is_within_it_with_a_probability():
    """One parameter whose posterior is normal: the mass where its response is below one
    tolerance."""
    response = np.full((1, COUNT), 2.0)
    posterior = linear_posterior(response, np.full(COUNT, 1.0), [("gun.linear_0",)])
    (fit,) = [fit for fit in posterior.library.fits.values() if fit.laws]
    (mean,), (spread,) = fit.u, np.sqrt(np.diag(np.linalg.inv(fit.precision)))
    wanted = norm.cdf((0.5 - mean) / spread) - norm.cdf((-0.5 - mean) / spread)
    assert 0.1 < wanted < 0.9
    assert posterior.within_tolerance(fit) == pytest.approx(wanted, abs=0.08)
    assert posterior.within_tolerance(posterior.library.fits[()]) == 1.0


def test_none_is_asked_of_every_family_of_observables():
    """An effect that the metric hardly feels, and a family of its own by three tolerances: half a
    tolerance of a velocity, three of a residual pressure."""
    responses = np.stack([np.full((1, COUNT), 0.5), np.full((1, COUNT), 3.0)], axis=2)
    problem = linear_problem(responses, responses[0], 0.01 * np.eye(2 * COUNT))
    trace = replace(problem.gap.observables[1], channel="tank_pressure")
    gap = replace(problem.gap, observables=(problem.gap.observables[0], trace))
    problem = replace(problem, gap=gap)
    library = ModelLibrary(problem, {(): no_effects(problem)})
    fit_sets(problem, library, [["gun.linear_0"]])
    posterior = HypothesisPosterior(gap, library, GapMetric.of(gap), tuple(library.weights()))
    assert not posterior.metric.size(gap).beyond_noise
    assert posterior.within_tolerance(posterior.best) == 0.0
    assert posterior.none_probability < 0.01
    assert posterior.set_probabilities()["gun.linear_0",] > 0.99


@pytest.mark.parametrize(
    ("size", "low", "high"), [(0.9, 0.99, 1.0), (1.6, 0.5, 0.75), (2.5, 0.0, 0.15)]
)
def test_gap_that_no_effect_explains_is_none_only_as_far_as_a_background_makes_it(
    size: float, low: float, high: float
):
    """Alternating from configuration to configuration; the effect is the same in all, so that no
    set moves anything."""
    gap = size * (-1.0) ** np.arange(COUNT)
    posterior = linear_posterior(np.full((1, COUNT), 2.0), gap, [["gun.linear_0"]])
    assert posterior.within_probability > 0.98
    assert low <= posterior.none_probability <= high


def test_rough_shares_are_the_parts_of_the_squared_gap():
    # Two linear responses that are orthogonal have their own squares, alone and after the other.
    responses = np.linalg.qr(np.random.default_rng(0).standard_normal((COUNT, COUNT)))[0][:2] * [
        [9.0],
        [4.0],
    ]
    names = ("gun.linear_0", "gun.linear_1")
    posterior = linear_posterior(responses, responses.sum(axis=0), [names])
    shares = posterior.rough_shares(posterior.best)
    assert shares["gun.linear_0"] == pytest.approx((81 / 97, 81 / 97), abs=0.02)
    assert shares["gun.linear_1"] == pytest.approx((16 / 97, 16 / 97), abs=0.02)
    assert posterior.major(posterior.best) == names
    responses = np.linalg.qr(np.random.default_rng(0).standard_normal((COUNT, COUNT)))[0][:2] * [
        [20.0],
        [3.0],
    ]
    posterior = linear_posterior(
        responses, responses.sum(axis=0), [("gun.linear_0", "gun.linear_1")]
    )
    assert set(posterior.best.effects) == {"gun.linear_0", "gun.linear_1"}
    assert posterior.major(posterior.best) == ("gun.linear_0",)
    assert posterior.representative(["gun.linear_0"]) is posterior.best


def test_effects_that_do_the_same_are_one_credible_set():
    response = 3 * np.random.default_rng(0).standard_normal((2, COUNT))
    responses = np.array([response[0], response[0], response[1]])
    posterior = linear_posterior(responses, response[0], [[f"gun.linear_{i}"] for i in range(3)])
    weighted = [(frozenset(fit.effects), weight) for fit, weight in posterior.weighted]
    (own,) = credible_sets(weighted)
    assert set(own) == {"gun.linear_0", "gun.linear_1"}
    assert inclusion(weighted, own) > 0.9
    assert posterior.inclusion("gun.linear_0") == pytest.approx(0.5, abs=0.05)
    responses = 3 * np.random.default_rng(0).standard_normal((3, COUNT))
    posterior = linear_posterior(responses, responses[1], [[f"gun.linear_{i}"] for i in range(3)])
    weighted = [(frozenset(fit.effects), weight) for fit, weight in posterior.weighted]
    assert credible_sets(weighted) == [("gun.linear_1",)]


def test_more_unexplained_evidence_makes_unknown_likelier():
    """By as many nats as the evidence has more."""
    posterior = linear_posterior(np.ones((1, COUNT)), np.zeros(COUNT), [["gun.linear_0"]])
    odds = []
    for gain in (0.0, 3.0):
        own = HypothesisPosterior(
            posterior.gap,
            posterior.library,
            posterior.metric,
            posterior.weighted,
            {(): UnexplainedEvidence(gain, "gun", "over the order of runs")},
        )
        odds.append(own.log_odds_unknown)
    assert odds[1] - odds[0] == pytest.approx(3.0)


def test_parameters_of_levels_bear_their_names_and_their_own_intervals():
    record = gun_record([DEAD_VOLUME], seed=3)
    stage = GunObservables(record)
    posterior = HypothesisPosterior.of(
        GapTable.of(record, [stage]), [stage], [catalogue()["gun.sliding_friction"]]
    )
    law = next((law for law in posterior.problem.laws if law.levels), None)
    assert law is not None, "friction belongs to the bullet, of which the campaign has two"
    u = law.starts()[1]
    fit = replace(posterior.library.fits[()], laws=(law,), u=u, precision=np.eye(len(u)))
    names = [row.name for row in fitted_parameters(fit, law.id)]
    assert len(names) == len(law.coordinates) * 2
    assert {name.split(" (")[1] for name in names} == {"0.25)", "1.0)"}
    values = law.values(u)
    for row in fitted_parameters(fit, law.id):
        name, level = row.name.split(" (")
        first = law.levels.index(law.level_names.index(level.rstrip(")")))
        assert row.value == pytest.approx(values[name][first])
    (split,), (common,) = fitted_effects(fit), common_effects(fit)
    name = law.coordinates[0].parameter.name
    assert np.shape(getattr(split, name)) == (len(record.configurations),)
    np.testing.assert_allclose(
        getattr(common, name), getattr(split, name)
    )  # levels have nothing of their own at u
    # What levels have in common and what each has of its own lean against each other: only their
    # sum is known.
    sharp = 100.0 * law.placing.T @ law.placing + np.eye(
        law.size
    )  # a measurement of each level's place, sd 0.1
    fit = replace(posterior.library.fits[()], laws=(law,), u=u, precision=sharp)
    spread = np.sqrt(np.diag(law.placing @ np.linalg.inv(sharp) @ law.placing.T))
    assert np.all(spread < 0.1)
    coordinates = [coordinate for coordinate in law.coordinates for _ in law.level_names]
    rows = fitted_parameters(fit, law.id)
    for row, coordinate, place, width in zip(
        rows, coordinates, law.placing @ fit.u, spread, strict=True
    ):
        ends = coordinate.value(place + 1.6449 * width * np.array([-1.0, 1.0]))
        assert row.ci90 == pytest.approx(tuple(np.sort(ends)), rel=1e-4)
