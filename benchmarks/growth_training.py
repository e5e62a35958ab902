"""What training takes on 100 to 3,000 pulses, and predicting 1,000 others: every family of estimators."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from pyroshock.training.estimators.base import Estimator

from .coregional_ways import pulses
from .growth import Point, fitting, repeated
from .growth_diagnosis import cholesky
from .measuring import Spread

AXIS = "pulses"
SIZES = (100, 300, 1_000, 3_000)
ASKED, WARM = 1_000, 50
#: The laboratory's own model is asked for all sizes, whatever the budget of the others.
WHOLE, WHOLE_BUDGET_S = "coregional Gaussian process", 60.0
TRAINS, PREDICTS = "training a {}", "1,000 predictions of a {}"
#: Impacts of one configuration: what inner cross-validation keeps together.
PER_GROUP = 10


def families() -> dict[str, Callable[[], Estimator]]:
    from pyroshock.training.estimators.coregional import Coregional
    from pyroshock.training.estimators.linear import KernelRidge
    from pyroshock.training.estimators.network import Network
    from pyroshock.training.estimators.single_outputs import SingleOutputs
    from pyroshock.training.estimators.support_vectors import SupportVectors
    from pyroshock.training.estimators.trees import DecisionTree, TreeEnsemble

    return {
        "tree": DecisionTree,
        "tree ensemble": TreeEnsemble,
        "network of 10-10": partial(Network, (10, 10)),
        "kernel ridge": KernelRidge,
        "support vector machine": SupportVectors,
        "Gaussian process an output": SingleOutputs,
        WHOLE: Coregional,
    }


def training_points(
    others_s: float, sizes: tuple[int, ...] = SIZES, wanted: tuple[str, ...] | None = None
) -> tuple[list[Point], dict[tuple[str, str], str]]:
    """Of the `wanted` families (all); a size beyond the budget, `others_s` but for `WHOLE`, is left out."""
    points: list[Point] = []
    natures: dict[tuple[str, str], str] = {}
    known = families()
    for name in wanted or known:
        _learned(known[name], WARM)  # imports
        budget_s = max(others_s, WHOLE_BUDGET_S) if name == WHOLE else others_s
        found = fitting(partial(_trained, known[name], name, points), sizes, budget_s)
        points += [Point(AXIS, TRAINS.format(name), size, values) for size, values in found]
        if len(found) < len(sizes):
            natures[AXIS, TRAINS.format(name)] = f"{sizes[len(found)]:,} would take more than {budget_s:g} s: left out"
        elif "Gaussian" in name:
            one = Spread.of(cholesky(sizes[-1])).text(" ms", 1e3)
            natures[AXIS, TRAINS.format(name)] = f"one Cholesky factorisation of {sizes[-1]:,} x {sizes[-1]:,}: {one}"
    return points, natures


def _trained(make: Callable[[], Estimator], name: str, points: list[Point], n: int) -> tuple[float, ...]:
    """Seconds of training; its predictions are timed on the way."""
    learned: list[Estimator] = []
    seconds = repeated(lambda: learned.append(_learned(make, n)), most=3, enough_s=1.0)
    predict = partial(learned[-1].predict, pulses(ASKED)[0])
    points.append(Point(AXIS, PREDICTS.format(name), n, repeated(predict, 5, 1.0)))
    return seconds


def _learned(make: Callable[[], Estimator], n: int) -> Estimator:
    x, y = pulses(n)
    return make().fit(x, y, np.arange(n) // PER_GROUP, np.random.default_rng(0))
