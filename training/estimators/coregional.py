"""All outputs in one Gaussian process whose outputs inform each other: the coregional GP of the
thesis (Table 4.7).

Outputs as principal components: uncorrelated columns of unit variance.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..gp.kernels import Covariance
from ..gp.maximise import one_core
from ..gp.posterior import Posterior, posterior
from .base import (
    RELEARNING_CHANGE,
    RELEARNING_ROWS,
    STANDARDS,
    USUAL_CHANGE,
    Arrays,
    FitReport,
    Gaussian,
    LearnedArrays,
    Shape,
    Standard,
    standard_arrays,
    standard_of,
)
from .input_kernel import InputKernel

if TYPE_CHECKING:
    from gpytorch.kernels import Kernel

    from ..gp.maximise import Maximisation


#: Components of less variance, relative to the largest, are rounding.
LEAST_VARIANCE = 1e-8


def principal(y: Floats) -> Floats:
    """Turn (p x m) that makes y (n x m, standardised) from its p components, p at least 1.

    Repetitions scatter in amplitude: all outputs together. As noise of each output by itself that
    cannot be said, and a coregional process learns it as a law of the speed, with lengthscales near
    nothing. Between components, the noise is nearly uncorrelated; the likelihood is also better
    conditioned (a fifth of the steps).
    """
    variances, directions = np.linalg.eigh(y.T @ y / len(y))
    kept = variances > LEAST_VARIANCE * variances[-1]
    kept[-1] = True
    variances, directions = variances[kept][::-1], directions[:, kept][:, ::-1]
    return np.asarray((directions * np.sqrt(np.where(variances > 0, variances, 1.0))).T)


def rotate_back(y: Floats, turn: Floats) -> Floats:
    """Components (n x p) of y (n x m); the rows of `turn` are orthogonal."""
    return np.asarray(y @ (turn / (turn * turn).sum(axis=1, keepdims=True)).T)


POSTERIOR: dict[str, Shape] = {
    "pivots": ("r", "k"),
    "projection": ("r", "r"),
    "weights": ("r", "m"),
    "s": ("p",),
    "remaining": ("r", "p"),
    "mixing": ("p", "m"),
    "noise": ("m",),
}


class Coregional(LearnedArrays):
    """Covariance B (x) K + D (x) I: K of a `kernel`, B = W W' + diag(kappa), W of `rank` columns
    (never more than outputs), D the noise of each: a `CoregionalModel` of GPyTorch in float64,
    trained by its exact marginal likelihood and priors in at most `iterations` steps; nothing is
    left to chance.

    `kernel` is "rbf", "matern32", "matern52" or "rational-quadratic", with a lengthscale for each
    predictor and its prior, or a kernel of `gpytorch.kernels` with priors of your own, over
    standardised predictors. B and D are those of the p principal `components`, where D is a noise
    correlated between outputs; without, they are the outputs' own, as in the thesis.
    `maximisation_` is the search: its losses, whether it converged; not kept on disk.
    """

    kind = "coregional"

    def __init__(
        self, kernel: str | Mapping[str, Any] | Kernel = "rbf", rank: int = 6,
        iterations: int = 400, components: bool = True,
    ) -> None:  # fmt: skip
        if rank < 1:
            raise ValueError(f"rank {rank}: the outputs share at least 1 process")
        self.input_kernel = InputKernel(kernel)
        self.rank, self.iterations, self.components = rank, iterations, components
        self.maximisation_: Maximisation | None = None

    def settings(self) -> dict[str, Any]:
        return {
            "kernel": self.input_kernel.description,
            "rank": self.rank,
            "iterations": self.iterations,
            "components": self.components,
        }

    def shapes(self) -> Mapping[str, Shape]:
        tuned: dict[str, Shape] = {
            "turn": ("p", "m"),
            "loadings": ("p", "q"),
            "log_kappa": ("p",),
            "log_noise": ("p",),
        }
        return STANDARDS | tuned | self.input_kernel.shapes() | POSTERIOR

    def fit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:  # noqa: ARG002
        return self._fit(x, y, np.arange(len(x)))

    def relearn(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:  # noqa: ARG002
        """Tuned on `RELEARNING_ROWS` random rows from the kernel that was learned, solved for
        all."""
        rows = np.sort(rng.permutation(len(x))[:RELEARNING_ROWS])
        new = type(self)(**self.settings())
        return new._fit(x, y, rows, self._learned(), change=RELEARNING_CHANGE)

    def _fit(
        self,
        x: Floats,
        y: Floats,
        tuning_rows: NDArray[np.intp],
        start: Arrays | None = None,
        change: float = USUAL_CHANGE,
    ) -> Self:
        from ..gp.marginal_likelihood import KroneckerMarginalLogLikelihood
        from ..gp.maximise import maximise
        from ..gp.multitask import CoregionalModel

        inputs, outputs = Standard.of(x), Standard.of(y)
        z, standard = inputs.apply(x), outputs.apply(y)
        with one_core():
            turn = principal(standard) if self.components else np.eye(y.shape[1])
            scores = rotate_back(standard, turn)[tuning_rows]
            model = CoregionalModel(
                z[tuning_rows], scores, self.input_kernel.made(z.shape[1], start), self.rank
            )
            self.maximisation_ = maximise(
                KroneckerMarginalLogLikelihood(model.likelihood, model),
                self.iterations,
                change=change,
            )
            tuned = {
                "turn": turn,
                "loadings": model.loadings,
                "log_kappa": np.log(model.kappa),
                "log_noise": np.log(model.noise),
                **self.input_kernel.numbers(model.kernel),
            }
            self._solve(x, y, {**standard_arrays(inputs, outputs), **tuned})
        return self

    def refit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:  # noqa: ARG002
        """Keeps the kernel's parameters and the standardisation they belong to; only solves."""
        other = type(self)(**self.settings())
        with one_core():
            other._solve(
                x,
                y,
                {name: array for name, array in self._learned().items() if name not in POSTERIOR},
            )
        return other

    def predict(self, x: Floats) -> Gaussian:
        learned = self._learned()
        inputs, outputs = standard_of(learned, "x"), standard_of(learned, "y")
        frozen = Posterior(**{name: learned[name] for name in POSTERIOR})
        z = inputs.apply(self._asked(x, len(inputs.mean)))
        mean, spread = frozen.predict(self._covariance(), self.input_kernel.scaled(learned, z))
        return Gaussian(outputs.undo(mean), spread * outputs.width)

    def fit_report(self) -> FitReport:
        learned = self._learned()
        settings, by_predictor = self.input_kernel.report(learned)
        search = self.maximisation_
        convergence = (
            {}
            if search is None
            else {"converged": search.converged, "evaluations": len(search.losses)}
        )
        return FitReport(
            {
                **settings,
                "rank": self.rank,
                "noise": float(np.median(np.exp(0.5 * learned["log_noise"]))),
                "components": len(learned["turn"]) if self.components else 0,
                "iterations": self.iterations,
                **convergence,
            },
            by_predictor,
            {} if search is None else {"loss": search.losses.tolist()},
        )

    def _covariance(self) -> Covariance:
        return self.input_kernel.scaled_covariance(self._learned())

    def _solve(self, x: Floats, y: Floats, tuned: Arrays) -> None:
        scores = rotate_back(standard_of(tuned, "y").apply(y), tuned["turn"])
        z = self.input_kernel.scaled(tuned, standard_of(tuned, "x").apply(x))
        b = tuned["loadings"] @ tuned["loadings"].T + np.diag(np.exp(tuned["log_kappa"]))
        covariance = self.input_kernel.scaled_covariance(tuned)
        frozen = posterior(covariance, z, scores, b, np.exp(tuned["log_noise"])).turned(
            tuned["turn"]
        )
        self.learned_ = {**tuned, **{name: getattr(frozen, name) for name in POSTERIOR}}
