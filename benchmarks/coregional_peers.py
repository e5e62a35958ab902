"""The coregional process as GPyTorch and BoTorch have it: the same data and parameters, no priors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .coregional_ways import RANK, Evaluate, Floats, Predict, new_pulses, parameters, pulses


def ours(n: int) -> Evaluate:
    """As it is trained, priors included; what it returns is the loss without them."""
    from pyroshock.training.gp.marginal_likelihood import KroneckerMarginalLogLikelihood
    from pyroshock.training.gp.maximise import exactly
    from pyroshock.training.gp.multitask import named_kernel

    model = _multitask(n, named_kernel("rbf", 13))
    (x,), y = model.train_inputs, model.train_targets
    objective = KroneckerMarginalLogLikelihood(model.likelihood, model)
    evaluate_once = _backward(model, lambda: -y.numel() * objective(model(x), y))

    def evaluate() -> float:
        with exactly():
            loss = evaluate_once()
        priors = (prior.log_prob(closure(module)) for _, module, prior, closure, _ in model.named_priors())
        return loss + sum(float(log_density.detach().sum()) for log_density in priors)

    return evaluate


def gpytorch(n: int) -> Evaluate:
    model = _multitask(n, _kernel())
    (x,), y = model.train_inputs, model.train_targets
    return _exact(lambda: -model.likelihood(model(x)).log_prob(y), model)


def botorch(n: int) -> Evaluate:
    model, x, y = _kronecker(n)
    return _exact(lambda: -model.likelihood(model(x)).log_prob(y), model)


def gpytorch_predicts(n: int, asked: int) -> Predict:
    model = _multitask(n, _kernel())
    return _predicting(model, lambda x: model.likelihood(model(x)), asked)


def botorch_predicts(n: int, asked: int) -> Predict:
    """Its spreads are near the exact ones, not equal to them, with its own settings and with exact ones."""
    model, _, _ = _kronecker(n)
    return _predicting(model, lambda x: model.posterior(x, observation_noise=True), asked)


def _kernel() -> Any:
    from gpytorch.kernels import RBFKernel

    return RBFKernel(ard_num_dims=13).double()


def _multitask(n: int, kernel: Any) -> Any:
    from pyroshock.training.gp.multitask import CoregionalModel

    model = CoregionalModel(*pulses(n), kernel, RANK)
    model.set_parameters(**vars(parameters()))
    return model


def _kronecker(n: int) -> tuple[Any, Any, Any]:
    import torch
    from botorch.models import KroneckerMultiTaskGP

    x, y = (torch.tensor(array) for array in pulses(n))
    at, like = parameters(), _multitask(n, _kernel())
    model = KroneckerMultiTaskGP(x, y, likelihood=like.likelihood, data_covar_module=like.kernel, rank=RANK)
    model.double().train()
    index = model.covar_module.task_covar_module
    index.covar_factor.data = torch.tensor(at.loadings)
    index.var = torch.tensor(at.kappa)
    return model, x, y


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
