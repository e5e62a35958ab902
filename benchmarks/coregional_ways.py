"""Ways of computing a coregional likelihood and its predictions, each alone in its process.

`python -m benchmarks.coregional_ways WAY` answers what it is asked (`apart`): a likelihood or a prediction of so many
pulses; `python -m benchmarks.coregional_ways training N` trains once and prints what it found as a line of JSON. Every
way has the same data and parameters (B = W W' + diag(kappa), one noise for each output, a squared exponential with a
lengthscale for each predictor); a likelihood is loss and gradient, and its value is without priors.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyroshock.training.gp.kernels import NamedCovariance, kernel_matrix
from pyroshock.training.gp.maximise import one_core
from pyroshock.training.gp.posterior import posterior

from .apart import Answer, answering

Floats = NDArray[np.float64]
#: Gives the negative log likelihood, after computing its gradient.
Evaluate = Callable[[], float]
#: Gives means and standard deviations (asked x outputs) of new measurements, by a process that knows its data.
Predict = Callable[[], tuple[Floats, Floats]]

OUTPUTS, RANK = 20, 6


def pulses(n: int) -> tuple[Floats, Floats]:
    """n standardised pulses as a hammer's: 13 predictors, a continuous speed among 60 combinations of factors."""
    rng = np.random.default_rng(1)
    tips, layers = rng.normal(size=(3, 5)), rng.normal(size=(5, 4))
    tip, layer, held = (rng.integers(size, size=n) for size in (3, 5, 2))
    speed = rng.choice([0.6, 1.3], n) * np.exp(0.15 * rng.standard_normal(n))
    extra = np.column_stack([speed, layer % 3, layer > 2, held])
    x = np.column_stack([tips[tip], layers[layer], extra])
    phase = np.linspace(0.0, 1.0, OUTPUTS)
    shape = np.sin(np.pi * np.clip(phase, 0.02, 0.98)) ** (1 + 0.2 * tip + 0.1 * (layer > 2))[:, None]
    y = shape * (speed * np.exp(0.03 * rng.standard_normal(n)))[:, None] + 0.01 * rng.standard_normal((n, OUTPUTS))
    return (x - x.mean(axis=0)) / x.std(axis=0), (y - y.mean(axis=0)) / y.std(axis=0)


def new_pulses(count: int) -> Floats:
    """Predictors (count x 13) of others, at most 500."""
    return pulses(500)[0][:count]


@dataclass(frozen=True, eq=False)
class Parameters:
    """Lengthscales (13,), loadings W (20 x `RANK`), and the variances kappa and noise (20,)."""

    lengthscales: Floats
    loadings: Floats
    kappa: Floats
    noise: Floats

    @property
    def b(self) -> Floats:
        return np.asarray(self.loadings @ self.loadings.T + np.diag(self.kappa))


def parameters() -> Parameters:
    rng = np.random.default_rng(2)
    noise = 0.01 * np.exp(0.5 * rng.standard_normal(OUTPUTS))
    loadings = 0.4 * rng.standard_normal((OUTPUTS, RANK))
    return Parameters(rng.uniform(2.0, 6.0, 13), loadings, np.full(OUTPUTS, 0.01), noise)


def plain(n: int) -> Evaluate:
    """What one would write first: eigendecompositions of K and of the whitened B, n x n products."""
    (x, y), at = pulses(n), parameters()
    return lambda: _plain(x, y, at)


def _plain(x: Floats, y: Floats, at: Parameters) -> float:
    a, root = x / at.lengthscales, at.noise**-0.5
    k = kernel_matrix("rbf", a, a)
    lengths, u = np.linalg.eigh(k)
    s, v = np.linalg.eigh(root[:, None] * at.b * root)
    turned = u.T @ (y * root) @ v
    total = s * np.maximum(lengths, 0.0)[:, None] + 1.0
    solved = turned / total
    alpha = u @ solved
    by_k = 0.5 * ((u * (s / total).sum(axis=1)) @ u.T - (alpha * s) @ alpha.T)
    weighted = by_k * k
    (a * a).T @ weighted.sum(axis=1) - (a * (weighted @ a)).sum(axis=0)
    solved.T @ (lengths[:, None] * solved)
    constants = len(y) * np.log(at.noise).sum() + y.size * np.log(2 * np.pi)
    return 0.5 * float((turned * solved).sum() + np.log(total).sum() + constants)


def cholesky(n: int) -> Evaluate:
    """The yardstick: one factorisation of K + I."""
    from scipy.linalg import cholesky as factorised

    (x, _), at = pulses(n), parameters()
    k = kernel_matrix("rbf", x / at.lengthscales, x / at.lengthscales) + np.eye(n)
    return lambda: float(factorised(k, lower=True, check_finite=False)[0, 0])


def ours_predicts(n: int, asked: int) -> Predict:
    (x, y), at, new = pulses(n), parameters(), new_pulses(asked)
    covariance = NamedCovariance("rbf", at.lengthscales)
    frozen = posterior(covariance, x, y, at.b, at.noise)
    return lambda: frozen.predict(covariance, new)


def product(n: int, asked: int) -> Predict:
    """The yardstick: the products of (asked x n) with (n x outputs) that a mean takes, and as much for the spread."""
    h, weights = np.ones((asked, n)), np.ones((n, OUTPUTS))
    return lambda: (h @ weights, h @ weights)


def ways() -> dict[str, Callable[[int], Evaluate]]:
    from . import coregional_peers as models

    return {
        "pyroshock": models.ours,
        "plain eigendecomposition": plain,
        CHOLESKY: cholesky,
        ONE_CORE_CHOLESKY: cholesky,
        "GPyTorch MultitaskKernel": models.gpytorch,
        "BoTorch KroneckerMultiTaskGP": models.botorch,
    }


def predictions() -> dict[str, Callable[[int, int], Predict]]:
    from . import coregional_peers as models

    return {
        "pyroshock": ours_predicts,
        "GPyTorch MultitaskKernel": models.gpytorch_predicts,
        "BoTorch KroneckerMultiTaskGP": models.botorch_predicts,
        CHOLESKY: product,
        ONE_CORE_CHOLESKY: product,
    }


CHOLESKY, ONE_CORE_CHOLESKY = "one Cholesky factorisation", "one Cholesky factorisation, one core"
#: `Coregional` trains on one core, so that its sums are the same each time; peers may use all.
ONE_CORE = ("pyroshock", ONE_CORE_CHOLESKY)
TRAINING = "training"
PREDICTED = 10_000


def written(file: Path, n: int, asked: int) -> Path:
    """The same pulses and parameters as a file, for a program that imports nothing of ours."""
    (x, y), at = pulses(n), parameters()
    np.savez(file, x=x, y=y, asked=new_pulses(asked), **vars(at))
    return file


def peak_bytes() -> int:
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


class Way:
    """One way in this process; what it is asked for twice is prepared once."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._known: dict[tuple[Any, ...], Callable[[], Any]] = {}

    def answer(self, request: Answer) -> Answer:
        """{"what": "likelihood", "n"} or {"what": "prediction", "n", "asked"} to seconds, value and peak memory."""
        key = (request["what"], request["n"], request.get("asked"))
        with one_core() if self._name in ONE_CORE else nullcontext():
            if key not in self._known:
                self._known[key] = self._prepared(*key)
            begin = time.perf_counter()
            found = self._known[key]()
            seconds = time.perf_counter() - begin
        told = {"seconds": seconds, "peak_bytes": peak_bytes()}
        if key[0] == "likelihood":
            return told | {"value": found}
        return told | {"mean": found[0].tolist(), "spread": found[1].tolist()}

    def _prepared(self, what: str, n: int, asked: int | None) -> Callable[[], Any]:
        if what == "likelihood":
            return ways()[self._name](n)
        return predictions()[self._name](n, asked or 1)


def trained(n: int) -> dict[str, Any]:
    """The whole model, from nothing to convergence, and what it predicts of other pulses; seconds of a core, too."""
    from pyroshock.training.estimators.coregional import Coregional

    (x, y), (asked, _) = pulses(n), pulses(PREDICTED)
    begin, begin_of_core = time.perf_counter(), time.process_time()
    model = Coregional().fit(x, y, np.arange(n), np.random.default_rng(0))
    between, fit_core_s = time.perf_counter(), time.process_time() - begin_of_core
    model.predict(asked)
    done = time.perf_counter()
    search = model.maximisation_
    assert search is not None
    return {
        "evaluations": len(search.losses),
        "loss": float(search.losses[-1]),
        "converged": search.converged,
        "bound": search.truncation_bound,
        "fit_s": between - begin,
        "fit_core_s": fit_core_s,
        "predict_s": done - between,
        "peak_bytes": peak_bytes(),
    }


def main(arguments: list[str]) -> None:
    if arguments[0] == TRAINING:
        sys.stdout.write(json.dumps(trained(int(arguments[1]))) + "\n")
    else:
        answering(Way(arguments[0]).answer)


if __name__ == "__main__":
    main(sys.argv[1:])
