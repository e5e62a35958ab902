"""`python -m benchmarks.genetic`: evaluations of the genetic search a minute, ours and scikit-learn's, as Markdown.

One evaluation is five-fold cross-validation, grouped by configuration, of one network on 1,440 pulses (13 inputs, 20
outputs) of a synthetic hammer campaign. Both get the same folds, standardised rows, sizes and number of L-BFGS steps,
and two cores: ours a thread for each candidate, scikit-learn's `MLPRegressor` all fits of all candidates through
joblib. They take turns. The errors stand beside the speed, for a fast bad fit is worth nothing. No penalty: with
several outputs MLPRegressor's loss is their mean but its slope that of their sum, so that a penalty of the same size
means another one there. The exit code is 1 where ours is slower, or its NRMSE more than a tenth above the peer's.
"""

from __future__ import annotations

import os
import statistics
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from pyroshock.training.estimators.base import Standard
from pyroshock.training.estimators.network import one_thread, outputs_of, train_network
from pyroshock.training.tuning.folds import grouped_folds

from .measuring import Spread, interleaved, ratio
from .shared_records import held_out, pulse_table

Floats = NDArray[np.float64]

CORES, FOLDS, STEPS, REPEATS = 2, 5, 300, 3
#: As the search meets them: from the narrow preset to the network of the thesis's Table 4.9.
CANDIDATES = ((10,), (25,), (100,), (10, 10, 10), (50, 50), (144, 144))
#: A peer may be a tenth better by the chance of its starts.
MARGIN = 1.1


@dataclass(frozen=True)
class Fold:
    """Standardised rows of the others, the inputs of those left out, and how to undo the outputs."""

    x: Floats
    y: Floats
    asked: Floats
    outputs: Standard
    out: NDArray[np.bool_]


def campaign() -> tuple[Floats, Floats, NDArray[np.str_]]:
    table, _ = held_out(pulse_table(np.random.default_rng(1), repetitions=10, positions=3), np.random.default_rng(2))
    return table.x, table.force_n, table.configuration


def folds_of(x: Floats, y: Floats, groups: NDArray[np.str_]) -> list[Fold]:
    folds = []
    for out in grouped_folds(groups, FOLDS, np.random.default_rng(3)):
        inputs, outputs = Standard.of(x[~out]), Standard.of(y[~out])
        folds.append(Fold(inputs.apply(x[~out]), outputs.apply(y[~out]), inputs.apply(x[out]), outputs, out))
    return folds


def by_us(folds: Sequence[Fold], candidates: Sequence[tuple[int, ...]], start: int = 0) -> list[list[Floats]]:
    """Left-out forces of each candidate and fold, from the random weights of a `start`."""

    def evaluate(layers: tuple[int, ...]) -> list[Floats]:
        rng, sizes = np.random.default_rng(4 + start), (folds[0].x.shape[1], *layers, folds[0].y.shape[1])
        networks = [train_network(fold.x, fold.y, sizes, 0.0, STEPS, rng) for fold in folds]
        return [
            fold.outputs.undo(outputs_of(network.layers, fold.asked))
            for fold, network in zip(folds, networks, strict=True)
        ]

    with one_thread(), ThreadPoolExecutor(CORES) as pool:
        # The dearest first, as the search does.
        order = sorted(range(len(candidates)), key=lambda one: -sum(candidates[one]))
        found = dict(zip(order, pool.map(evaluate, [candidates[one] for one in order]), strict=True))
        return [found[one] for one in range(len(candidates))]


def one_peer(fold: Fold, layers: tuple[int, ...], seed: int) -> Floats:
    import warnings

    from sklearn.neural_network import MLPRegressor
    from threadpoolctl import threadpool_limits

    network = MLPRegressor(hidden_layer_sizes=layers, solver="lbfgs", alpha=0.0, max_iter=STEPS, random_state=seed)
    with warnings.catch_warnings(), threadpool_limits(1):
        warnings.simplefilter("ignore")  # that it could have gone on
        return fold.outputs.undo(network.fit(fold.x, fold.y).predict(fold.asked))


def by_peer(folds: Sequence[Fold], candidates: Sequence[tuple[int, ...]], start: int = 0) -> list[list[Floats]]:
    from joblib import Parallel, delayed

    fits = [(fold, layers, seed) for layers in candidates for seed, fold in enumerate(folds, start * len(folds))]
    found = Parallel(n_jobs=CORES)(delayed(one_peer)(*fit) for fit in fits)
    return [found[first : first + len(folds)] for first in range(0, len(found), len(folds))]


#: What is left out of folds, for candidates and a start.
Way = Callable[[Sequence[Fold], Sequence[tuple[int, ...]], int], list[list[Floats]]]
WAYS: dict[str, Way] = {
    "pyroshock": by_us,
    "MLPRegressor, joblib": by_peer,
}


def keep(
    kept: dict[str, list[list[Floats]]], name: str, folds: Sequence[Fold], candidates: Sequence[tuple[int, ...]]
) -> None:
    kept[name] = WAYS[name](folds, candidates, 0)


def errors(forces: Sequence[Floats], folds: Sequence[Fold], y: Floats) -> tuple[float, float]:
    """RMSE (N) and NRMSE of left-out pulses, averaged over them."""
    wrong = np.empty_like(y)
    for force, fold in zip(forces, folds, strict=True):
        wrong[fold.out] = force - y[fold.out]
    rmse = np.sqrt(np.mean(wrong**2, axis=1))
    return float(rmse.mean()), float(np.mean(rmse / np.ptp(y, axis=1)))


def main() -> int:
    x, y, groups = campaign()
    folds = folds_of(x, y, groups)
    lines = [
        f"{len(x)} x {x.shape[1]} inputs, {y.shape[1]} outputs; {FOLDS} folds, {STEPS} steps, {CORES} workers on"
        f" {os.cpu_count()} cores, {REPEATS} repeats in turn: median (least to largest)",
        "",
        "| hidden layers | ours, evaluations/min | MLPRegressor + joblib | times as fast | RMSE N, ours / theirs |"
        " NRMSE, ours / theirs |",
        "| --- " * 6 + "|",
    ]
    nrmse: dict[str, list[float]] = {name: [] for name in WAYS}
    slower = False
    for candidates in (*((layers,) * CORES for layers in CANDIDATES), CANDIDATES):
        kept: dict[str, list[list[Floats]]] = {}
        taken = interleaved({name: partial(keep, kept, name, folds, candidates) for name in WAYS}, REPEATS)
        rates = {name: Spread.of([60 * len(candidates) / s for s in seconds]) for name, seconds in taken.items()}
        ours, theirs = taken.values()
        gain = ratio(theirs, ours)
        cells = [rate.text() for rate in rates.values()]
        if candidates is CANDIDATES:
            lines.append(f"| all of these | {' | '.join(cells)} | {gain.text()} | | |")
            slower = gain.median < 1
            continue
        found = {name: errors(forces[0], folds, y) for name, forces in kept.items()}
        for name, (_, one) in found.items():
            nrmse[name].append(one)
        (our_rmse, our_nrmse), (peer_rmse, peer_nrmse) = found.values()
        quality = f"{our_rmse:.1f} / {peer_rmse:.1f} | {our_nrmse:.4f} / {peer_nrmse:.4f}"
        lines.append(f"| {' x '.join(map(str, candidates[0]))} | {' | '.join(cells)} | {gain.text()} | {quality} |")
    ours_mean, theirs_mean = (statistics.mean(values) for values in nrmse.values())
    failed = ["speed"] * slower + ["NRMSE"] * (ours_mean > MARGIN * theirs_mean)
    lines.append(
        f"\nmean NRMSE {ours_mean:.4f} / {theirs_mean:.4f}; lost to the peer: {', '.join(failed) or 'nothing'}"
    )
    sys.stdout.write("\n".join(lines) + "\n")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
