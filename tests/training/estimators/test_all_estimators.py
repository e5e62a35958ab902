"""What every regression promises, whatever it learns with, and noise that lifts all outputs at
once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pyroshock.training.estimators.base import Estimator
from pyroshock.training.estimators.coregional import Coregional
from pyroshock.training.estimators.genetic_network import GeneticNetwork
from pyroshock.training.estimators.linear import KernelRidge, LinearPowers, PartialLeastSquares
from pyroshock.training.estimators.network import Network
from pyroshock.training.estimators.rotated_outputs import RotatedOutputs, repetition_covariance
from pyroshock.training.estimators.support_vectors import SupportVectorKernel, SupportVectors
from pyroshock.training.estimators.trees import DecisionTree, TreeEnsemble
from pyroshock.training.models.serialization import build, describe
from support.checks.estimator_checks import (
    CHECKS,
    check_learns_known_law,
    check_settings_rebuild,
    check_units_do_not_matter,
    fitted,
    known_law,
)

#: With the NRMSE that each must reach on the known law. Neither powers nor components know that
#: tips multiply speeds.
ESTIMATORS: list[tuple[Estimator, float]] = [
    (DecisionTree(min_leaf=3), 0.06),
    (TreeEnsemble(trees=10, min_leaf=2), 0.05),
    (LinearPowers(), 1.0),
    (PartialLeastSquares(), 1.0),
    (KernelRidge(), 0.03),
    (KernelRidge(gamma=0.01, alpha=0.001), 0.03),
    (SupportVectors(gamma=0.02, cost=100.0, epsilon=0.02), 0.05),
    (SupportVectorKernel(features=128, gamma=0.03, cost=10.0, epsilon=0.02), 0.15),
    (Network(layers=(25,), iterations=200), 0.04),
    (Network(layers=(8, 8), penalty=1e-4, iterations=200), 0.06),
    (GeneticNetwork(population=3, generations=1, folds=2, iterations=20), 0.25),
]
MEMBERS = pytest.mark.parametrize(
    "estimator", [one for one, _ in ESTIMATORS], ids=lambda one: one.kind
)


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
@MEMBERS
def test_promise(estimator: Estimator, check: Callable[[Estimator], None]) -> None:
    check(estimator)


@pytest.mark.parametrize(
    ("estimator", "worst"), ESTIMATORS, ids=lambda value: getattr(value, "kind", None)
)
def test_learns_known_law(estimator: Estimator, worst: float) -> None:
    check_learns_known_law(estimator, worst)


@pytest.mark.parametrize(
    "estimator", [LinearPowers(), PartialLeastSquares(), KernelRidge()], ids=lambda one: one.kind
)
def test_units_do_not_matter(estimator: Estimator) -> None:
    check_units_do_not_matter(estimator)


COVARIANCE = np.array([[1.0, 0.8, 0.0], [0.8, 1.0, 0.0], [0.0, 0.0, 0.25]])


def remade(estimator: Estimator) -> Estimator:
    made = build(describe(estimator))
    assert isinstance(made, Estimator)
    return made


def repeated(
    groups: int = 60, repetitions: int = 10
) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """y depends on a column that is the same within a group, and on one that is not."""
    rng = np.random.default_rng(12)
    name = np.repeat(np.arange(groups), repetitions)
    x = np.column_stack([rng.standard_normal(groups)[name], rng.standard_normal(len(name))])
    y = (
        np.sin(3 * x[:, :1])
        + x[:, 1:] * [1.0, -2.0, 3.0]
        + rng.multivariate_normal(np.zeros(3), COVARIANCE, len(name))
    )
    return x, y, name


@pytest.mark.parametrize(
    "check", [c for c in CHECKS if c is not check_settings_rebuild], ids=lambda c: c.__name__
)
def test_promise_of_rotated_outputs(
    check: Callable[[Estimator], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "support.checks.estimator_checks.rebuilt", remade
    )  # its settings hold another estimator
    check(RotatedOutputs(LinearPowers()))


def test_repetitions_tell_the_noise() -> None:
    np.testing.assert_allclose(repetition_covariance(*repeated()), COVARIANCE, atol=0.12)
    x, y, _ = repeated()
    assert repetition_covariance(x, y, np.arange(len(x))) is None
    turned = RotatedOutputs(LinearPowers()).fit(x, y, np.arange(len(x)), np.random.default_rng(0))
    np.testing.assert_allclose(turned.turn_, np.diag(1 / y.std(axis=0)))
    x, y, groups = repeated()
    spread = (
        RotatedOutputs(LinearPowers(powers=12))
        .fit(x, y, groups, np.random.default_rng(0))
        .predict(x)
        .spread
    )
    np.testing.assert_allclose(np.median(spread, axis=0), np.sqrt(COVARIANCE.diagonal()), rtol=0.1)


def test_linear_regression_does_not_mind() -> None:
    """Least squares of turned outputs, turned back, are least squares."""
    inputs = known_law()[1]
    turned, plain = fitted_to_law(RotatedOutputs(LinearPowers())), fitted(LinearPowers())
    np.testing.assert_allclose(
        turned.predict(inputs.x).mean, plain.predict(inputs.x).mean, rtol=1e-6, atol=1e-3
    )


def fitted_to_law(estimator: Estimator) -> Estimator:
    rows = known_law()[0]
    return estimator.fit(rows.x, rows.y, rows.groups, np.random.default_rng(0))


def test_process_does_not_follow_the_noise() -> None:
    """Truth y = sin 3x + line is known: turned, the coupled process comes closer to it."""
    x, y, groups = repeated()
    truth = np.sin(3 * x[:, :1]) + x[:, 1:] * [1.0, -2.0, 3.0]
    off = [
        np.sqrt(
            np.mean(
                (estimator.fit(x, y, groups, np.random.default_rng(0)).predict(x).mean - truth) ** 2
            )
        )
        for estimator in (
            RotatedOutputs(Coregional(rank=1, components=False)),
            Coregional(rank=1, components=False),
        )
    ]
    assert off[0] < off[1]
    assert off[0] < 0.2
