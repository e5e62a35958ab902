"""Noise that lifts all outputs at once, told from repetitions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pyroshock.training.estimators.base import Estimator
from pyroshock.training.estimators.coregional import Coregional
from pyroshock.training.estimators.linear import LinearPowers
from pyroshock.training.estimators.rotated_outputs import RotatedOutputs, repetition_covariance
from pyroshock.training.models.serialization import build, describe
from support.checks.estimator_checks import CHECKS, check_settings_rebuild, fitted, known_law

NOISE = np.array([[1.0, 0.8, 0.0], [0.8, 1.0, 0.0], [0.0, 0.0, 0.25]])


def remade(estimator: Estimator) -> Estimator:
    made = build(describe(estimator))
    assert isinstance(made, Estimator)
    return made


def repeated(groups: int = 60, repetitions: int = 10) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """y depends on a column that is the same within a group, and on one that is not."""
    rng = np.random.default_rng(12)
    name = np.repeat(np.arange(groups), repetitions)
    x = np.column_stack([rng.standard_normal(groups)[name], rng.standard_normal(len(name))])
    y = np.sin(3 * x[:, :1]) + x[:, 1:] * [1.0, -2.0, 3.0] + rng.multivariate_normal(np.zeros(3), NOISE, len(name))
    return x, y, name


@pytest.mark.parametrize("check", [c for c in CHECKS if c is not check_settings_rebuild], ids=lambda c: c.__name__)
def test_promise(check: Callable[[Estimator], None], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("support.checks.estimator_checks.rebuilt", remade)  # its settings hold another estimator
    check(RotatedOutputs(LinearPowers()))


def test_repetitions_tell_the_noise() -> None:
    np.testing.assert_allclose(repetition_covariance(*repeated()), NOISE, atol=0.12)
    x, y, _ = repeated()
    assert repetition_covariance(x, y, np.arange(len(x))) is None
    turned = RotatedOutputs(LinearPowers()).fit(x, y, np.arange(len(x)), np.random.default_rng(0))
    np.testing.assert_allclose(turned.turn_, np.diag(1 / y.std(axis=0)))
    x, y, groups = repeated()
    spread = RotatedOutputs(LinearPowers(powers=12)).fit(x, y, groups, np.random.default_rng(0)).predict(x).spread
    assert spread is not None
    np.testing.assert_allclose(np.median(spread, axis=0), np.sqrt(NOISE.diagonal()), rtol=0.1)


def test_linear_regression_does_not_mind() -> None:
    """Least squares of turned outputs, turned back, are least squares."""
    asked = known_law()[1]
    turned, plain = fitted_of(RotatedOutputs(LinearPowers())), fitted(LinearPowers())
    np.testing.assert_allclose(turned.predict(asked.x).mean, plain.predict(asked.x).mean, rtol=1e-6, atol=1e-3)


def fitted_of(estimator: Estimator) -> Estimator:
    rows = known_law()[0]
    return estimator.fit(rows.x, rows.y, rows.groups, np.random.default_rng(0))


def test_process_does_not_follow_the_noise() -> None:
    """Truth y = sin 3x + line is known: turned, the coupled process comes closer to it."""
    x, y, groups = repeated()
    truth = np.sin(3 * x[:, :1]) + x[:, 1:] * [1.0, -2.0, 3.0]
    off = [
        np.sqrt(np.mean((estimator.fit(x, y, groups, np.random.default_rng(0)).predict(x).mean - truth) ** 2))
        for estimator in (RotatedOutputs(Coregional(rank=1, components=False)), Coregional(rank=1, components=False))
    ]
    assert off[0] < off[1]
    assert off[0] < 0.2
