"""All outputs in one Gaussian process whose outputs inform each other: the coregional GP of the thesis (Table 4.7)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ..gp.kernels import kernel_named
from ..gp.one_core import one_core
from ..gp.parameters import Parameters, started
from ..gp.posterior import Posterior, posterior
from ..gp.search import Found, search
from .base import Arrays, Floats, Gaussian
from .components import principal, unturned
from .learned import LearnedArrays, Shape
from .standard import Standard

_POSTERIOR: dict[str, Shape] = {
    "pivots": ("r", "d"),
    "projection": ("r", "r"),
    "weights": ("r", "m"),
    "s": ("p",),
    "remaining": ("r", "p"),
    "mixing": ("p", "m"),
    "noise": ("m",),
}


class Coregional(LearnedArrays):
    """Covariance B (x) K + D (x) I: K of a `kernel` with a lengthscale for each predictor, B = W W' + diag(kappa), W of
    `rank` columns (never more than outputs), D the noise of each. Trained exactly, in float64, by at most `iterations`
    steps; nothing is left to chance.

    B and D are those of the p principal `components`, where D is a noise correlated between outputs; without, they are
    the outputs' own, as in the thesis. `found_` is the search: its losses, whether it converged; not kept on disk.
    """

    kind = "coregional"

    def __init__(self, kernel: str = "rbf", rank: int = 6, iterations: int = 400, components: bool = True) -> None:
        kernel_named(kernel)
        if rank < 1:
            raise ValueError(f"rank {rank}: the outputs share at least 1 process")
        self.kernel, self.rank, self.iterations, self.components = kernel, rank, iterations, components
        self.found_: Found | None = None

    def settings(self) -> dict[str, Any]:
        return {
            "kernel": self.kernel,
            "rank": self.rank,
            "iterations": self.iterations,
            "components": self.components,
        }

    def shapes(self) -> Mapping[str, Shape]:
        standards: dict[str, Shape] = {"x_mean": ("d",), "x_width": ("d",), "y_mean": ("m",), "y_width": ("m",)}
        tuned: dict[str, Shape] = {"turn": ("p", "m"), "log_lengthscales": ("d",), "loadings": ("p", "q")}
        return standards | tuned | {"log_kappa": ("p",), "log_noise": ("p",)} | _POSTERIOR

    def fit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:  # noqa: ARG002
        inputs, outputs = Standard.of(x), Standard.of(y)
        z, standard = inputs.apply(x), outputs.apply(y)
        with one_core():
            turn = principal(standard) if self.components else np.eye(y.shape[1])
            start = started(z.shape[1], len(turn), self.rank)
            self.found_ = search(self.kernel, z, unturned(standard, turn), start, self.iterations)
            self._solve(x, y, {**_arrays("x", inputs), **_arrays("y", outputs), "turn": turn}, self.found_.parameters)
        return self

    def refit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:  # noqa: ARG002
        """Keeps the kernel's parameters and the standardisation they belong to; only solves."""
        learned, other = self._learned(), type(self)(**self.settings())
        tuned = Parameters(**{f.name: learned[f.name] for f in fields(Parameters)})
        with one_core():
            kept = {name: learned[name] for name in ("x_mean", "x_width", "y_mean", "y_width", "turn")}
            other._solve(x, y, kept, tuned)
        return other

    def predict(self, x: Floats) -> Gaussian:
        learned = self._learned()
        inputs, outputs = _standard(learned, "x"), _standard(learned, "y")
        a = inputs.apply(self._asked(x, len(inputs.mean))) / np.exp(learned["log_lengthscales"])
        frozen = Posterior(**{name: learned[name] for name in _POSTERIOR})
        mean, spread = frozen.predict(self.kernel, a)
        return Gaussian(outputs.undo(mean), spread * outputs.width)

    def _solve(self, x: Floats, y: Floats, kept: Arrays, tuned: Parameters) -> None:
        scores = unturned(_standard(kept, "y").apply(y), kept["turn"])
        frozen = posterior(self.kernel, _standard(kept, "x").apply(x), scores, tuned).turned(kept["turn"])
        self.learned_ = {
            **kept,
            **{f.name: getattr(tuned, f.name) for f in fields(tuned)},
            **{name: getattr(frozen, name) for name in _POSTERIOR},
        }


def _arrays(axis: str, standard: Standard) -> Arrays:
    return {f"{axis}_mean": standard.mean, f"{axis}_width": standard.width}


def _standard(arrays: Arrays, axis: str) -> Standard:
    return Standard(arrays[f"{axis}_mean"], arrays[f"{axis}_width"])
