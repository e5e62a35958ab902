"""Support vector regression with the Gaussian kernel, a machine for each output (thesis, section 4.3.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from .scikit_pipeline import PipelineRegression, regressor_per_output, scaling_pipeline


@dataclass(eq=False)
class SupportVectors(PipelineRegression):
    """Epsilon-insensitive machines (LIBSVM); `epsilon` in standard deviations of an output.

    MATLAB's `fitrsvm` ignores errors up to a tenth of an output's spread; soft tips' whole pulses are not much larger
    than that among those of hard ones, so ours ignores a fiftieth. `gamma` and `cost` are the same for all outputs.
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

    def pipeline(self, seed: int) -> Any:  # noqa: ARG002
        from sklearn.svm import SVR

        return scaling_pipeline(regressor_per_output(SVR(cache_size=500)))
