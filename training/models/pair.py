"""The thesis's model in two steps: force over the contact's phase, and contact time (Fig. 4.9)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Self

import numpy as np

from ...array_types import Floats
from ...dataset.table import Inputs, PulseTable
from ..estimators.base import Arrays, Estimator, FitReport, Gaussian, require_fitted
from .base import (
    ContactModel,
    ContactPrediction,
    check_same_predictors,
    faintest_mean_force,
    get_array,
    momentum,
    own,
    positive_pulses,
    positive_times,
    prefixed,
    restored,
    spelled,
)
from .serialization import describe

#: Force (N) that counts as one (n,), given the inputs and the contact time predicted for them (n,).
Scaling = Callable[[Inputs, Floats], Floats]

#: "none" is the thesis's. With "momentum" the unit is the mean force that stops the impactor within
#: the predicted contact: soft tips push for 3 ms with 250 N, hard ones for 0.2 ms with 9 kN, and
#: one noise level in newtons drowns the soft.
SCALINGS: dict[str, Scaling] = {
    "none": lambda inputs, time: np.ones(len(inputs)),  # noqa: ARG005
    "momentum": lambda inputs, time: momentum(inputs) / time,
}


class Pair(ContactModel):
    """One regression for 20 points of force, one for contact time; each sees the predictors only.

    The scale is a function of what is known before the impact, so spreads pass through it as they
    are. A pulse pushes: where regressions say otherwise, `positive_times` and `positive_pulses`
    tell what is put in place.
    """

    kind = "pair"

    def __init__(self, force: Estimator, time: Estimator, scaling: str = "none") -> None:
        if scaling not in SCALINGS:
            raise ValueError(f"no scaling {scaling!r}; there are: {', '.join(SCALINGS)}")
        self.force = force
        self.time = time
        self.scaling = scaling

    force_: Estimator | None = None
    time_: Estimator | None = None

    def settings(self) -> dict[str, Any]:
        return {"force": describe(self.force), "time": describe(self.time), "scaling": self.scaling}

    def fit(self, pulses: PulseTable, rng: np.random.Generator) -> Self:
        return self._learn(pulses, rng, own(self.time).fit, own(self.force).fit)

    def refit(self, pulses: PulseTable, rng: np.random.Generator) -> Self:
        force, time = self._learned()
        return type(self)(self.force, self.time, self.scaling)._learn(
            pulses, rng, time.refit, force.refit
        )

    def relearn(self, pulses: PulseTable, rng: np.random.Generator) -> Self:
        force, time = self._learned()
        return type(self)(self.force, self.time, self.scaling)._learn(
            pulses, rng, time.relearn, force.relearn
        )

    def _learn(
        self,
        pulses: PulseTable,
        rng: np.random.Generator,
        learn_time: Callable[..., Estimator],
        learn_force: Callable[..., Estimator],
    ) -> Self:
        self._predictors = spelled(pulses.predictors)
        check_same_predictors(pulses, self._predictors)
        self._least = np.array([pulses.contact_time_s.min(), faintest_mean_force(pulses)])
        time_rng, force_rng = rng.spawn(2)
        self.time_ = learn_time(
            pulses.x, pulses.contact_time_s[:, None], pulses.configuration, time_rng
        )
        scale = self._scale(pulses, self._time(pulses, self.time_).mean[:, 0])
        self.force_ = learn_force(pulses.x, pulses.force_n / scale, pulses.configuration, force_rng)
        return self

    def predict(self, inputs: Inputs) -> ContactPrediction:
        force_regression, time_regression = self._learned()
        check_same_predictors(inputs, self._predictors)
        time = self._time(inputs, time_regression)
        scale = self._scale(inputs, time.mean[:, 0])
        force = force_regression.predict(inputs.x)
        return ContactPrediction(
            force_n=positive_pulses(force.mean * scale, self._least[1]),
            contact_time_s=time.mean[:, 0],
            force_spread_n=None if force.spread is None else force.spread * scale,
            contact_time_spread_s=None if time.spread is None else time.spread[:, 0],
        )

    def _time(self, inputs: Inputs, regression: Estimator) -> Gaussian:
        time = regression.predict(inputs.x)
        return Gaussian(positive_times(time.mean, self._least[0]), time.spread)

    def _scale(self, inputs: Inputs, time: Floats) -> Floats:
        return SCALINGS[self.scaling](inputs, time)[:, None]

    def fit_report(self) -> FitReport:
        force, time = self._learned()
        return force.fit_report().under("force").joined(time.fit_report().under("time"))

    def _learned(self) -> tuple[Estimator, Estimator]:
        return require_fitted(self.force_, self.kind), require_fitted(self.time_, self.kind)

    def arrays(self) -> Arrays:
        force, time = self._learned()
        return {
            "predictors": self._predictors,
            "least": self._least,
            **prefixed("force", force.arrays()),
            **prefixed("time", time.arrays()),
        }

    def restore(self, arrays: Arrays) -> Self:
        self._predictors = get_array(arrays, "predictors", self.kind)
        self._least = get_array(arrays, "least", self.kind)
        self.force_, self.time_ = (
            restored(self.force, "force", arrays),
            restored(self.time, "time", arrays),
        )
        return self
