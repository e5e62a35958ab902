"""One way of computing a coregional likelihood, alone in its process.

`python -m benchmarks.coregional_ways WAY N REPEATS` prints what it found as one line of JSON. Every way has the same
data and parameters (B = W W' + diag(kappa), one noise for each output, a squared exponential with a lengthscale for
each predictor) and gives loss and gradient, no priors.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from collections.abc import Callable
from contextlib import nullcontext
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyroshock.training.gp.kernels import kernel_matrix, lengthscale_gradient
from pyroshock.training.gp.one_core import one_core
from pyroshock.training.gp.parameters import Parameters
from pyroshock.training.gp.search import evaluate

Floats = NDArray[np.float64]
#: Gives the negative log likelihood, after computing its gradient.
Evaluate = Callable[[], float]

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


def parameters() -> Parameters:
    rng = np.random.default_rng(2)
    noise = np.log(0.01) + 0.5 * rng.standard_normal(OUTPUTS)
    loadings = 0.4 * rng.standard_normal((OUTPUTS, RANK))
    return Parameters(np.log(rng.uniform(2.0, 6.0, 13)), loadings, np.full(OUTPUTS, np.log(0.01)), noise)


def ours(n: int) -> Evaluate:
    (x, y), at = pulses(n), parameters()
    return lambda: float(evaluate("rbf", x, y, at)[0].value)


def plain(n: int) -> Evaluate:
    """What one would write first: eigendecompositions of K and of the whitened B, n x n products."""
    (x, y), at = pulses(n), parameters()
    return lambda: _plain(x, y, at)


def _plain(x: Floats, y: Floats, at: Parameters) -> float:
    a, root = x / at.lengthscales, np.exp(-0.5 * at.log_noise)
    k = kernel_matrix("rbf", a, a)
    lengths, u = np.linalg.eigh(k)
    s, v = np.linalg.eigh(root[:, None] * at.b * root)
    turned = u.T @ (y * root) @ v
    total = s * np.maximum(lengths, 0.0)[:, None] + 1.0
    solved = turned / total
    alpha = u @ solved
    by_k = 0.5 * ((u * (s / total).sum(axis=1)) @ u.T - (alpha * s) @ alpha.T)
    lengthscale_gradient(a, by_k * k)
    solved.T @ (lengths[:, None] * solved)
    return 0.5 * float((turned * solved).sum() + np.log(total).sum() + len(y) * at.log_noise.sum() + y.size * LOG_2PI)


LOG_2PI = float(np.log(2 * np.pi))


def bridged(n: int) -> Evaluate:
    """A GPyTorch model with our likelihood."""
    import torch
    from pyroshock.training.gp.gpytorch_bridge import log_likelihood, multitask_model, set_parameters

    x, y = (torch.tensor(one) for one in pulses(n))
    model, likelihood = multitask_model(x, y, RANK)
    set_parameters(model, likelihood, parameters())
    return _backward(model, lambda: -y.numel() * log_likelihood(likelihood, model(x), y))


def gpytorch(n: int) -> Evaluate:
    import torch
    from pyroshock.training.gp.gpytorch_bridge import multitask_model, set_parameters

    x, y = (torch.tensor(one) for one in pulses(n))
    model, likelihood = multitask_model(x, y, RANK)
    set_parameters(model, likelihood, parameters())
    return _exact(lambda: -likelihood(model(x)).log_prob(y), model)


def botorch(n: int) -> Evaluate:
    import torch
    from botorch.models import KroneckerMultiTaskGP
    from gpytorch.kernels import RBFKernel
    from pyroshock.training.gp.gpytorch_bridge import multitask_model, set_parameters

    x, y = (torch.tensor(one) for one in pulses(n))
    likelihood = multitask_model(x, y, RANK)[1]
    model = KroneckerMultiTaskGP(x, y, likelihood=likelihood, data_covar_module=RBFKernel(ard_num_dims=13), rank=RANK)
    model.double().train()
    set_parameters(model, likelihood, parameters())
    return _exact(lambda: -likelihood(model(x)).log_prob(y), model)


def _exact(loss: Callable[[], Any], model: Any) -> Evaluate:
    """Without conjugate gradients and random probes, whose likelihood is an estimate."""
    from gpytorch import settings

    def evaluate_exactly() -> float:
        with settings.fast_computations(log_prob=False, covar_root_decomposition=False):
            return _backward(model, loss)()

    return evaluate_exactly


def _backward(model: Any, loss: Callable[[], Any]) -> Evaluate:
    def evaluate_once() -> float:
        model.zero_grad()
        value = loss()
        value.backward()
        return float(value.detach())

    return evaluate_once


def cholesky(n: int) -> Evaluate:
    """The yardstick: one factorisation of K + I."""
    from scipy.linalg import cholesky as factorised

    (x, _), at = pulses(n), parameters()
    k = kernel_matrix("rbf", x / at.lengthscales, x / at.lengthscales) + np.eye(n)
    return lambda: float(factorised(k, lower=True, check_finite=False)[0, 0])


WAYS: dict[str, Callable[[int], Evaluate]] = {
    "pyroshock": ours,
    "pyroshock in a GPyTorch model": bridged,
    "plain eigendecomposition": plain,
    "GPyTorch MultitaskKernel": gpytorch,
    "BoTorch KroneckerMultiTaskGP": botorch,
    "one Cholesky factorisation": cholesky,
    "one Cholesky factorisation, one core": cholesky,
}
#: `Coregional` trains on one core, so that its sums are the same each time; peers may use all.
ONE_CORE = ("pyroshock", "pyroshock in a GPyTorch model", "one Cholesky factorisation, one core")
TRAINING = "training"
PREDICTED = 10_000


def peak_bytes() -> int:
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def timed(way: str, n: int, repeats: int) -> dict[str, Any]:
    evaluate_once = WAYS[way](n)
    seconds, value = [], 0.0
    with one_core() if way in ONE_CORE else nullcontext():
        if repeats > 1:
            evaluate_once()  # imports and first pages
        for _ in range(repeats):
            begin = time.perf_counter()
            value = evaluate_once()
            seconds.append(time.perf_counter() - begin)
    return {"value": value, "seconds": seconds, "peak_bytes": peak_bytes()}


def trained(n: int) -> dict[str, Any]:
    """The whole model, from nothing to convergence, and what it predicts of other pulses."""
    from pyroshock.training.estimators.coregional import Coregional

    (x, y), (asked, _) = pulses(n), pulses(PREDICTED)
    begin = time.perf_counter()
    model = Coregional().fit(x, y, np.arange(n), np.random.default_rng(0))
    between = time.perf_counter()
    model.predict(asked)
    done = time.perf_counter()
    found = model.found_
    assert found is not None
    told = {"evaluations": len(found.losses), "converged": found.converged, "bound": float(found.bound)}
    return told | {"fit_s": between - begin, "predict_s": done - between, "peak_bytes": peak_bytes()}


if __name__ == "__main__":
    _way, _n, _repeats = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    sys.stdout.write(json.dumps(trained(_n) if _way == TRAINING else timed(_way, _n, _repeats)) + "\n")
