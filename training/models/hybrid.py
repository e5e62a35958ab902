"""A physical pulse, corrected by what measurements say it misses."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Self

import numpy as np

from ...dataset.table import Inputs, PulseTable
from ..estimators.base import Arrays, Estimator, NotFittedError
from ..fit_report import FitReport
from .base import ContactModel, ContactPrediction
from .input_checks import check_same_predictors, momentum, spelled
from .model_kinds import describe
from .parts import own, prefixed, restored, taken
from .propagation import residual_correlation
from .pulses import faintest_mean_force, impulse
from .residual import ResidualPulse, end_noise, log_correlation, measured_outputs, pulses_of, spreads_of

#: The momentum bound lies this far above the greatest impulse measured.
MARGIN = 1.05


class Hybrid(ContactModel):
    """One coupled regression (as `SinglePass`'s) of what is left of `base`: of log contact time, of the logit of the
    impulse's share of its bound, and of the root of the pulse's shape at 18 inner points (see `residual`).

    Whatever the regression says: force is never negative and zero at both ends, the contact time is positive, and the
    impulse stays below 2 m u `allowance_`. Of one body of mass m that bounces off at rest at most, it would stay below
    2 m u; measured ones do not always: a hand pushes behind a hammer, and the velocity, integrated from an acceleration
    over the contact alone, takes the target to be at rest. `allowance_` is the greatest impulse learned from over 2 m u
    with a margin of 5 %, and at least 1. 90 % bands may reach below zero: they are not cut off here.
    """

    kind = "hybrid"

    def __init__(self, base: ContactModel | None = None, process: Estimator | None = None) -> None:
        self.base = base or _default_base()
        self.process = process or _default_process()

    process_: Estimator | None = None
    base_: ContactModel
    allowance_: float

    def settings(self) -> dict[str, Any]:
        return {"base": describe(self.base), "process": describe(self.process)}

    def fit(self, pulses: PulseTable, rng: np.random.Generator) -> Self:
        return self._learn(pulses, rng, own(self.process).fit)

    def refit(self, pulses: PulseTable, rng: np.random.Generator) -> Self:
        return type(self)(self.base, self.process)._learn(pulses, rng, self._learned().refit)

    def _learn(self, pulses: PulseTable, rng: np.random.Generator, learn: Callable[..., Estimator]) -> Self:
        self._predictors = spelled(pulses.predictors)
        check_same_predictors(pulses, self._predictors)
        faintest_mean_force(pulses)
        base_rng, process_rng = rng.spawn(2)
        self.base_ = own(self.base).fit(pulses, base_rng)
        measured = np.maximum(pulses.force_n, 0.0)
        share = impulse(measured, pulses.contact_time_s) / (2 * momentum(pulses))
        self.allowance_ = max(1.0, MARGIN * float(share.max()))
        outputs = measured_outputs(pulses, self._base_pulse(pulses))
        self.process_ = learn(pulses.x, outputs, pulses.configuration, process_rng)
        self._correlation = residual_correlation(outputs - self.process_.predict(pulses.x).mean)
        self._end_noise = end_noise(pulses)
        return self

    def predict(self, inputs: Inputs) -> ContactPrediction:
        process = self._learned()
        check_same_predictors(inputs, self._predictors)
        base, outputs = self._base_pulse(inputs), process.predict(inputs.x)
        pulse = pulses_of(outputs.mean, base)
        if outputs.spread is None:
            return ContactPrediction(pulse.force_n, pulse.contact_time_s, None, None)
        spreads = spreads_of(pulse, outputs.spread, self._correlation, self._end_noise)
        together = log_correlation(pulse, outputs.spread, self._correlation)
        return ContactPrediction(pulse.force_n, pulse.contact_time_s, *spreads, together)

    def _base_pulse(self, inputs: Inputs) -> ResidualPulse:
        nominal = self.base_.predict(inputs)
        bound = 2 * momentum(inputs) * self.allowance_
        return ResidualPulse.of(np.maximum(nominal.force_n, 0.0), nominal.contact_time_s, bound)

    def fit_report(self) -> FitReport:
        return self._learned().fit_report().under("process")

    def _learned(self) -> Estimator:
        if self.process_ is None:
            raise NotFittedError(f"{self.kind!r} has learned nothing yet: call fit, or restore")
        return self.process_

    def arrays(self) -> Arrays:
        return {
            **prefixed("process", self._learned().arrays()),
            **prefixed("base", self.base_.arrays()),
            "predictors": self._predictors,
            "allowance": np.array(self.allowance_),
            "correlation": self._correlation,
            "end_noise": self._end_noise,
        }

    def restore(self, arrays: Arrays) -> Self:
        self._predictors = taken(arrays, "predictors", self.kind)
        self.allowance_ = float(taken(arrays, "allowance", self.kind))
        self._correlation = taken(arrays, "correlation", self.kind)
        self._end_noise = taken(arrays, "end_noise", self.kind)
        self.base_ = restored(self.base, "base", arrays)
        self.process_ = restored(self.process, "process", arrays)
        return self


def _default_base() -> ContactModel:
    from .analytic import Analytic

    return Analytic("hann")


def _default_process() -> Estimator:
    from ..estimators.rotated_outputs import Turned
    from ..estimators.single_outputs import SingleOutputs

    return Turned(SingleOutputs())
