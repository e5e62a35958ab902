"""Covariances of unit variance, by name, over inputs already divided by their lengthscales.

Each is a function of the squared distance q alone; "slope" is -2 dk/dq, which gives every derivative by a lengthscale.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Kernel:
    """`value` turns squared distances into covariances, in place; `slope` gives slopes, None where those are equal."""

    value: Callable[[Floats], Floats]
    slope: Callable[[Floats], Floats] | None = None


def _rbf(q: Floats) -> Floats:
    q *= -0.5
    return np.exp(q, out=q)


def _decay(q: Floats, order: float) -> tuple[Floats, Floats]:
    """sqrt(order q) and its exponential decay."""
    r = np.sqrt(order * q)
    return r, np.exp(-r)


def _matern32(q: Floats) -> Floats:
    r, decay = _decay(q, 3.0)
    r += 1.0
    return np.multiply(r, decay, out=q)


def _matern52(q: Floats) -> Floats:
    r, decay = _decay(q, 5.0)
    q *= 5.0 / 3.0
    q += r
    q += 1.0
    return np.multiply(q, decay, out=q)


def _matern32_slope(q: Floats) -> Floats:
    return 3.0 * _decay(q, 3.0)[1]


def _matern52_slope(q: Floats) -> Floats:
    r, decay = _decay(q, 5.0)
    r += 1.0
    r *= 5.0 / 3.0
    return np.multiply(r, decay, out=r)


def _rational(q: Floats) -> Floats:
    q *= 0.5
    q += 1.0
    return np.reciprocal(q, out=q)


KERNELS = {
    "rbf": Kernel(_rbf),
    "matern32": Kernel(_matern32, _matern32_slope),
    "matern52": Kernel(_matern52, _matern52_slope),
    "rational-quadratic": Kernel(_rational, lambda q: _rational(q.copy()) ** 2),  # mixture parameter 1
}


def kernel_named(kind: str) -> Kernel:
    """Raises `LookupError` that names those there are."""
    if kind not in KERNELS:
        raise LookupError(f"no kernel {kind!r}; there are: {', '.join(KERNELS)}")
    return KERNELS[kind]


def squared_distances(a: Floats, b: Floats) -> Floats:
    """n x p, never negative; where `a` is `b`, a diagonal of zeros and symmetric but for rounding."""
    if a is b:
        q = a @ a.T
        squares = q.diagonal().copy()
        q *= -2.0
        q += squares
        q += squares[:, None]
        np.fill_diagonal(q, 0.0)
    else:
        q = (-2.0 * a) @ b.T
        q += (a * a).sum(axis=1)[:, None]
        q += (b * b).sum(axis=1)
    return np.maximum(q, 0.0, out=q)


def kernel_matrix(kind: str, a: Floats, b: Floats) -> Floats:
    """Covariances n x p of a (n x d) and b (p x d), both divided by their lengthscales."""
    return kernel_named(kind).value(squared_distances(a, b))


def kernel_and_slope(kind: str, a: Floats) -> tuple[Floats, Floats]:
    """Covariances n x n of a (n x d) with itself and their slopes; one array where they are equal ("rbf")."""
    kernel, q = kernel_named(kind), squared_distances(a, a)
    if kernel.slope is None:
        value = kernel.value(q)
        return value, value
    slope = kernel.slope(q)
    return kernel.value(q), slope


def lengthscale_gradient(a: Floats, weighted: Floats) -> Floats:
    """Derivatives (d,) of a loss by the logarithms of the lengthscales; a (n x d) is divided by them.

    `weighted` (n x n, symmetric) is dloss/dK times the slope, element by element: dK/dlog l_i = slope (a_i - a_i')^2.
    """
    ends = (a * a).T @ weighted.sum(axis=1)
    return np.asarray(2.0 * (ends - (a * (weighted @ a)).sum(axis=0)))
