"""What every learned contact model promises, over the list of them."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from pyroshock.dataset.table import Inputs, PulseTable
from pyroshock.training.estimators.base import NotFittedError
from pyroshock.training.estimators.contact_time import THESIS, ContactTimeProcess
from pyroshock.training.estimators.coregional import Coregional
from pyroshock.training.estimators.linear import LinearPowers
from pyroshock.training.estimators.rotated_outputs import RotatedOutputs
from pyroshock.training.estimators.single_outputs import SingleOutputs
from pyroshock.training.estimators.trees import DecisionTree
from pyroshock.training.models.analytic import Analytic
from pyroshock.training.models.base import ContactModel, impulse
from pyroshock.training.models.calibrated import Calibrated
from pyroshock.training.models.hybrid import Hybrid
from pyroshock.training.models.pair import Pair
from pyroshock.training.models.serialization import build, describe
from pyroshock.training.models.single_pass import SinglePass
from support.checks.estimator_checks import through_a_file
from support.records.pulse_tables import held_out, inputs_at, pulse_table

#: Some bend linearly, and so far outside that only a model's own rules hold a pulse together.
MODELS: dict[str, ContactModel] = {
    "pair, raw": Pair(Coregional(rank=2, iterations=20), ContactTimeProcess(choice=THESIS)),
    "pair, linear": Pair(LinearPowers(), LinearPowers()),
    "pair, momentum": Pair(
        LinearPowers(), ContactTimeProcess(choice={**THESIS, "log_time": True}), "momentum"
    ),
    "single pass, mixture": SinglePass(
        RotatedOutputs(SingleOutputs(iterations=20, tuning_rows=120))
    ),
    "hybrid, mixture": Hybrid(
        process=RotatedOutputs(SingleOutputs(iterations=20, tuning_rows=120))
    ),
    "single pass": SinglePass(RotatedOutputs(Coregional(rank=2, components=False))),
    "single pass, linear": SinglePass(LinearPowers()),
    "hybrid": Hybrid(Analytic("hann"), RotatedOutputs(Coregional(rank=2, components=False))),
    "hybrid, linear": Hybrid(Analytic("hertz"), LinearPowers()),
    "calibrated tree": Calibrated(Pair(DecisionTree(), DecisionTree())),
    "calibrated hybrid": Calibrated(Hybrid(Analytic("hertz"), LinearPowers())),
    "calibrated law": Calibrated(Analytic("hunt-crossley")),
}
NAMES = list(MODELS)
LEARN = [name for name in NAMES if name != "calibrated law"]

#: Those that can follow the synthetic law; its noise makes 0.02 for force (of range) and 0.016 for
#: time.
ACCURATE = ("pair, momentum", "single pass", "hybrid")


@cache
def campaign() -> tuple[PulseTable, PulseTable]:
    return held_out(
        pulse_table(np.random.default_rng(21), repetitions=5), np.random.default_rng(22), 1
    )


def rebuilt(model: ContactModel) -> ContactModel:
    made = build(json.loads(json.dumps(describe(model))))
    assert isinstance(made, ContactModel)
    return made


@cache
def fitted(name: str) -> ContactModel:
    return rebuilt(MODELS[name]).fit(campaign()[0], np.random.default_rng(5))


def assert_same(one: ContactModel, other: ContactModel) -> None:
    a, b = (model.predict(campaign()[1].inputs) for model in (one, other))
    for name in ("force_n", "contact_time_s", "force_spread_n", "contact_time_spread_s"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


def far_outside(rows: int = 200) -> Inputs:
    """Impacts whose every predictor is up to ten times less or more than learned; Poisson ratios
    physical."""
    rng = np.random.default_rng(3)
    table = campaign()[0].take(np.arange(rows))
    x = table.x * 10 ** rng.uniform(-1, 1, table.x.shape)
    for column, predictor in enumerate(table.predictors):
        if predictor.name.endswith("poisson_ratio"):
            x[:, column] = rng.uniform(0, 0.5, rows)
    return Inputs(table.predictors, x, table.impactor_mass_kg, table.plate_thickness_m)


@pytest.mark.parametrize("name", ACCURATE)
def test_learns_the_law(name: str) -> None:
    held = campaign()[1]
    answer = fitted(name).predict(held.inputs)
    off = np.sqrt(np.mean((answer.force_n - held.force_n) ** 2, axis=1)) / np.ptp(
        held.force_n, axis=1
    )
    assert off.mean() < 0.026
    assert np.mean(np.abs(answer.contact_time_s / held.contact_time_s - 1)) < 0.021


@pytest.mark.parametrize("name", NAMES)
def test_shapes_and_spreads_also_far_outside(name: str) -> None:
    answer = fitted(name).predict(campaign()[1].inputs)
    n = len(campaign()[1])
    assert answer.force_n.shape == (n, 20)
    assert answer.contact_time_s.shape == (n,)
    assert answer.force_spread_n.shape == (n, 20)
    assert answer.contact_time_spread_s.shape == (n,)
    assert np.all(answer.force_spread_n[:, 1:-1] > 0)
    assert np.all(answer.force_spread_n >= 0)  # the synthetic pulses end without noise
    assert np.all(answer.contact_time_spread_s > 0)
    answer = fitted(name).predict(far_outside())
    assert np.all(np.isfinite(answer.force_n))
    assert np.all(answer.contact_time_s > 0)
    assert np.all(impulse(answer.force_n, answer.contact_time_s) > 0)


@pytest.mark.parametrize("name", NAMES)
def test_round_trip_and_same_seed_same_model(name: str) -> None:
    one = fitted(name)
    assert_same(one, rebuilt(one).restore(through_a_file(one.arrays())))
    assert_same(fitted(name), rebuilt(MODELS[name]).fit(campaign()[0], np.random.default_rng(5)))


@pytest.mark.parametrize("name", LEARN)
def test_refit_learns_from_other_rows_and_no_pulse_that_pulls(name: str) -> None:
    one, (train, held) = fitted(name), campaign()
    before = one.predict(held.inputs).force_n
    other = one.refit(train.take(train.repetition > 2), np.random.default_rng(6))
    assert other.settings() == one.settings()
    np.testing.assert_array_equal(one.predict(held.inputs).force_n, before)
    ratio = other.predict(held.inputs).force_n.max(axis=1) / before.max(axis=1)
    assert not np.array_equal(ratio, np.ones(len(held)))
    assert 0.5 < np.median(ratio) < 2
    force = train.force_n.copy()
    force[3] *= -1
    with pytest.raises(ValueError, match=f"pulse {train.key[3]} has a mean force of -"):
        rebuilt(MODELS[name]).fit(replace(train, force_n=force), np.random.default_rng(0))


@pytest.mark.parametrize("name", NAMES)
def test_unfitted_or_with_other_arrays_says_so(name: str) -> None:
    for ask in (
        lambda: rebuilt(MODELS[name]).predict(campaign()[1].inputs),
        rebuilt(MODELS[name]).arrays,
    ):
        with pytest.raises(NotFittedError):
            ask()
    with pytest.raises(NotFittedError):
        MODELS[name].predict(campaign()[1].inputs)
    with pytest.raises(ValueError, match="restored from"):
        rebuilt(MODELS[name]).restore({})
    held = campaign()[1]
    fewer = Inputs(
        held.predictors[:-1], held.x[:, :-1], held.impactor_mass_kg, held.plate_thickness_m
    )
    with pytest.raises(ValueError, match="other predictors; different: boundary_conditions"):
        fitted(name).predict(fewer)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_names_the_predictor_that_is_no_number(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=r"'plate_density' is (nan|inf) in row 0"):
        fitted(name).predict(inputs_at(campaign()[1], plate_density=value))


@pytest.mark.parametrize("name", ["pair, momentum", "single pass", "hybrid"])
def test_asks_for_the_mass(name: str) -> None:
    held = campaign()[1]
    unknown = Inputs(held.predictors, held.x, np.full(len(held), np.nan), held.plate_thickness_m)
    with pytest.raises(ValueError, match="mass"):
        fitted(name).predict(unknown)


@pytest.mark.parametrize("name", ["pair, momentum", "single pass"])
def test_impact_needs_a_velocity(name: str) -> None:
    with pytest.raises(ValueError, match=r"'impact_velocity' is 0\.0 m/s in row 0"):
        fitted(name).predict(inputs_at(campaign()[1], impact_velocity=0.0))
