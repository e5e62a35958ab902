"""Values of the named kernels in NumPy, over inputs already divided by their lengthscales.

Training uses GPyTorch's kernels of the same names (`multitask.named_kernel`). A frozen model
predicts with these: importing PyTorch alone takes longer than a whole prediction. Each is a
function of the squared distance alone and has unit variance.

Covariances between inputs that a frozen model predicts with.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ...array_types import Floats


def _rbf(q: Floats) -> Floats:
    q *= -0.5
    return np.exp(q, out=q)


def _matern32(q: Floats) -> Floats:
    r = np.sqrt(3.0 * q)
    return np.multiply(r + 1.0, np.exp(-r), out=q)


def _matern52(q: Floats) -> Floats:
    r = np.sqrt(5.0 * q)
    q *= 5.0 / 3.0
    q += r
    q += 1.0
    return np.multiply(q, np.exp(-r), out=q)


def _rational(q: Floats) -> Floats:
    q *= 0.5
    q += 1.0
    return np.reciprocal(q, out=q)


#: Name -> covariances of squared distances, computed in place. The rational quadratic has the
#: mixture parameter 1.
KERNELS: dict[str, Callable[[Floats], Floats]] = {
    "rbf": _rbf,
    "matern32": _matern32,
    "matern52": _matern52,
    "rational-quadratic": _rational,
}


def kernel_named(kind: str) -> Callable[[Floats], Floats]:
    """The covariance as a function of squared distances, which it overwrites.

    Parameters:
        kind: The name of the kernel in `KERNELS`.

    Raises:
        LookupError: For an unknown kernel, with the names that there are.
    """
    if kind not in KERNELS:
        kernel_names = ", ".join(KERNELS)
        raise LookupError(
            f"no kernel {kind!r}; there are: {kernel_names}; or hand in a "
            f"kernel of gpytorch.kernels"
        )
    return KERNELS[kind]


def squared_distances(a: Floats, b: Floats) -> Floats:
    """Squared distances (n, p), never negative; where `a` is `b`, a diagonal of zeros and symmetric
    but for rounding.

    Parameters:
        a: Points (n, d).
        b: Points (p, d).
    """
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
    """Covariances (n, p) between inputs.

    Parameters:
        kind: The name of the kernel in `KERNELS`.
        a: Inputs (n, d), divided by their lengthscales.
        b: Inputs (p, d), divided by their lengthscales.

    Raises:
        LookupError: For an unknown kernel, with the names that there are.
    """
    return kernel_named(kind)(squared_distances(a, b))


class Covariance(Protocol):
    """Of a noise-free output at inputs of standardised predictors."""

    def matrix(self, a: Floats, b: Floats) -> Floats:
        """Covariances (n, p) between inputs.

        Parameters:
            a: Standardised predictors (n, d).
            b: Standardised predictors (p, d).
        """

    def variances(self, a: Floats) -> Floats:
        """The variance (n,) at each input.

        Parameters:
            a: Standardised predictors (n, d).
        """


@dataclass(frozen=True, eq=False)
class NamedCovariance:
    """A kernel of `kernels.KERNELS` with a lengthscale for each predictor: plain NumPy."""

    kind: str
    lengthscales: Floats

    def matrix(self, a: Floats, b: Floats) -> Floats:
        """Covariances (n, p) between inputs.

        Parameters:
            a: Standardised predictors (n, d), which are divided by the lengthscales here.
            b: Standardised predictors (p, d), likewise.
        """
        scaled = a / self.lengthscales
        return kernel_matrix(self.kind, scaled, scaled if a is b else b / self.lengthscales)

    def variances(self, a: Floats) -> Floats:
        """1 everywhere (n,).

        Parameters:
            a: Standardised predictors (n, d).
        """
        return np.ones(len(a))


@dataclass(frozen=True, eq=False)
class TorchCovariance:
    """Any kernel of GPyTorch, in float64."""

    kernel: Any

    def matrix(self, a: Floats, b: Floats) -> Floats:
        """Covariances (n, p) between inputs.

        Parameters:
            a: Standardised predictors (n, d).
            b: Standardised predictors (p, d).
        """
        import torch

        with torch.no_grad():
            first = torch.tensor(a)
            return np.asarray(
                self.kernel(first, first if a is b else torch.tensor(b)).to_dense().numpy()
            )

    def variances(self, a: Floats) -> Floats:
        """The kernel's diagonal (n,).

        Parameters:
            a: Standardised predictors (n, d).
        """
        import torch

        with torch.no_grad():
            return np.asarray(self.kernel(torch.tensor(a), diag=True).numpy())
