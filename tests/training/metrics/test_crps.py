"""The score of a predicted distribution against its definition and the normal law's closed form."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.training.evaluation.summary import ensemble_crps
from scipy.stats import norm


def gaussian_crps(mean: float, deviation: float, measured: np.ndarray) -> np.ndarray:
    """Gneiting and Raftery 2007, section 4.2."""
    z = (measured - mean) / deviation
    return deviation * (z * (2 * norm.cdf(z) - 1) + 2 * norm.pdf(z) - 1 / np.sqrt(np.pi))


def test_many_draws_give_closed_form() -> None:
    measured = np.array([-1.0, 0.5, 2.0, 4.0])
    draws = np.random.default_rng(1).normal(0.5, 1.5, (200_000, 4))
    assert ensemble_crps(draws, measured) == pytest.approx(gaussian_crps(0.5, 1.5, measured), rel=0.01)


def test_few_draws_are_scored_without_bias() -> None:
    draws = np.random.default_rng(2).normal(0.0, 1.0, (8, 100_000))
    mean = ensemble_crps(draws, np.full(100_000, 0.7)).mean()
    assert mean == pytest.approx(float(gaussian_crps(0.0, 1.0, np.array(0.7))), abs=0.005)


def test_pairs_are_those_of_definition() -> None:
    draws = np.random.default_rng(3).exponential(size=(7, 3))
    measured = np.array([0.1, 1.0, 3.0])
    pairs = np.abs(draws[:, None] - draws[None, :]).sum(axis=(0, 1)) / (7 * 6)
    assert ensemble_crps(draws, measured) == pytest.approx(np.abs(draws - measured).mean(axis=0) - pairs / 2)


def test_single_draw_is_absolute_error() -> None:
    assert ensemble_crps(np.array([[1.0, 2.0]]), np.array([3.0, 1.5])).tolist() == [2.0, 0.5]


def test_other_shapes_are_refused() -> None:
    with pytest.raises(ValueError, match=r"expected \(d, n\) and \(n,\)"):
        ensemble_crps(np.zeros((4, 3)), np.zeros(2))
