"""The coregional process as GPyTorch and BoTorch have it: the same data and parameters, no priors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .coregional_ways import RANK, Evaluate, Floats, Predict, new_pulses, parameters, pulses


def bridged(n: int) -> Evaluate:
    """A GPyTorch model with our likelihood."""
    from pyroshock.training.gp.gpytorch_bridge import log_likelihood

    model, likelihood, x, y = _multitask(n)
    return _backward(model, lambda: -y.numel() * log_likelihood(likelihood, model(x), y))


def gpytorch(n: int) -> Evaluate:
    model, likelihood, x, y = _multitask(n)
    return _exact(lambda: -likelihood(model(x)).log_prob(y), model)


def botorch(n: int) -> Evaluate:
    model, likelihood, x, y = _kronecker(n)
    return _exact(lambda: -likelihood(model(x)).log_prob(y), model)


def gpytorch_predicts(n: int, asked: int) -> Predict:
    model, likelihood, _, _ = _multitask(n)
    return _predicting(model, lambda x: likelihood(model(x)), asked)


def botorch_predicts(n: int, asked: int) -> Predict:
    """Its spreads are near the exact ones, not equal to them, with its own settings and with exact ones."""
    model, _, _, _ = _kronecker(n)
    return _predicting(model, lambda x: model.posterior(x, observation_noise=True), asked)


def _multitask(n: int) -> tuple[Any, Any, Any, Any]:
    import torch
    from pyroshock.training.gp.gpytorch_bridge import multitask_model, set_parameters

    x, y = (torch.tensor(one) for one in pulses(n))
    model, likelihood = multitask_model(x, y, RANK)
    set_parameters(model, likelihood, parameters())
    return model, likelihood, x, y


def _kronecker(n: int) -> tuple[Any, Any, Any, Any]:
    import torch
    from botorch.models import KroneckerMultiTaskGP
    from gpytorch.kernels import RBFKernel
    from pyroshock.training.gp.gpytorch_bridge import multitask_model, set_parameters

    x, y = (torch.tensor(one) for one in pulses(n))
    likelihood = multitask_model(x, y, RANK)[1]
    model = KroneckerMultiTaskGP(x, y, likelihood=likelihood, data_covar_module=RBFKernel(ard_num_dims=13), rank=RANK)
    model.double().train()
    set_parameters(model, likelihood, parameters())
    return model, likelihood, x, y


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


def _predicting(model: Any, posterior: Callable[[Any], Any], asked: int) -> Predict:
    """Mean and standard deviation of new measurements; what is worked out of the data once, the first call does."""
    import torch
    from gpytorch import settings

    at = torch.tensor(new_pulses(asked))
    model.eval()
    model.likelihood.eval()

    def predict() -> tuple[Floats, Floats]:
        with torch.no_grad(), settings.fast_computations(False, False, False):
            found = posterior(at)
            return np.asarray(found.mean), np.sqrt(np.asarray(found.variance))

    return predict
