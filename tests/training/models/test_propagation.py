"""Spreads through functions, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.training.models.base import propagate_spread, residual_correlation

HALF = np.array([[1.0, 0.5], [0.5, 1.0]])


@pytest.mark.parametrize(("sign", "expected"), [(1.0, 3 + 4 + 2 * 3**0.5), (-1.0, 3 + 4 - 2 * 3**0.5)])
def test_sum_and_difference(sign: float, expected: float) -> None:
    """Var(a + b) = Var a + Var b + 2 Cov(a, b)."""
    spread = propagate_spread(np.array([[[1.0, sign]]]), np.array([[3**0.5, 2.0]]), HALF)
    assert spread[0, 0] ** 2 == pytest.approx(expected)


def test_correlation_is_recovered() -> None:
    draws = np.random.default_rng(0).multivariate_normal([5.0, -1.0], HALF, 20_000)
    np.testing.assert_allclose(residual_correlation(draws * [1.0, 100.0]), HALF, atol=0.02)


def test_output_that_never_deviates_goes_with_none() -> None:
    draws = np.random.default_rng(0).standard_normal((10, 2)) * [1.0, 0.0]
    np.testing.assert_array_equal(residual_correlation(draws), np.eye(2))
