"""Covariances between inputs that a frozen model predicts with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ...array_types import Floats
from .kernels import kernel_matrix


class Covariance(Protocol):
    """Of a noise-free output at inputs of standardised predictors."""

    def matrix(self, a: Floats, b: Floats) -> Floats:
        """Covariances n x p of a (n x d) and b (p x d)."""

    def variances(self, a: Floats) -> Floats:
        """Variances (n,) at a (n x d)."""


@dataclass(frozen=True, eq=False)
class NamedCovariance:
    """A kernel of `kernels.KERNELS` with a lengthscale for each predictor: plain NumPy."""

    kind: str
    lengthscales: Floats

    def matrix(self, a: Floats, b: Floats) -> Floats:
        """Covariances n x p."""
        scaled = a / self.lengthscales
        return kernel_matrix(self.kind, scaled, scaled if a is b else b / self.lengthscales)

    def variances(self, a: Floats) -> Floats:
        """1 everywhere."""
        return np.ones(len(a))


@dataclass(frozen=True, eq=False)
class TorchCovariance:
    """Any kernel of GPyTorch, in float64."""

    kernel: Any

    def matrix(self, a: Floats, b: Floats) -> Floats:
        """Covariances n x p."""
        import torch

        with torch.no_grad():
            first = torch.tensor(a)
            return np.asarray(self.kernel(first, first if a is b else torch.tensor(b)).to_dense().numpy())

    def variances(self, a: Floats) -> Floats:
        """The kernel's diagonal."""
        import torch

        with torch.no_grad():
            return np.asarray(self.kernel(torch.tensor(a), diag=True).numpy())
