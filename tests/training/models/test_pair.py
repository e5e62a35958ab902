"""The thesis's model in two steps, and spreads through functions."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.training.estimators.linear import LinearPowers
from pyroshock.training.models.base import positive_pulses, propagate_spread, residual_correlation
from pyroshock.training.models.pair import Pair
from support.records.pulse_tables import held_out, pulse_table


def test_raw_is_the_two_regressions() -> None:
    """Without scaling, force and time are what two regressions by hand say, spreads included."""
    train, held = held_out(
        pulse_table(np.random.default_rng(1), repetitions=4), np.random.default_rng(2)
    )
    groups, rng = train.configuration, np.random.default_rng(0)
    force = LinearPowers().fit(train.x, train.force_n, groups, rng).predict(held.x)
    time = LinearPowers().fit(train.x, train.contact_time_s[:, None], groups, rng).predict(held.x)
    assert force.spread is not None
    answer = Pair(LinearPowers(), LinearPowers()).fit(train, rng).predict(held.inputs)
    pushes = force.mean.mean(axis=1) > 10
    np.testing.assert_array_equal(answer.force_n[pushes], force.mean[pushes])
    np.testing.assert_array_equal(answer.force_spread_n, force.spread)
    later = time.mean[:, 0] > 1e-4
    np.testing.assert_array_equal(answer.contact_time_s[later], time.mean[later, 0])


@pytest.mark.parametrize(
    ("scaling", "least", "most"), [("none", 5.0, 50.0), ("momentum", 0.8, 1.25)]
)
def test_noise_of_soft_tips_over_hard(scaling: str, least: float, most: float) -> None:
    """Over the peak; the synthetic law's is the same for both, and their peaks are 15 apart."""
    train, held = held_out(pulse_table(np.random.default_rng(1)), np.random.default_rng(2))
    answer = (
        Pair(LinearPowers(), LinearPowers(), scaling)
        .fit(train, np.random.default_rng(0))
        .predict(held.inputs)
    )
    over = answer.force_spread_n.max(axis=1) / held.peak_force_n
    soft = held.tip_material == "polyurethane"
    hard = held.tip_material == "aluminum"
    assert least < np.median(over[soft]) / np.median(over[hard]) < most


def test_pulse_that_pulls_is_made_to_push() -> None:
    pulls = np.vstack([np.full(20, -5.0), np.full(20, 3.0)])
    pulses = positive_pulses(pulls, faintest=100.0)
    assert pulses[0].tolist() == [0.0, *[0.1] * 18, 0.0]
    np.testing.assert_array_equal(pulses[1], pulls[1])
    with pytest.raises(ValueError, match="no scaling 'log'; there are: none, momentum"):
        Pair(LinearPowers(), LinearPowers(), "log")


HALF = np.array([[1.0, 0.5], [0.5, 1.0]])


@pytest.mark.parametrize(
    ("sign", "expected"), [(1.0, 3 + 4 + 2 * 3**0.5), (-1.0, 3 + 4 - 2 * 3**0.5)]
)
def test_sum_and_difference(sign: float, expected: float) -> None:
    """Var(a + b) = Var a + Var b + 2 Cov(a, b)."""
    spread = propagate_spread(np.array([[[1.0, sign]]]), np.array([[3**0.5, 2.0]]), HALF)
    assert spread[0, 0] ** 2 == pytest.approx(expected)


def test_correlation_is_recovered() -> None:
    draws = np.random.default_rng(0).multivariate_normal([5.0, -1.0], HALF, 20_000)
    np.testing.assert_allclose(residual_correlation(draws * [1.0, 100.0]), HALF, atol=0.02)
    draws = np.random.default_rng(0).standard_normal((10, 2)) * [1.0, 0.0]
    np.testing.assert_array_equal(residual_correlation(draws), np.eye(2))
