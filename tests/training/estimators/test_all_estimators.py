"""What every regression of the zoo promises, whatever it learns with. A newcomer is tested by being listed."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from pyroshock.training.estimators.base import Estimator
from pyroshock.training.estimators.genetic_network import GeneticNetwork
from pyroshock.training.estimators.linear import KernelRidge, LinearPowers, PartialLeastSquares
from pyroshock.training.estimators.network import Network
from pyroshock.training.estimators.support_vectors import SupportVectorKernel, SupportVectors
from pyroshock.training.estimators.trees import DecisionTree, TreeEnsemble
from support.checks.estimator_checks import CHECKS, check_learns_known_law, check_units_do_not_matter

#: With the NRMSE that each must reach on the known law. Neither powers nor components know that tips multiply speeds.
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
MEMBERS = pytest.mark.parametrize("estimator", [one for one, _ in ESTIMATORS], ids=lambda one: one.kind)


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
@MEMBERS
def test_promise(estimator: Estimator, check: Callable[[Estimator], None]) -> None:
    check(estimator)


@pytest.mark.parametrize(("estimator", "worst"), ESTIMATORS, ids=lambda value: getattr(value, "kind", None))
def test_learns_known_law(estimator: Estimator, worst: float) -> None:
    check_learns_known_law(estimator, worst)


@pytest.mark.parametrize("estimator", [LinearPowers(), PartialLeastSquares(), KernelRidge()], ids=lambda one: one.kind)
def test_units_do_not_matter(estimator: Estimator) -> None:
    check_units_do_not_matter(estimator)
