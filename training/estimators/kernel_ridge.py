"""Kernel regression by least squares with the Gaussian kernel (thesis, eq. 4.9)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from .scikit_pipeline import PipelineRegression, scale_outputs, scaling_pipeline


@dataclass(eq=False)
class KernelRidge(PipelineRegression):
    """All outputs on one kernel matrix: exp(-gamma |x - x_c|^2), which is eq. 4.9 with lambda = 1 / (2 gamma) and
    without the factor before it; `alpha` is the ridge on its diagonal.

    MATLAB's `fitrkernel` with the "leastsquares" learner, which the thesis used, approaches the same law by random
    features, one output at a time, on raw predictors.
    """

    gamma: float | None = None
    alpha: float | None = None

    kind: ClassVar[str] = "kernel-ridge"
    parameters: ClassVar = {"gamma": "regressor__kernelridge__gamma", "alpha": "regressor__kernelridge__alpha"}
    #: For standardised predictors and outputs.
    grid: ClassVar = {
        "gamma": np.geomspace(0.003, 1.0, 6).tolist(),
        "alpha": np.geomspace(1e-4, 1.0, 5).tolist(),
    }
    folds: ClassVar[int] = 5
    search_outputs: ClassVar[int] = 20

    def pipeline(self, seed: int) -> Any:  # noqa: ARG002
        from sklearn.kernel_ridge import KernelRidge as Ridge

        return scale_outputs(scaling_pipeline(Ridge(kernel="rbf")))
