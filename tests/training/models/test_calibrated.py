"""The 90 % band holds 90 %, on configurations never seen, wherever the noise is."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from pyroshock.dataset.table import PulseTable
from pyroshock.training.estimators.linear import LinearPowers
from pyroshock.training.estimators.trees import DecisionTree
from pyroshock.training.models.base import ContactModel, ContactPrediction
from pyroshock.training.models.calibrated import Calibrated, Difficulty, most_likely
from pyroshock.training.models.pair import Pair
from pyroshock.training.models.single_pass import SinglePass
from pyroshock.training.tuning.folds import grouped_folds
from support.records.pulse_tables import pulse_table

CALIBRATED = {
    "own spread": Calibrated(SinglePass(LinearPowers())),
    "no spread": Calibrated(Pair(DecisionTree(), DecisionTree(), "momentum")),
}


@cache
def campaign() -> PulseTable:
    """Three times as much noise where the tip is aluminium."""
    rng = np.random.default_rng(31)
    table = pulse_table(rng, positions=3)
    more = np.where(table.tip_material == "aluminum", 0.06, 0.0)[:, None] * rng.standard_normal(
        (len(table), 2)
    )
    time = table.contact_time_s * np.exp(more[:, 0])
    return replace(table, force_n=table.force_n * np.exp(more[:, [1]]), contact_time_s=time)


def inside(
    answer: ContactPrediction, pulses: PulseTable
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which points (n x 20) and contact times (n,) lie in the band."""
    return (
        np.abs(pulses.force_n - answer.force_n) <= 1.645 * answer.force_spread_n,
        np.abs(pulses.contact_time_s - answer.contact_time_s)
        <= 1.645 * answer.contact_time_spread_s,
    )


@cache
def on_unseen(model: ContactModel) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Every configuration left out once, in four parts: which points and contact times of all
    pulses are inside."""
    table = campaign()
    force, time = np.empty((len(table), 20), dtype=bool), np.empty(len(table), dtype=bool)
    for unseen in grouped_folds(table.configuration, 4, np.random.default_rng(1)):
        fitted = model.fit(table.take(~unseen), np.random.default_rng(2))
        held = table.take(unseen)
        force[unseen], time[unseen] = inside(fitted.predict(held.inputs), held)
    return force, time


@pytest.mark.parametrize("name", CALIBRATED)
def test_band_holds_nine_tenths(name: str) -> None:
    force, time = on_unseen(CALIBRATED[name])
    assert 0.87 < force.mean() < 0.93
    assert 0.87 < time.mean() < 0.93


@pytest.mark.parametrize("tip", ["aluminum", "delrin", "polyurethane"])
def test_band_knows_where_the_noise_is(tip: str) -> None:
    force, time = on_unseen(CALIBRATED["own spread"])
    rows = campaign().tip_material == tip
    assert 0.86 < force[rows].mean() < 0.94
    assert 0.86 < time[rows].mean() < 0.94


def test_uncalibrated_does_not() -> None:
    # What the calibration is for: one noise level for all is too wide for two tips of three.
    force, _ = on_unseen(CALIBRATED["own spread"].model)
    assert force[campaign().tip_material == "delrin"].mean() > 0.97
    model = CALIBRATED["own spread"].fit(campaign(), np.random.default_rng(0))
    np.testing.assert_array_equal(
        model.predict(campaign().inputs).force_n, model.model_.predict(campaign().inputs).force_n
    )


def test_wrong_spread_is_put_right() -> None:
    """A model that says a tenth of its spread is calibrated to the same band."""

    class Boastful(SinglePass):
        def predict(self, inputs):
            answer = super().predict(inputs)
            return replace(
                answer,
                force_spread_n=answer.force_spread_n / 10,
                contact_time_spread_s=answer.contact_time_spread_s / 10,
            )

    small = campaign().take(campaign().repetition <= 4)
    honest, boastful = (
        Calibrated(kind(LinearPowers())).fit(small, np.random.default_rng(0))
        for kind in (SinglePass, Boastful)
    )
    a, b = (model.predict(small.inputs).force_spread_n for model in (honest, boastful))
    np.testing.assert_allclose(a, b, rtol=1e-9)


def test_difficulty_is_the_noise() -> None:
    # Twice as hard where x is 1: found, and far outside that of the nearest.
    rng = np.random.default_rng(8)
    x = np.repeat([[0.0], [1.0]], 300, axis=0)
    squares = (rng.standard_normal(600) * np.where(x[:, 0] == 1, 2.0, 1.0)) ** 2
    found = most_likely(x, squares, grouped_folds(np.arange(600), 5, rng))
    np.testing.assert_allclose(
        found.at(np.array([[0.0], [1.0], [50.0]])), [1.0, 2.0, 2.0], rtol=0.1
    )
    rng = np.random.default_rng(9)
    x, squares = rng.standard_normal((300, 6)), rng.standard_normal(300) ** 2
    found = most_likely(x, squares, grouped_folds(np.arange(300), 5, rng))
    assert found.at(x).std() < 0.1
    squares = np.array([1.0, 4.0, 9.0])
    factors = Difficulty(np.eye(3), squares, np.inf).at(np.eye(3))
    np.testing.assert_allclose(factors, np.sqrt(squares.mean()))
