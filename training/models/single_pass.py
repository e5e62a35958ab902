"""Force and contact time in one pass: 21 coupled outputs (the thesis's outlook)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Self

import numpy as np

from ...array_types import Floats
from ...dataset.table import POINTS, Inputs, PulseTable
from ..estimators.base import Arrays, Estimator, FitReport, require_fitted
from .base import (
    ContactModel,
    ContactPrediction,
    check_same_predictors,
    faintest_mean_force,
    get_array,
    momentum,
    own,
    positive_pulses,
    prefixed,
    propagate_spread,
    residual_correlation,
    restored,
    spelled,
)
from .serialization import describe

#: Beyond this a logarithm is no contact time's.
_MOST = 30.0


class SinglePass(ContactModel):
    """One coupled regression of F tau / (m u) at 20 points and log tau, all near one; F force, tau
    contact time.

    The default regression is a linear model of coregionalisation: independent Gaussian processes,
    each with lengthscales of its own, of which every output is a mixture (`RotatedOutputs`). On
    unseen treatments it errs less than one process with common lengthscales. A pulse that lasts
    longer pushes less: the correlation of force and time that training leaves over narrows the
    force's spread.
    """

    kind = "single-pass"

    def __init__(self, process: Estimator | None = None) -> None:
        self.process = process or default_process()

    process_: Estimator | None = None

    def settings(self) -> dict[str, Any]:
        return {"process": describe(self.process)}

    def fit(self, pulses: PulseTable, rng: np.random.Generator) -> Self:
        return self._learn(pulses, rng, own(self.process).fit)

    def refit(self, pulses: PulseTable, rng: np.random.Generator) -> Self:
        return type(self)(self.process)._learn(pulses, rng, self._learned().refit)

    def relearn(self, pulses: PulseTable, rng: np.random.Generator) -> Self:
        return type(self)(self.process)._learn(pulses, rng, self._learned().relearn)

    def _learn(
        self, pulses: PulseTable, rng: np.random.Generator, learn: Callable[..., Estimator]
    ) -> Self:
        self._predictors = spelled(pulses.predictors)
        check_same_predictors(pulses, self._predictors)
        self._faintest = np.array(faintest_mean_force(pulses))
        outputs = _outputs(pulses)
        self.process_ = learn(pulses.x, outputs, pulses.configuration, rng)
        self._correlation = residual_correlation(outputs - self.process_.predict(pulses.x).mean)
        return self

    def predict(self, inputs: Inputs) -> ContactPrediction:
        process = self._learned()
        check_same_predictors(inputs, self._predictors)
        outputs = process.predict(inputs.x)
        time = np.exp(np.clip(outputs.mean[:, POINTS], -_MOST, _MOST))
        scale = (momentum(inputs) / time)[:, None]
        force = outputs.mean[:, :POINTS] * scale
        return ContactPrediction(
            force_n=positive_pulses(force, float(self._faintest)),
            contact_time_s=time,
            force_spread_n=self._force_spread(force, scale, outputs.spread)
            if outputs.spread is not None
            else None,
            contact_time_spread_s=time * outputs.spread[:, POINTS]
            if outputs.spread is not None
            else None,
        )

    def _force_spread(self, force: Floats, scale: Floats, spread: Floats) -> Floats:
        """F = y (m u) exp(-log tau): dF = scale dy - F dlog tau."""
        jacobian = np.zeros((len(force), POINTS, POINTS + 1))
        points = np.arange(POINTS)
        jacobian[:, points, points] = scale
        jacobian[:, :, POINTS] = -force
        return propagate_spread(jacobian, spread, self._correlation)

    def fit_report(self) -> FitReport:
        return self._learned().fit_report().under("process")

    def _learned(self) -> Estimator:
        return require_fitted(self.process_, self.kind)

    def arrays(self) -> Arrays:
        return {
            **prefixed("process", self._learned().arrays()),
            "predictors": self._predictors,
            "faintest": self._faintest,
            "correlation": self._correlation,
        }

    def restore(self, arrays: Arrays) -> Self:
        self._predictors = get_array(arrays, "predictors", self.kind)
        self._faintest = get_array(arrays, "faintest", self.kind)
        self._correlation = get_array(arrays, "correlation", self.kind)
        self.process_ = restored(self.process, "process", arrays)
        return self


def _outputs(pulses: PulseTable) -> Floats:
    """n x 21, without unit."""
    scaled = pulses.force_n * (pulses.contact_time_s / momentum(pulses))[:, None]
    return np.column_stack([scaled, np.log(pulses.contact_time_s)])


def default_process() -> Estimator:
    """The linear model of coregionalisation of `SinglePass` and `Hybrid`."""
    from ..estimators.rotated_outputs import RotatedOutputs
    from ..estimators.single_outputs import SingleOutputs

    return RotatedOutputs(SingleOutputs())
