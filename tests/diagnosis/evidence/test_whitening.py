"""Covariances by their factors."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.diagnosis.evidence.whitening import Whitening
from scipy.stats import multivariate_normal

RNG = np.random.default_rng(3)
ROOT, DIRECTIONS, Z = RNG.standard_normal((7, 7)), RNG.standard_normal((7, 3)), RNG.standard_normal(7)


def test_density_is_the_normal_one() -> None:
    white = Whitening.of(ROOT @ ROOT.T)
    expected = multivariate_normal(cov=white.lower @ white.lower.T).logpdf(Z)
    assert white.log_density(Z) == pytest.approx(expected)


@pytest.mark.parametrize("directions", [DIRECTIONS, DIRECTIONS[:, [0, 0, 1]], 0 * DIRECTIONS, DIRECTIONS[:, :0]])
def test_opened_is_the_covariance_with_more_in_it(directions: np.ndarray) -> None:
    white = Whitening.of(ROOT @ ROOT.T)
    opened = white.opened(directions)
    expected = multivariate_normal(cov=white.lower @ white.lower.T + directions @ directions.T).logpdf(Z)
    assert opened.log_density(Z) == pytest.approx(expected)
    np.testing.assert_allclose(opened.shortened(white.white(Z)), opened.white(Z))


def test_a_seventh_of_a_tolerance_is_added() -> None:
    lower = Whitening.of(np.diag([1.0, 4.0])).lower
    assert lower @ lower.T == pytest.approx(np.diag([1.02, 4.02]))


def test_a_direction_as_small_as_a_tenth_counts() -> None:
    covariance, direction = np.diag([0.98, 0.98]), np.array([[0.1], [0.0]])
    found = Whitening.of(covariance).opened(direction).log_density(np.array([0.7, -0.3]))
    assert found == pytest.approx(multivariate_normal(cov=np.diag([1.01, 1.0])).logpdf([0.7, -0.3]))
