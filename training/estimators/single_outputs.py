"""A Gaussian process of its own for each output: the thesis's 20 (section 4.3.2), which share nothing."""

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
from ..gp.search import search
from .base import Arrays, Floats, Gaussian
from .learned import LearnedArrays, Shape
from .standard import Standard


class SingleOutputs(LearnedArrays):
    """m exact processes with their own lengthscales (one for each predictor), variance and noise.

    Each is tuned on the same `tuning_rows` random rows (all, where there are no more) and predicts from all rows. What
    is kept is the rows and the parameters: m frozen posteriors would be 50 times as large; `restore` solves again.
    """

    kind = "single-outputs"
    posteriors_: list[Posterior]

    def __init__(self, kernel: str = "rbf", iterations: int = 100, tuning_rows: int = 480) -> None:
        kernel_named(kernel)
        self.kernel, self.iterations, self.tuning_rows = kernel, iterations, tuning_rows

    def settings(self) -> dict[str, Any]:
        return {"kernel": self.kernel, "iterations": self.iterations, "tuning_rows": self.tuning_rows}

    def shapes(self) -> Mapping[str, Shape]:
        return {
            **{"x": ("n", "d"), "y": ("n", "m")},
            **{"x_mean": ("d",), "x_width": ("d",), "y_mean": ("m",), "y_width": ("m",)},
            **{"log_lengthscales": ("m", "d"), "loadings": ("m", 1, 1), "log_kappa": ("m", 1), "log_noise": ("m", 1)},
        }

    def fit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:  # noqa: ARG002
        inputs, outputs = Standard.of(x), Standard.of(y)
        rows = np.sort(rng.permutation(len(x))[: self.tuning_rows])
        z, columns = inputs.apply(x)[rows], outputs.apply(y)[rows]
        with one_core():
            tuned = [self._tuned(z, columns[:, [j]]) for j in range(columns.shape[1])]
        self._keep(x, y, inputs, outputs, {f.name: _stack(tuned, f.name) for f in fields(Parameters)})
        return self

    def refit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:  # noqa: ARG002
        """Keeps the kernels' parameters and the standardisation they belong to; only solves."""
        learned, other = self._learned(), type(self)(**self.settings())
        parameters = {f.name: learned[f.name] for f in fields(Parameters)}
        other._keep(x, y, self._standard("x"), self._standard("y"), parameters)
        return other

    def restore(self, arrays: Arrays) -> Self:
        super().restore(arrays)
        self._solve()
        return self

    def predict(self, x: Floats) -> Gaussian:
        inputs, outputs, scales = self._standard("x"), self._standard("y"), self._learned()["log_lengthscales"]
        z = inputs.apply(self._asked(x, len(inputs.mean)))
        found = [
            one.predict(self.kernel, z / np.exp(scale)) for one, scale in zip(self.posteriors_, scales, strict=True)
        ]
        mean, spread = (np.hstack(parts) for parts in zip(*found, strict=True))
        return Gaussian(outputs.undo(mean), spread * outputs.width)

    def _tuned(self, z: Floats, column: Floats) -> Parameters:
        return search(self.kernel, z, column, started(z.shape[1], 1, 1), self.iterations).parameters

    def _keep(self, x: Floats, y: Floats, inputs: Standard, outputs: Standard, parameters: Arrays) -> None:
        standards = {"x_mean": inputs.mean, "x_width": inputs.width, "y_mean": outputs.mean, "y_width": outputs.width}
        self.learned_ = {"x": np.array(x), "y": np.array(y), **standards, **parameters}
        self._solve()

    def _solve(self) -> None:
        learned = self._learned()
        z, columns = self._standard("x").apply(learned["x"]), self._standard("y").apply(learned["y"])
        names = [f.name for f in fields(Parameters)]
        with one_core():
            self.posteriors_ = [
                posterior(self.kernel, z, columns[:, [j]], Parameters(*(learned[name][j] for name in names)))
                for j in range(columns.shape[1])
            ]

    def _standard(self, axis: str) -> Standard:
        learned = self._learned()
        return Standard(learned[f"{axis}_mean"], learned[f"{axis}_width"])


def _stack(tuned: list[Parameters], name: str) -> Floats:
    return np.stack([getattr(one, name) for one in tuned])
