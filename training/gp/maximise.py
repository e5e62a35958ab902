"""The parameters of greatest marginal likelihood or posterior density, by L-BFGS-B on GPyTorch's
gradient.

scipy's L-BFGS-B keeps bounds; PyTorch's `LBFGS` knows none, and takes as many evaluations
(docs/decisions, 23).

Linear algebra on one core: the same sums, and so the same model, whatever else runs.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import gpytorch
import numpy as np
import torch

from ...array_types import Floats
from .basis_process import LogInterval


@dataclass(frozen=True, eq=False)
class Maximisation:
    """`losses` are the negative likelihoods of the evaluations in turn, per value of y."""

    losses: Floats
    converged: bool
    truncation_bound: float = 0.0


def maximise(
    objective: Any,
    iterations: int,
    *,
    change: float = 1e-6,
    gradient: float = 1e-6,
    memory: int = 20,
) -> Maximisation:
    """Set the parameters of `objective.model` to those of its greatest value, from where they are.

    Parameters:
        objective: A marginal log likelihood of GPyTorch.
        iterations: The largest number of iterations; evaluations are twice as many at most.
        change: The search stops where the loss per value of y changes by less than this share of
            it; by default 1e-6.
        gradient: The search stops where no derivative of the loss per value of y is larger than
            this; by default 1e-6.
        memory: The number of past steps from which the curvature is estimated; by default 20.
    """
    from scipy.optimize import minimize

    model = objective.model
    (x,), y = model.train_inputs, model.train_targets
    parameters = [(name, p) for name, p in model.named_parameters() if p.requires_grad]
    bounds: Any = [pair for name, p in parameters for pair in _bounds(model, name, p)]
    losses: list[float] = []

    def loss(vector: Floats) -> tuple[float, Floats]:
        _set(parameters, vector)
        model.zero_grad()
        value = -objective(model(x), y)
        value.backward()
        losses.append(value.item())
        slopes = [
            np.zeros(p.numel()) if p.grad is None else p.grad.numpy().ravel() for _, p in parameters
        ]
        return losses[-1], np.concatenate(slopes)

    start: Floats = np.concatenate([p.detach().numpy().ravel() for _, p in parameters])
    options: dict[str, Any] = {
        "maxiter": iterations, "maxfun": 2 * iterations, "ftol": change, "gtol": gradient,
        "maxcor": memory,
    }  # fmt: skip
    with exactly():
        result = minimize(loss, start, jac=True, method="L-BFGS-B", bounds=bounds, options=options)  # type: ignore[call-overload]
    _set(parameters, result.x)
    bound = float(getattr(objective, "truncation_bound", 0.0))
    return Maximisation(np.array(losses), bool(result.success), bound)


@contextmanager
def exactly() -> Iterator[None]:
    """Without conjugate gradients and random probes, on one thread: the same sums on any
    machine."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with (
            gpytorch.settings.fast_computations(
                covar_root_decomposition=False, log_prob=False, solves=False
            ),
            gpytorch.settings.debug(False),
        ):
            yield
    finally:
        torch.set_num_threads(threads)


def _set(parameters: list[tuple[str, torch.nn.Parameter]], vector: Floats) -> None:
    at = 0
    for _, parameter in parameters:
        part = vector[at : at + parameter.numel()].reshape(parameter.shape)
        parameter.data = torch.from_numpy(part.astype(np.float64))
        at += parameter.numel()


def _bounds(
    model: Any, name: str, parameter: torch.nn.Parameter
) -> list[tuple[float | None, float | None]]:
    """Of the raw values, where the constraint does not keep them by its transform."""
    constraint = model.constraint_for_parameter_name(name)
    if isinstance(constraint, LogInterval):
        ends = (constraint.lower_bound.log(), constraint.upper_bound.log())
    elif constraint is not None and not constraint.enforced:
        ends = (constraint.lower_bound, constraint.upper_bound)
    else:
        return [(None, None)] * parameter.numel()
    low, high = (torch.broadcast_to(end, parameter.shape).numpy().ravel().tolist() for end in ends)
    return list(zip(low, high, strict=True))


@contextmanager
def one_core() -> Iterator[None]:
    """Also faster here: small matrices and a second thread that waits do not go together."""
    # Brings a BLAS of its own, which is limited only where it is loaded.
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1, user_api="blas"):
        yield
