"""Linear powers and partial least squares against closed forms and scikit-learn."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.training.estimators.linear import LinearPowers, PartialLeastSquares
from sklearn.cross_decomposition import PLSRegression
from support.checks.estimator_checks import fitted, known_law

GROUPS = np.arange(400) // 4


def cubic(rng: np.random.Generator, noise: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    x = rng.standard_normal((400, 3)) * [1.0, 1e9, 1e-3] + [0.0, 5e9, 2e-3]
    u = (x - [0.0, 5e9, 2e-3]) / [1.0, 1e9, 1e-3]
    y = np.stack([1 + u[:, 0] - 2 * u[:, 1] ** 2 + u[:, 2] ** 3, 3 * u[:, 0] ** 3], axis=1)
    return x, y + noise * rng.standard_normal(y.shape)


def test_powers_hold_a_cubic_law() -> None:
    x, y = cubic(np.random.default_rng(0))
    answer = LinearPowers().fit(x, y, GROUPS, np.random.default_rng(0)).predict(x)
    np.testing.assert_allclose(answer.mean, y, atol=1e-8)


def test_fewer_powers_do_not() -> None:
    x, y = cubic(np.random.default_rng(0))
    answer = LinearPowers(powers=2).fit(x, y, GROUPS, np.random.default_rng(0)).predict(x)
    assert np.abs(answer.mean - y).max() > 1


def test_repeated_predictors_change_nothing() -> None:
    """Collinear columns, as a material's properties are: the shortest coefficients give the same law."""
    x, y = cubic(np.random.default_rng(0), noise=0.1)
    twice = np.concatenate([x, 7 * x[:, :1], np.full((400, 1), 3.0)], axis=1)
    once = LinearPowers().fit(x, y, GROUPS, np.random.default_rng(0)).predict(x)
    again = LinearPowers().fit(twice, y, GROUPS, np.random.default_rng(0)).predict(twice)
    assert once.spread is not None
    assert again.spread is not None
    np.testing.assert_allclose(again.mean, once.mean, atol=1e-8)
    np.testing.assert_allclose(again.spread, once.spread, rtol=1e-8)


def test_spread_covers_new_measurements() -> None:
    """Of 800 new values of its own law, 90 in a hundred inside 1.645 spreads; the noise is found."""
    x, y = cubic(np.random.default_rng(0), noise=0.5)
    new_x, new_y = cubic(np.random.default_rng(1), noise=0.5)
    answer = LinearPowers().fit(x, y, GROUPS, np.random.default_rng(0)).predict(new_x)
    assert answer.spread is not None
    assert np.mean(np.abs(new_y - answer.mean) < 1.645 * answer.spread) == pytest.approx(0.9, abs=0.03)
    assert np.median(answer.spread) == pytest.approx(0.5, rel=0.1)


def test_spread_grows_away_from_data() -> None:
    x, y = cubic(np.random.default_rng(0), noise=0.5)
    far = np.array([[10.0, 5e9, 2e-3]])
    spread = LinearPowers().fit(x, y, GROUPS, np.random.default_rng(0)).predict(far).spread
    assert spread is not None
    assert np.all(spread > 3)


def test_leverage_of_other_terms_is_refused() -> None:
    arrays = fitted(LinearPowers()).arrays()
    with pytest.raises(ValueError, match="'leverage_root' and 'variance' are not of"):
        LinearPowers().restore({**arrays, "leverage_root": arrays["leverage_root"][1:]})


def test_components_are_scikit_learns() -> None:
    learned, asked = known_law()
    kept = np.ptp(learned.x, axis=0) > 0
    for components in (1, 3, 6):
        peer = PLSRegression(components).fit(learned.x[:, kept], learned.y).predict(asked.x[:, kept])
        ours = fitted(PartialLeastSquares(components)).predict(asked.x).mean
        np.testing.assert_allclose(ours, peer, rtol=1e-6, atol=1e-6)


def test_all_components_are_least_squares() -> None:
    x, y = cubic(np.random.default_rng(0), noise=0.1)
    ours = PartialLeastSquares(3).fit(x, y, GROUPS, np.random.default_rng(0)).predict(x).mean
    plain = LinearPowers(powers=1).fit(x, y, GROUPS, np.random.default_rng(0)).predict(x).mean
    np.testing.assert_allclose(ours, plain, atol=1e-8)


def test_more_components_than_directions_are_as_many() -> None:
    learned, asked = known_law()
    many, all_ = (fitted(PartialLeastSquares(number)) for number in (13, np.linalg.matrix_rank(learned.x).item()))
    assert np.all(np.isfinite(many.predict(asked.x).mean))
    assert many.fit_report().settings["components"] == np.linalg.matrix_rank(standardised(learned.x))
    np.testing.assert_array_equal(many.predict(asked.x).mean, all_.predict(asked.x).mean)


def standardised(x: np.ndarray) -> np.ndarray:
    width = x.std(axis=0)
    return (x - x.mean(axis=0)) / np.where(np.ptp(x, axis=0) > 0, width, np.inf)


def test_components_are_chosen_from_left_out_configurations() -> None:
    """No number of them does much better on new rows than the one that was chosen, and some do worse."""
    rng = np.random.default_rng(0)
    law = rng.standard_normal((6, 2)) * np.array([5.0, 3, 1, 0, 0, 0])[:, None]
    x, new_x = rng.standard_normal((2, 400, 6)) @ rng.standard_normal((6, 6))
    y, new_y = (rows @ law + 0.5 * rng.standard_normal((400, 2)) for rows in (x, new_x))

    def error(components: int | None) -> float:
        one = PartialLeastSquares(components).fit(x, y, GROUPS, np.random.default_rng(0))
        return float(np.mean((one.predict(new_x).mean - new_y) ** 2))

    fixed = [error(components) for components in range(1, 7)]
    assert error(None) < 1.02 * min(fixed)
    assert max(fixed) > 1.5 * min(fixed)
