"""Means, intervals, p-values, scores of distributions, and how much of an error disappears."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.training.evaluation.metrics import METRICS, PulseErrors
from pyroshock.training.evaluation.summary import (
    Clusters,
    bootstrap_interval,
    clustered,
    ensemble_crps,
    fraction,
    fraction_interval,
    holm,
    positive_interval,
    share_interval,
    sign_flip_p,
    summary,
)
from scipy.stats import norm, permutation_test


def errors_of(values: np.ndarray) -> PulseErrors:
    return PulseErrors(**dict.fromkeys(METRICS, values))


def test_mean_is_over_pulses() -> None:
    # Not over configurations, which may differ in size.
    found = summary(
        errors_of(np.array([1.0, 1.0, 4.0])), np.array(["a", "a", "b"]), np.random.default_rng(0)
    )
    assert list(found) == list(METRICS)
    assert found["cost"].mean == 2.0
    cost = summary(errors_of(np.array([1.0, 2.0])), np.array(["a", "a"]), np.random.default_rng(0))[
        "cost"
    ]
    assert cost.mean == 1.5
    assert np.isnan([cost.low, cost.high]).all()
    with pytest.raises(ValueError, match="2 labels"):
        summary(errors_of(np.ones(3)), np.array(["a", "b"]), np.random.default_rng(0))


def test_repetitions_are_no_evidence() -> None:
    values, labels = np.random.default_rng(0).random(60), np.repeat(np.arange(30), 2)
    first, second = (summary(errors_of(values), labels, np.random.default_rng(5)) for _ in range(2))
    assert first == second
    # Copies of every pulse change nothing, as each configuration is drawn whole.
    values, labels = np.random.default_rng(0).random(30), np.arange(30)
    once = summary(errors_of(values), labels, np.random.default_rng(5))["cost"]
    often = summary(errors_of(np.tile(values, 8)), np.tile(labels, 8), np.random.default_rng(5))[
        "cost"
    ]
    assert np.allclose([once.mean, once.low, once.high], [often.mean, often.low, often.high])


@pytest.mark.parametrize("clusters", [20, 60])
def test_interval_holds_the_truth_in_nine_of_ten(clusters: int) -> None:
    """Errors of a lognormal law, alike within a configuration: 600 campaigns, five standard errors
    either way."""
    rng = np.random.default_rng(clusters)
    labels = np.repeat(np.arange(clusters), 2)
    truth, hits = np.exp(0.3**2 / 2), 0
    for _ in range(600):
        values = np.exp(0.3 * np.repeat(rng.standard_normal(clusters), 2))
        low, high = bootstrap_interval(clustered(values[:, None], labels), rng, 500)
        hits += bool(low[0] <= truth <= high[0])
    assert 0.90 - 5 * 0.0122 < hits / 600 < 0.90 + 5 * 0.0122


@pytest.mark.parametrize("clusters", [3, 5, 8, 12, 30])
def test_interval_of_skewed_errors_is_above_zero_and_holds_the_truth_more_often(
    clusters: int,
) -> None:
    """Errors of a lognormal law with a deviation of 1, where the plain interval reaches below zero
    and is too short."""
    rng = np.random.default_rng(clusters)
    truth, hits, plain_hits, lowest = np.exp(0.5), 0, 0, np.inf
    for _ in range(400):
        of_clusters = clustered(rng.lognormal(0, 1, (clusters, 1)), np.arange(clusters))
        low, high = positive_interval(of_clusters, rng, 500)
        plain_low, plain_high = bootstrap_interval(of_clusters, rng, 500)
        hits += bool(low[0] <= truth <= high[0])
        plain_hits += bool(plain_low[0] <= truth <= plain_high[0])
        lowest = min(lowest, low[0])
    assert lowest > 0
    assert hits >= plain_hits


@pytest.mark.parametrize("share", [0.7, 0.9, 0.97])
@pytest.mark.parametrize("clusters", [3, 5, 8, 12, 30])
def test_interval_of_a_share_is_within_0_and_1_and_holds_the_truth_in_nine_of_ten(
    clusters: int, share: float
) -> None:
    """Configurations of four pulses that differ in their share: 600 campaigns, five standard errors
    below 90 %."""
    rng = np.random.default_rng(clusters)
    hits = plain_hits = 0
    for _ in range(600):
        chances = rng.beta(20 * share, 20 * (1 - share), clusters)
        of_clusters = Clusters(
            rng.binomial(4, chances)[:, None].astype(float), np.full(clusters, 4.0)
        )
        low, high = share_interval(of_clusters)
        assert 0 <= low[0] <= of_clusters.mean[0] <= high[0] <= 1
        plain_low, plain_high = bootstrap_interval(of_clusters, rng, 200)
        hits += bool(low[0] <= share <= high[0])
        plain_hits += bool(plain_low[0] <= share <= plain_high[0])
    assert hits / 600 > 0.90 - 5 * 0.0122
    assert hits > plain_hits or clusters == 30


def test_a_coverage_of_every_pulse_has_an_interval_and_errors_of_zero_have_zero() -> None:
    cost = summary(errors_of(np.zeros(8)), np.arange(8), np.random.default_rng(0))["cost"]
    assert (cost.low, cost.high) == (0.0, 0.0)
    errors = PulseErrors(**dict.fromkeys(METRICS, np.ones(8)), force_covered=np.ones(8))
    covered = summary(errors, np.arange(8), np.random.default_rng(0))["force_covered"]
    assert covered.mean == covered.high == 1.0
    assert 0.6 < covered.low < 0.8  # t(7) = 1.89: 1 / (1 + 1.89² / 8)


def gaussian_crps(mean: float, deviation: float, measured: np.ndarray) -> np.ndarray:
    """Gneiting and Raftery 2007, section 4.2."""
    z = (measured - mean) / deviation
    return deviation * (z * (2 * norm.cdf(z) - 1) + 2 * norm.pdf(z) - 1 / np.sqrt(np.pi))


def test_draws_give_closed_form_without_bias() -> None:
    measured = np.array([-1.0, 0.5, 2.0, 4.0])
    draws = np.random.default_rng(1).normal(0.5, 1.5, (200_000, 4))
    assert ensemble_crps(draws, measured) == pytest.approx(
        gaussian_crps(0.5, 1.5, measured), rel=0.01
    )
    draws = np.random.default_rng(2).normal(0.0, 1.0, (8, 100_000))
    mean = ensemble_crps(draws, np.full(100_000, 0.7)).mean()
    assert mean == pytest.approx(float(gaussian_crps(0.0, 1.0, np.array(0.7))), abs=0.005)


def test_pairs_are_those_of_definition() -> None:
    draws = np.random.default_rng(3).exponential(size=(7, 3))
    measured = np.array([0.1, 1.0, 3.0])
    pairs = np.abs(draws[:, None] - draws[None, :]).sum(axis=(0, 1)) / (7 * 6)
    assert ensemble_crps(draws, measured) == pytest.approx(
        np.abs(draws - measured).mean(axis=0) - pairs / 2
    )
    assert ensemble_crps(np.array([[1.0, 2.0]]), np.array([3.0, 1.5])).tolist() == [2.0, 0.5]
    with pytest.raises(ValueError, match=r"expected \(d, n\) and \(n,\)"):
        ensemble_crps(np.zeros((4, 3)), np.zeros(2))


def test_interval_widens_with_what_is_unsure() -> None:
    # The numbers of the report's example: (0.041 - 0.011) / (0.041 - 0.009).
    printed = [np.array(error**2) for error in (0.041, 0.011, 0.009)]
    assert float(fraction(*printed)) == pytest.approx(0.9375)
    rng = np.random.default_rng(0)
    squares = 9 + rng.random(12), 1 + rng.random(12), np.ones(12)
    plain = fraction_interval(*squares, np.random.default_rng(1))
    wider = fraction_interval(*squares, np.random.default_rng(1), training_error=0.1)
    assert wider[0] < plain[0] < plain[1] < wider[1] <= 1.0
    assert fraction_interval(np.ones(2), np.zeros(2), np.zeros(2), np.random.default_rng(0)) is None


def of(sums: list[float]) -> Clusters:
    return clustered(np.array(sums)[:, None], np.arange(len(sums)))


def test_sign_flips_by_hand_and_as_scipys() -> None:
    # Of 16 combinations of signs, two reach a sum as great.
    assert sign_flip_p(of([1.0, 2.0, 3.0, 4.0]), np.random.default_rng(0))[0] == 2 / 16
    assert sign_flip_p(of([0.0] * 30), np.random.default_rng(0))[0] == 1.0
    sums = np.random.default_rng(3).normal(0.3, 1.0, 40)
    ours = sign_flip_p(of(list(sums)), np.random.default_rng(0), 20000)[0]
    peer = permutation_test((sums,), np.sum, permutation_type="samples", n_resamples=20000, rng=1)
    assert abs(ours - peer.pvalue) < 5 * np.sqrt(2 * ours * (1 - ours) / 20000)


def test_holm_by_hand() -> None:
    assert np.allclose(holm(np.array([0.04, 0.01, 0.03, 0.5])), [0.09, 0.04, 0.09, 0.5])
    assert np.array_equal(holm(np.array([0.6, 0.9])), [1.0, 1.0])
