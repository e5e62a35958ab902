"""Support vector regression with the Gaussian kernel, a machine for each output (thesis, section
4.3.2).

A linear support vector machine on features of the Gaussian kernel (MATLAB's `fitrkernel`, learner
"svm").
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from ...array_types import Floats
from .scikit_pipeline import PipelineRegression, regressor_per_output, scaling_pipeline


@dataclass(eq=False)
class SupportVectors(PipelineRegression):
    """Epsilon-insensitive machines (LIBSVM); `epsilon` in standard deviations of an output.

    MATLAB's `fitrsvm` ignores errors up to a tenth of an output's spread; soft tips' whole pulses
    are not much larger than that among those of hard ones, so ours ignores a fiftieth. `gamma` and
    `cost` are the same for all outputs.
    """

    gamma: float | None = None
    cost: float | None = None
    epsilon: float = 0.02

    kind: ClassVar[str] = "svr"
    parameters: ClassVar = {
        "gamma": "multioutputregressor__estimator__regressor__gamma",
        "cost": "multioutputregressor__estimator__regressor__C",
        "epsilon": "multioutputregressor__estimator__regressor__epsilon",
    }
    #: For standardised predictors and outputs.
    grid: ClassVar = {"gamma": (0.006, 0.02, 0.06, 0.2), "cost": (1.0, 10.0, 100.0)}
    logarithmic: ClassVar = ("gamma", "cost")

    def pipeline(self, seed: int) -> Any:  # noqa: ARG002
        from sklearn.svm import SVR

        return scaling_pipeline(regressor_per_output(SVR(cache_size=500)))


@dataclass(eq=False)
class SupportVectorKernel(PipelineRegression):
    """The kernel's values at `features` of the pulses stand for the kernel (Nystroem; Williams and
    Seeger, NIPS 2000).

    512 is `fitrkernel`'s number for 13 predictors. Its features are random Fourier ones
    (`RBFSampler`), which erred more here, and see raw predictors, where one of 1e11 Pa drowns the
    rest: the thesis's second-worst model. Errors beyond `epsilon` count squared, so that each
    machine has one smooth minimum, found to the end (LIBLINEAR, primal). `gamma` and `cost` are the
    same for all outputs.
    """

    features: int = 512
    gamma: float | None = None
    cost: float | None = None
    epsilon: float = 0.02

    kind: ClassVar[str] = "svr-kernel"
    parameters: ClassVar = {
        "features": "nystroem__n_components",
        "gamma": "nystroem__gamma",
        "cost": "multioutputregressor__estimator__regressor__C",
        "epsilon": "multioutputregressor__estimator__regressor__epsilon",
    }
    #: For standardised predictors and outputs.
    grid: ClassVar = {"gamma": (0.03, 0.1, 0.3), "cost": (1.0, 10.0, 100.0)}
    logarithmic: ClassVar = ("gamma", "cost")
    search_outputs: ClassVar[int] = 2

    def pipeline(self, seed: int) -> Any:
        from sklearn.kernel_approximation import Nystroem
        from sklearn.svm import LinearSVR

        machine = LinearSVR(loss="squared_epsilon_insensitive", dual=False)
        return scaling_pipeline(Nystroem(random_state=seed), regressor_per_output(machine))

    def _limit(self, regressor: Any, x: Floats) -> Any:
        """No more features than there are pulses."""
        name = self.parameters["features"]
        return regressor.set_params(**{name: min(regressor.get_params()[name], len(x))})
