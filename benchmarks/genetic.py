"""`python -m benchmarks.genetic`: evaluations of the genetic search, ours and scikit-learn's.

One evaluation is five-fold cross-validation, grouped by configuration, of one network on 1,440
pulses (13 inputs, 20 outputs) of a synthetic hammer campaign. Both get the same folds, standardised
rows, sizes and number of L-BFGS steps, and two cores: ours a thread for each candidate,
scikit-learn's `MLPRegressor` all fits of all candidates through joblib. The errors stand beside the
speed, for a fast bad fit is worth nothing. No penalty: with several outputs MLPRegressor's loss is
their mean but its slope that of their sum, so that a penalty of the same size means another one
there.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pyroshock.parallel.task import one_thread
from pyroshock.training.estimators.base import Standard
from pyroshock.training.estimators.network import outputs_of, train_network
from pyroshock.training.tuning.folds import grouped_folds

from .harness import Figure, beside, multiplying, report, take_turns
from .shared_records import held_out, pulse_table

Floats = NDArray[np.float64]
Layers = tuple[int, ...]

CORES, FOLDS, STEPS = 2, 5, 300
THEME = f"Genetic search: candidates evaluated by {FOLDS} folds of 1,440 pulses, {STEPS} steps each"
OURS, PEER = "ours", "scikit-learn, joblib"
#: As the search meets them: from the narrow preset up, and the network of the thesis's Table 4.9.
QUICK: tuple[Layers, ...] = ((25,), (100,), (10, 10, 10), (50, 50))
CANDIDATES: tuple[Layers, ...] = ((10,), *QUICK, (144, 144))
#: A peer may be a tenth better by the chance of its starts.
MARGIN = 1.1


@dataclass(frozen=True)
class Fold:
    """Standardised rows of the others, the inputs of those left out, and how to undo the
    outputs."""

    x: Floats
    y: Floats
    asked: Floats
    outputs: Standard
    out: NDArray[np.bool_]


def folds_of(x: Floats, y: Floats, groups: NDArray[np.str_]) -> list[Fold]:
    folds = []
    for out in grouped_folds(groups, FOLDS, np.random.default_rng(3)):
        inputs, outputs = Standard.of(x[~out]), Standard.of(y[~out])
        folds.append(
            Fold(inputs.apply(x[~out]), outputs.apply(y[~out]), inputs.apply(x[out]), outputs, out)
        )
    return folds


def by_us(folds: Sequence[Fold], candidates: Sequence[Layers], start: int) -> list[list[Floats]]:
    """Left-out forces of each candidate and fold, from the random weights of a `start`."""

    def evaluate(layers: Layers) -> list[Floats]:
        rng, sizes = (
            np.random.default_rng(4 + start),
            (folds[0].x.shape[1], *layers, folds[0].y.shape[1]),
        )
        networks = [train_network(fold.x, fold.y, sizes, 0.0, STEPS, rng) for fold in folds]
        pairs = zip(folds, networks, strict=True)
        return [
            fold.outputs.undo(outputs_of(network.layers, fold.asked)) for fold, network in pairs
        ]

    with one_thread(), ThreadPoolExecutor(CORES) as pool:
        # The dearest first, as the search does.
        order = sorted(range(len(candidates)), key=lambda i: -sum(candidates[i]))
        forces = dict(zip(order, pool.map(evaluate, [candidates[i] for i in order]), strict=True))
        return [forces[i] for i in range(len(candidates))]


def fit_peer(fold: Fold, layers: Layers, seed: int) -> Floats:
    from sklearn.neural_network import MLPRegressor
    from threadpoolctl import threadpool_limits

    network = MLPRegressor(
        hidden_layer_sizes=layers, solver="lbfgs", alpha=0.0, max_iter=STEPS, random_state=seed
    )
    with warnings.catch_warnings(), threadpool_limits(1):
        warnings.simplefilter("ignore")  # that it could have gone on
        return fold.outputs.undo(network.fit(fold.x, fold.y).predict(fold.asked))


def by_peer(folds: Sequence[Fold], candidates: Sequence[Layers], start: int) -> list[list[Floats]]:
    from joblib import Parallel, delayed

    fits = [
        (fold, layers, seed)
        for layers in candidates
        for seed, fold in enumerate(folds, start * len(folds))
    ]
    forces = Parallel(n_jobs=CORES)(delayed(fit_peer)(*fit) for fit in fits)
    return [forces[first : first + len(folds)] for first in range(0, len(forces), len(folds))]


def error(forces: Sequence[Floats], folds: Sequence[Fold], y: Floats) -> float:
    """NRMSE of left-out pulses, averaged over them."""
    wrong = np.empty_like(y)
    for force, fold in zip(forces, folds, strict=True):
        wrong[fold.out] = force - y[fold.out]
    return float(np.mean(np.sqrt(np.mean(wrong**2, axis=1)) / np.ptp(y, axis=1)))


def measure_genetic(
    _folder: Path, candidates: Sequence[Layers] = QUICK, repeats: int = 3
) -> Iterator[Figure]:
    """All candidates at once, as the search has them; then how good what they learned from some
    starts is."""
    table, _ = held_out(
        pulse_table(np.random.default_rng(1), repetitions=10, positions=3), np.random.default_rng(2)
    )
    folds = folds_of(table.x, table.force_n, table.configuration)
    errors: dict[str, list[float]] = {OURS: [], PEER: []}

    def learn(
        name: str, evaluate: Callable[[Sequence[Fold], Sequence[Layers], int], list[list[Floats]]]
    ) -> None:
        forces = evaluate(folds, candidates, len(errors[name]))
        errors[name].append(
            float(np.mean([error(force_of_run, folds, table.force_n) for force_of_run in forces]))
        )

    functions = {OURS: partial(learn, OURS, by_us), PEER: partial(learn, PEER, by_peer)}
    limit = multiplying(_flops(folds, candidates), np.float32)
    taken = take_turns({**functions, "bound": limit}, repeats, reported=["bound"])
    seconds = {
        name: [s / len(candidates) for s in all_candidates]
        for name, all_candidates in taken.items()
    }
    sizes = ", ".join("x".join(map(str, layers)) for layers in candidates)
    yield beside(
        THEME, f"seconds for one of {sizes}", seconds, PEER, unit="s", limit=1.0,
        bound="one gradient a step at the rate of a product of matrices",
        question="an evaluation of the genetic search",
    )  # fmt: skip
    yield beside(
        THEME,
        f"error of left-out pulses (NRMSE), mean of the candidates, {len(errors[OURS])} starts",
        errors, PEER,
        unit="", limit=MARGIN, kind="quality", bound="the noise of the pulses",
    )  # fmt: skip


def _flops(folds: Sequence[Fold], candidates: Sequence[Layers]) -> float:
    """Two operations a weight and row for the answer, four for the slope; one evaluation a step is
    the least."""
    inputs, outputs = folds[0].x.shape[1], folds[0].y.shape[1]
    weights = [sum(a * b for a, b in pairwise((inputs, *layers, outputs))) for layers in candidates]
    return 6.0 * STEPS * float(sum(weights)) * sum(len(fold.x) for fold in folds)


if __name__ == "__main__":
    sys.exit(report(partial(measure_genetic, candidates=CANDIDATES)))
