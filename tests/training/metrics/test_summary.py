"""Means and their intervals over configurations."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.training.evaluation.metrics import METRICS, PulseErrors
from pyroshock.training.evaluation.summary import bootstrap_interval, clustered, summary


def errors_of(values: np.ndarray) -> PulseErrors:
    return PulseErrors(**dict.fromkeys(METRICS, values))


def test_mean_is_over_pulses() -> None:
    """Not over configurations, which may differ in size."""
    found = summary(errors_of(np.array([1.0, 1.0, 4.0])), np.array(["a", "a", "b"]), np.random.default_rng(0))
    assert list(found) == list(METRICS)
    assert found["cost"].mean == 2.0


def test_same_seed_same_interval() -> None:
    values, labels = np.random.default_rng(0).random(60), np.repeat(np.arange(30), 2)
    first, second = (summary(errors_of(values), labels, np.random.default_rng(5)) for _ in range(2))
    assert first == second


def test_repetitions_are_no_evidence() -> None:
    """Copies of every pulse change nothing, as each configuration is drawn whole."""
    values, labels = np.random.default_rng(0).random(30), np.arange(30)
    once = summary(errors_of(values), labels, np.random.default_rng(5))["cost"]
    often = summary(errors_of(np.tile(values, 8)), np.tile(labels, 8), np.random.default_rng(5))["cost"]
    assert np.allclose([once.mean, once.low, once.high], [often.mean, often.low, often.high])


def test_one_configuration_has_no_interval() -> None:
    found = summary(errors_of(np.array([1.0, 2.0])), np.array(["a", "a"]), np.random.default_rng(0))["cost"]
    assert found.mean == 1.5
    assert np.isnan([found.low, found.high]).all()


@pytest.mark.parametrize("clusters", [20, 60])
def test_interval_holds_the_truth_in_nine_of_ten(clusters: int) -> None:
    """Errors of a lognormal law, alike within a configuration: 600 campaigns, five standard errors either way."""
    rng = np.random.default_rng(clusters)
    labels = np.repeat(np.arange(clusters), 2)
    truth, hits = np.exp(0.3**2 / 2), 0
    for _ in range(600):
        values = np.exp(0.3 * np.repeat(rng.standard_normal(clusters), 2))
        low, high = bootstrap_interval(clustered(values[:, None], labels), rng, 500)
        hits += bool(low[0] <= truth <= high[0])
    assert 0.90 - 5 * 0.0122 < hits / 600 < 0.90 + 5 * 0.0122


def test_labels_of_another_length_are_refused() -> None:
    with pytest.raises(ValueError, match="2 labels"):
        summary(errors_of(np.ones(3)), np.array(["a", "b"]), np.random.default_rng(0))
