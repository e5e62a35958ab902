"""The parameters of greatest posterior density, by L-BFGS on the exact gradient."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .factor import factorise
from .kernels import Floats, kernel_and_slope, lengthscale_gradient
from .kronecker import TOLERANCE, Likelihood, likelihood
from .parameters import Parameters, penalty

#: Most that the factorisation may change the loss per value of y, by the rigorous bound (rarely a thousandth of it).
TRUNCATION = 1e-6
#: Below, what is left of the kernel's variance is rounding.
LEAST_TOLERANCE = 1e-15


@dataclass(frozen=True, eq=False)
class Found:
    """`losses` are the evaluations' values in turn, per value of y; `bound` as in `Likelihood`, at the end."""

    parameters: Parameters
    losses: Floats
    converged: bool
    bound: float


def evaluate(
    kind: str, x: Floats, y: Floats, at: Parameters, tolerance: float = TOLERANCE
) -> tuple[Likelihood, Parameters]:
    """Likelihood of y (n x m) at x (n x d) and its derivatives by the parameters.

    `tolerance` is where the kernel's factorisation first stops; it goes on where `TRUNCATION` is not kept.
    """
    a = x / at.lengthscales
    k, slope = kernel_and_slope(kind, a)
    found = likelihood(factorise(k, tolerance), y, at.b, at.sigma)
    while found.bound > TRUNCATION * y.size and tolerance > LEAST_TOLERANCE:
        tolerance = max(tolerance / 100, LEAST_TOLERANCE)
        found = likelihood(factorise(k, tolerance), y, at.b, at.sigma)
    return found, at.chained(found, lengthscale_gradient(a, np.multiply(found.by_k, slope, out=slope)))


def search(kind: str, x: Floats, y: Floats, start: Parameters, iterations: int = 400, change: float = 1e-6) -> Found:
    """From `start` until the loss per value of y changes by less than `change`."""
    from scipy.optimize import minimize

    losses: list[float] = []
    bounds: list[float] = []

    def loss(vector: Floats) -> tuple[float, Floats]:
        at = start.like(vector)
        found, gradient = evaluate(kind, x, y, at)
        prior, by_prior = penalty(at)
        losses.append((found.value + prior) / y.size)
        bounds.append(found.bound)
        return losses[-1], (gradient.vector() + by_prior.vector()) / y.size

    result = minimize(
        loss,
        start.vector(),
        jac=True,
        method="L-BFGS-B",
        bounds=start.bounds(),
        options={"maxiter": iterations, "maxfun": 2 * iterations, "ftol": change, "gtol": 1e-6, "maxcor": 20},
    )
    return Found(start.like(result.x), np.array(losses), bool(result.success), bounds[-1])
