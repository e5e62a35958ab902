"""A physical pulse, corrected by what measurements say it misses.

What the hybrid learns: how a pulse differs from a physical one, in numbers that may take any value.

Glossary: q(s) = sqrt(F(s) tau / P) root of the shape over the phase s in [0, 1], so that q^2
integrates to 1; tau contact time; P impulse, its share of the bound g / (1 + g) with log g the
logit. Outputs (n x 20): log tau less the base's, the logit, and q at the inner points less the
base's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from ...array_types import Floats
from ...dataset.table import POINTS, Inputs, PulseTable
from ..estimators.base import Arrays, Estimator, FitReport, require_fitted
from .analytic import Analytic
from .base import (
    MARGIN,
    WEIGHTS,
    ContactModel,
    ContactPrediction,
    check_same_predictors,
    correlation_with,
    faintest_mean_force,
    get_array,
    impulse,
    momentum,
    own,
    prefixed,
    propagate_spread,
    residual_correlation,
    restored,
    spelled,
)
from .serialization import describe
from .single_pass import default_process

_INNER = slice(1, POINTS - 1)

#: Beyond this an exponential leaves the numbers a pulse can have.
_MOST = 30.0


@dataclass(frozen=True, eq=False)
class ResidualPulse:
    """`root` (n x 20) as in the glossary, `bound_n_s`, `share` and `contact_time_s` (n,)."""

    root: Floats
    contact_time_s: Floats
    bound_n_s: Floats
    share: Floats

    @classmethod
    def of(cls, force_n: Floats, contact_time_s: Floats, bound_n_s: Floats) -> ResidualPulse:
        """Of a force (n x 20) that is nowhere negative."""
        whole = impulse(force_n, contact_time_s)
        root = np.sqrt(force_n * (contact_time_s / whole)[:, None])
        return cls(root, contact_time_s, bound_n_s, whole / bound_n_s)

    @property
    def mean_force_n(self) -> Floats:
        """n x 1: impulse over contact time."""
        return np.asarray((self.bound_n_s * self.share / self.contact_time_s)[:, None])

    @property
    def force_n(self) -> Floats:
        """n x 20. Its integral is `share` of the bound, whatever the roots add up to."""
        squares = self.root**2
        return np.asarray(self.mean_force_n * squares / (squares @ WEIGHTS)[:, None])


def measured_outputs(pulses: PulseTable, base: ResidualPulse) -> Floats:
    """n x 20; a measured force below zero is noise and counts as zero."""
    measured = ResidualPulse.of(
        np.maximum(pulses.force_n, 0.0), pulses.contact_time_s, base.bound_n_s
    )
    time = np.log(measured.contact_time_s / base.contact_time_s)
    logit = np.log(measured.share) - np.log1p(-measured.share)
    return np.column_stack([time, logit, (measured.root - base.root)[:, _INNER]])


def pulses_of(outputs: Floats, base: ResidualPulse) -> ResidualPulse:
    """The pulses of outputs (n x 20). Where a root would be negative everywhere, the base's shape
    stands."""
    root = np.zeros_like(base.root)
    root[:, _INNER] = np.maximum(base.root[:, _INNER] + outputs[:, 2:], 0.0)
    flat = (root**2) @ WEIGHTS < 1e-6
    root[flat, _INNER] = base.root[flat, _INNER]
    time, logit = np.clip(outputs[:, :2], -_MOST, _MOST).T
    return ResidualPulse(
        root, base.contact_time_s * np.exp(time), base.bound_n_s, 1.0 / (1.0 + np.exp(-logit))
    )


def end_noise(pulses: PulseTable) -> Floats:
    """Root mean square (2,) of the measured force at both ends, over the pulse's mean force."""
    ends = pulses.force_n[:, [0, -1]] / (pulses.force_n @ WEIGHTS)[:, None]
    return np.asarray(np.sqrt((ends * ends).mean(axis=0)))


def spreads_of(
    pulse: ResidualPulse, spread: Floats, correlation: Floats, ends: Floats
) -> tuple[Floats, Floats]:
    """Standard deviations of force (n x 20) and contact time (n,) from those of the outputs (n x
    20).

    To first order, and the second where the first vanishes: q^2 has the variance 4 q^2 v + 2 v^2, v
    that of q.
    """
    force = propagate_spread(_jacobian(pulse), spread, correlation)
    square = (pulse.root**2) @ WEIGHTS
    second = pulse.mean_force_n / square[:, None] * np.sqrt(2.0) * spread[:, 2:] ** 2
    force[:, _INNER] = np.hypot(force[:, _INNER], second)
    force[:, [0, -1]] = pulse.mean_force_n * ends
    return force, pulse.contact_time_s * spread[:, 0]


def log_correlation(pulse: ResidualPulse, spread: Floats, correlation: Floats) -> Floats:
    """Correlation (n,) of the logarithms of peak force and contact time, to first order."""
    peak = pulse.force_n.argmax(axis=1)
    at_peak = _jacobian(pulse)[np.arange(len(peak)), peak]
    return correlation_with(at_peak, spread, correlation, 0)


def _jacobian(pulse: ResidualPulse) -> Floats:
    """dF_i by the outputs (n x 20 x 20), with F_i = bound share q_i^2 / (tau Q) and Q the integral
    of q^2."""
    force = pulse.force_n
    square = ((pulse.root**2) @ WEIGHTS)[:, None]
    jacobian = np.empty((len(force), POINTS, POINTS))
    jacobian[:, :, 0] = -force
    jacobian[:, :, 1] = force * (1.0 - pulse.share)[:, None]
    inner = pulse.root[:, _INNER]
    jacobian[:, :, 2:] = -2.0 * force[:, :, None] * (WEIGHTS[_INNER] * inner / square)[:, None, :]
    points = np.arange(1, POINTS - 1)
    jacobian[:, points, points + 1] += 2.0 * pulse.mean_force_n * inner / square
    return jacobian


class Hybrid(ContactModel):
    """One coupled regression (as `SinglePass`'s) of what is left of `base`: of log contact time, of
    the logit of the impulse's share of its bound, and of the root of the pulse's shape at 18 inner
    points (see `residual`).

    Whatever the regression says: force is never negative and zero at both ends, the contact time is
    positive, and the impulse stays below 2 m u `allowance_`. Of one body of mass m that bounces off
    at rest at most, it would stay below 2 m u; measured ones do not always: a hand pushes behind a
    hammer, and the velocity, integrated from an acceleration over the contact alone, takes the
    target to be at rest. `allowance_` is the greatest impulse learned from over 2 m u with a margin
    of 5 %, and at least 1. 90 % bands may reach below zero: they are not cut off here.
    """

    kind = "hybrid"

    def __init__(self, base: ContactModel | None = None, process: Estimator | None = None) -> None:
        self.base = base or Analytic("hann")
        self.process = process or default_process()

    process_: Estimator | None = None
    base_: ContactModel
    allowance_: float

    def settings(self) -> dict[str, Any]:
        return {"base": describe(self.base), "process": describe(self.process)}

    def fit(self, pulses: PulseTable, rng: np.random.Generator) -> Self:
        return self._learn(pulses, rng, own(self.process).fit)

    def refit(self, pulses: PulseTable, rng: np.random.Generator) -> Self:
        return type(self)(self.base, self.process)._learn(pulses, rng, self._learned().refit)

    def relearn(self, pulses: PulseTable, rng: np.random.Generator) -> Self:
        return type(self)(self.base, self.process)._learn(pulses, rng, self._learned().relearn)

    def _learn(
        self, pulses: PulseTable, rng: np.random.Generator, learn: Callable[..., Estimator]
    ) -> Self:
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
        return require_fitted(self.process_, self.kind)

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
        self._predictors = get_array(arrays, "predictors", self.kind)
        self.allowance_ = float(get_array(arrays, "allowance", self.kind))
        self._correlation = get_array(arrays, "correlation", self.kind)
        self._end_noise = get_array(arrays, "end_noise", self.kind)
        self.base_ = restored(self.base, "base", arrays)
        self.process_ = restored(self.process, "process", arrays)
        return self
