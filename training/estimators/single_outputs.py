"""A Gaussian process of its own for each output: the thesis's 20 (section 4.3.2), which share
nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..gp.maximise import one_core
from ..gp.posterior import Posterior, posterior
from .base import (
    RELEARNING_CHANGE,
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


class SingleOutputs(LearnedArrays):
    """m exact processes with their own kernel parameters, variance and noise: each a
    `CoregionalModel` of one output.

    Each is trained on the same `tuning_rows` random rows (all, where there are no more) and
    predicts from all rows. What is kept is the rows and the parameters: m frozen posteriors would
    be 50 times as large; `restore` solves again. `kernel` is as of `Coregional`.
    """

    kind = "single-outputs"
    posteriors_: list[Posterior]
    #: Losses of the search of each output, per row; not kept on disk.
    losses_: list[Floats] | None = None

    def __init__(
        self,
        kernel: str | Mapping[str, Any] | Kernel = "rbf",
        iterations: int = 100,
        tuning_rows: int = 480,
    ) -> None:
        self.input_kernel = InputKernel(kernel)
        self.iterations, self.tuning_rows = iterations, tuning_rows

    def settings(self) -> dict[str, Any]:
        return {
            "kernel": self.input_kernel.description,
            "iterations": self.iterations,
            "tuning_rows": self.tuning_rows,
        }

    def shapes(self) -> Mapping[str, Shape]:
        kernel: dict[str, Shape] = {
            name: ("m", *shape) for name, shape in self.input_kernel.shapes().items()
        }
        tuned: dict[str, Shape] = {
            "loadings": ("m", 1, 1),
            "log_kappa": ("m", 1),
            "log_noise": ("m", 1),
        }
        return {"x": ("n", "d"), "y": ("n", "m"), **STANDARDS, **kernel, **tuned}

    def fit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:  # noqa: ARG002
        return self._fit(x, y, rng, [None] * y.shape[1])

    def relearn(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:  # noqa: ARG002
        """Every search begins at the parameters that its output has learned."""
        starts = [self._of_output(output) for output in range(y.shape[1])]
        return type(self)(**self.settings())._fit(x, y, rng, starts, change=RELEARNING_CHANGE)

    def _fit(
        self,
        x: Floats,
        y: Floats,
        rng: np.random.Generator,
        starts: Sequence[Arrays | None],
        change: float = USUAL_CHANGE,
    ) -> Self:
        inputs, outputs = Standard.of(x), Standard.of(y)
        rows = np.sort(rng.permutation(len(x))[: self.tuning_rows])
        z, columns = inputs.apply(x)[rows], outputs.apply(y)[rows]
        self.losses_ = []
        with one_core():
            tuned = [
                self._tuned(z, columns[:, [output]], start, change)
                for output, start in enumerate(starts)
            ]
        stacked = {name: np.stack([parameters[name] for parameters in tuned]) for name in tuned[0]}
        self._keep(x, y, inputs, outputs, stacked)
        return self

    def refit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:  # noqa: ARG002
        """Keeps the kernels' parameters and the standardisation they belong to; only solves."""
        learned, other = self._learned(), type(self)(**self.settings())
        others = ("x", "y", *STANDARDS)
        tuned = {name: array for name, array in learned.items() if name not in others}
        other._keep(x, y, standard_of(learned, "x"), standard_of(learned, "y"), tuned)
        return other

    def restore(self, arrays: Arrays) -> Self:
        super().restore(arrays)
        self._solve()
        return self

    def predict(self, x: Floats) -> Gaussian:
        learned = self._learned()
        inputs, outputs = standard_of(learned, "x"), standard_of(learned, "y")
        z = inputs.apply(self._asked(x, len(inputs.mean)))
        predictions = []
        for output, frozen in enumerate(self.posteriors_):
            own = self._of_output(output)
            covariance = self.input_kernel.scaled_covariance(own)
            predictions.append(frozen.predict(covariance, self.input_kernel.scaled(own, z)))
        mean, spread = (np.hstack(parts) for parts in zip(*predictions, strict=True))
        return Gaussian(outputs.undo(mean), spread * outputs.width)

    def fit_report(self) -> FitReport:
        """Medians over the outputs; the loss is their mean, each output's last value standing once
        it has ended."""
        learned = self._learned()
        medians = {name: np.median(learned[name], axis=0) for name in self.input_kernel.shapes()}
        settings, by_predictor = self.input_kernel.report(medians)
        return FitReport(
            {
                **settings,
                "noise": float(np.median(np.exp(0.5 * learned["log_noise"]))),
                "signal": float(np.median(np.abs(learned["loadings"]))),
                "iterations": self.iterations,
                "tuning_rows": self.tuning_rows,
            },
            by_predictor,
            {} if not self.losses_ else {"loss": _mean_history(self.losses_)},
        )

    def _tuned(
        self, z: Floats, column: Floats, start: Arrays | None, change: float = USUAL_CHANGE
    ) -> Arrays:
        from ..gp.marginal_likelihood import KroneckerMarginalLogLikelihood
        from ..gp.maximise import maximise
        from ..gp.multitask import CoregionalModel

        kernel = self.input_kernel.made(z.shape[1], start)
        model = CoregionalModel(z, column, kernel, 1)
        if start is not None:
            variances = (np.exp(start[name]) for name in ("log_kappa", "log_noise"))
            model.set_outputs(start["loadings"], *variances)
        likelihood = KroneckerMarginalLogLikelihood(model.likelihood, model)
        search = maximise(likelihood, self.iterations, change=change)
        if self.losses_ is not None:
            self.losses_.append(search.losses)
        return {
            **self.input_kernel.numbers(model.kernel),
            "loadings": model.loadings,
            "log_kappa": np.log(model.kappa),
            "log_noise": np.log(model.noise),
        }

    def _of_output(self, output: int) -> Arrays:
        """The parameters of one output's process."""
        names = (*self.input_kernel.shapes(), "loadings", "log_kappa", "log_noise")
        return {name: self._learned()[name][output] for name in names}

    def _keep(
        self, x: Floats, y: Floats, inputs: Standard, outputs: Standard, tuned: Arrays
    ) -> None:
        self.learned_ = {
            "x": np.array(x),
            "y": np.array(y),
            **standard_arrays(inputs, outputs),
            **tuned,
        }
        self._solve()

    def _solve(self) -> None:
        learned = self._learned()
        z, columns = (
            standard_of(learned, "x").apply(learned["x"]),
            standard_of(learned, "y").apply(learned["y"]),
        )
        self.posteriors_ = []
        with one_core():
            for output in range(columns.shape[1]):
                own = self._of_output(output)
                b = own["loadings"] @ own["loadings"].T + np.diag(np.exp(own["log_kappa"]))
                covariance = self.input_kernel.scaled_covariance(own)
                scaled = self.input_kernel.scaled(own, z)
                self.posteriors_.append(
                    posterior(covariance, scaled, columns[:, [output]], b, np.exp(own["log_noise"]))
                )


def _mean_history(losses: list[Floats]) -> list[float]:
    longest = max(len(history) for history in losses)
    padded = [np.pad(history, (0, longest - len(history)), mode="edge") for history in losses]
    return np.mean(padded, axis=0).tolist()  # type: ignore[no-any-return]
