"""The network whose size and penalty a genetic search has chosen (thesis, section 4.4 and Table
4.9)."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...parallel.executor import HERE, ExecutorConfig
from ...parallel.task import one_thread
from ..tuning.folds import grouped_folds
from ..tuning.genetic import (
    CREEP,
    CROSSED,
    MUTATED,
    Genes,
    GeneticResult,
    Search,
    SearchJournal,
    run_search,
)
from ..tuning.trials import SettingsSearch, Trial
from .base import Arrays, Estimator, FitReport, Gaussian, SettingValue, Standard, require_fitted
from .network import OPTIMISER, Network, outputs_of, train_network

#: Hidden layers; neurons in each of them; lambda. Neurons and lambda in even steps of their
#: logarithm.
LAYERS = (1, 2, 3)
NEURONS = tuple(int(n) for n in np.unique(np.rint(np.geomspace(4, 200, 24))))
PENALTIES = tuple(float(f"{p:.3g}") for p in np.geomspace(1e-6, 1e-1, 21))


class GeneticNetwork(Estimator):
    """A `Network` of 1 to 3 hidden layers of 4 to 200 neurons, lambda from 1e-6 to 0.1.

    Fitness is the error of pulses whose configurations were left out of `folds` folds: each one's
    RMSE over its range (eq. 4.4, by which the thesis ranks), averaged; a single output is measured
    against the range of all. The thesis searches with 50 candidates and 50 generations; the
    defaults are what two cores do in two minutes. Any number of `workers` (threads) gives the same
    network.

    Attributes, not settings, for they do not change what is found: `journal`, a file that keeps the
    search's state so that an interrupted one resumes; `progress`, told after each generation;
    `executor`, which tries the candidates. `found_` is the outcome of `fit`, `search_` what was
    tried for it.
    """

    kind = "genetic-network"
    journal: Path | None = None
    progress: Callable[[int, int, str], None] | None = None
    executor: ExecutorConfig = HERE
    found_: GeneticResult | None = None
    search_: SettingsSearch | None = None
    network_: Network | None = None

    def __init__(
        self,
        population: int = 12,
        generations: int = 8,
        folds: int = 5,
        iterations: int = 200,
        workers: int = 2,
    ) -> None:
        self.population, self.generations, self.folds = population, generations, folds
        self.iterations, self.workers = iterations, workers

    def settings(self) -> dict[str, Any]:
        names = ("population", "generations", "folds", "iterations", "workers")
        return {name: getattr(self, name) for name in names}

    def fit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:
        seed = int(rng.integers(2**62))
        levels = (len(LAYERS), len(NEURONS), len(PENALTIES))
        search = Search(
            levels, self.population, self.generations, min(2, self.population - 1), self.workers
        )
        left_out = grouped_folds(groups, self.folds, np.random.default_rng([seed, 1]))
        evaluate = _Fitness(x, y, left_out, self.iterations, seed)
        journal = SearchJournal(self.journal, self._fingerprint(seed, x, y, groups))
        with one_thread():
            self.found_ = run_search(
                search, evaluate, seed, journal, self.progress, show, self.executor
            )
        self.search_ = _search_of(journal)
        chance = _chance(seed, self.found_.genes)
        self.network_ = Network(*decoded(self.found_.genes), self.iterations).fit(
            x, y, groups, chance
        )
        return self

    def refit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:
        network, new = self._network(), type(self)(**self.settings())
        new.network_ = Network(network.layers, network.penalty, self.iterations).fit(
            x, y, groups, rng
        )
        return new

    def relearn(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:
        return self.refit(x, y, groups, rng)

    def predict(self, x: Floats) -> Gaussian:
        return self._network().predict(x)

    def arrays(self) -> Arrays:
        network = self._network()
        return {
            **network.arrays(),
            "layers": np.array(network.layers),
            "penalty": np.array([network.penalty]),
        }

    def restore(self, arrays: Arrays) -> Self:
        rest = dict(arrays)
        layers, penalty = rest.pop("layers", np.zeros(0)), rest.pop("penalty", np.zeros(0))
        is_list_of_sizes = layers.dtype.kind == "i" and layers.ndim == 1 and len(layers)
        if not (is_list_of_sizes and penalty.shape == (1,) and penalty.dtype.kind == "f"):
            raise ValueError(
                f"{self.kind!r} is restored from a network, its 'layers' and its 'penalty'"
            )
        self.network_ = Network(layers.tolist(), float(penalty[0]), self.iterations).restore(rest)
        return self

    def fit_report(self) -> FitReport:
        """The search's settings, and what it had found and evaluated after each generation; the
        network's own loss."""
        settings: dict[str, SettingValue] = {
            "population": self.population,
            "generations": self.generations,
            "search_folds": self.folds,
            "crossover_probability": CROSSED,
            "mutation_probability": MUTATED,
            "mutation_width": CREEP,
        }
        histories = dict[str, Sequence[float]]()
        if self.found_ is not None:
            settings |= {
                "search_best": self.found_.value,
                "candidates_evaluated": self.found_.evaluated,
            }
            histories = {
                "search_best": self.found_.best,
                "candidates_evaluated": self.found_.evaluated_by_generation,
            }
        searches = {} if self.search_ is None else {"": self.search_}
        return (
            self._network()
            .fit_report()
            .joined(FitReport(settings, histories=histories, searches=searches))
        )

    def _network(self) -> Network:
        return require_fitted(self.network_, self.kind)

    def _fingerprint(self, seed: int, x: Floats, y: Floats, groups: NDArray[Any]) -> dict[str, Any]:
        """What a value in the journal depends on, besides the genes: not on the search's length nor
        its workers."""
        digest = hashlib.sha256()
        for array in (x, y, np.unique(groups, return_inverse=True)[1]):
            digest.update(repr(array.shape).encode() + np.ascontiguousarray(array).tobytes())
        space = {"layers": LAYERS, "neurons": NEURONS, "penalties": PENALTIES}
        return {
            "seed": seed,
            "data": digest.hexdigest(),
            "folds": self.folds,
            "iterations": self.iterations,
            "optimiser": OPTIMISER,
            **space,
        }


@dataclass(frozen=True, eq=False)
class _Fitness:
    """Of genes; can be sent to other processes."""

    x: Floats
    y: Floats
    left_out: list[NDArray[np.bool_]]
    iterations: int
    seed: int

    def __call__(self, genes: Genes) -> float:
        chance = _chance(self.seed, genes)
        return left_out_error(
            *decoded(genes), self.x, self.y, self.left_out, self.iterations, chance
        )


def decoded(genes: Genes) -> tuple[tuple[int, ...], float]:
    """Neurons of each hidden layer, and lambda."""
    layers, neurons, penalty = genes
    return (NEURONS[neurons],) * LAYERS[layers], PENALTIES[penalty]


def _search_of(journal: SearchJournal) -> SettingsSearch:
    """Every candidate that was evaluated; those of an earlier search that this one resumed, too."""
    trials = tuple(
        Trial(
            {
                "hidden_layers": len(layers),
                "neurons_per_layer": layers[0],
                "regularisation": penalty,
            },
            value,
            journal.durations_s.get(genes),
        )
        for genes, value in journal.values.items()
        for layers, penalty in [decoded(genes)]
    )
    score = "mean RMSE over range of left-out configurations"
    return SettingsSearch("genetic search", score, trials, ("neurons_per_layer", "regularisation"))


def show(genes: Genes) -> str:
    layers, penalty = decoded(genes)
    return f"{len(layers)} x {layers[0]} neurons, lambda {penalty:.2g}"


def left_out_error(
    layers: tuple[int, ...],
    penalty: float,
    x: Floats,
    y: Floats,
    left_out: list[NDArray[np.bool_]],
    iterations: int,
    rng: np.random.Generator,
) -> float:
    """Mean over the rows of RMSE over range, each row predicted by the network that did not see its
    fold."""
    wrong = np.empty_like(y)
    for fold in left_out:
        inputs, outputs = Standard.of(x[~fold]), Standard.of(y[~fold])
        sizes = (x.shape[1], *layers, y.shape[1])
        network = train_network(
            inputs.apply(x[~fold]), outputs.apply(y[~fold]), sizes, penalty, iterations, rng
        )
        wrong[fold] = outputs.undo(outputs_of(network.layers, inputs.apply(x[fold]))) - y[fold]
    ranges = np.ptp(y, axis=1) if y.shape[1] > 1 else np.full(len(y), np.ptp(y))
    return float(np.mean(np.sqrt(np.mean(wrong**2, axis=1)) / ranges))


def _chance(seed: int, genes: Genes) -> np.random.Generator:
    """Of one candidate: the same in whatever order, and in whichever thread, candidates are
    tried."""
    return np.random.default_rng([seed, 2, *genes])
