"""What every contact model promises: inputs in, a pulse with its spread out."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from ...array_types import Floats
from ...dataset.table import Inputs, PulseTable
from ..estimators.base import Arrays
from ..fit_report import FitReport


@dataclass(frozen=True, eq=False)
class ContactPrediction:
    """Pulses of n impacts: force (n x 20) at equidistant points of the contact, ends included, and contact time (n,).

    The spreads are standard deviations of a new measurement (not of its mean); None where a law of physics gives none.
    The 90 % band is the mean plus and minus 1.645 spreads. `log_correlation` (n,) is that of the logarithms of peak
    force and contact time; None for a model that does not know it.
    """

    force_n: Floats
    contact_time_s: Floats
    force_spread_n: Floats | None
    contact_time_spread_s: Floats | None
    log_correlation: Floats | None = None


class ContactModel(ABC):
    """Force and contact time of impacts. The constructor keeps settings; what `fit` learns ends in `_`."""

    #: Under which it is written and found again, unique in `models`.
    kind: ClassVar[str]

    @abstractmethod
    def fit(self, pulses: PulseTable, rng: np.random.Generator) -> Self:
        """Learn from measured pulses. The same pulses, settings and seed give the same model."""

    @abstractmethod
    def predict(self, inputs: Inputs) -> ContactPrediction:
        """Pulses of impacts. Raises `NotFittedError` before `fit`, `ValueError` for other predictors than learned."""

    def refit(self, pulses: PulseTable, rng: np.random.Generator) -> Self:
        """A new one, learned from other pulses with what this one tuned kept; cheap where it can be."""
        return type(self)(**self.settings()).fit(pulses, rng)

    def fit_report(self) -> FitReport:
        """What `fit` searched and found, of all parts ("force.kernel", "time.noise")."""
        return FitReport()

    @abstractmethod
    def settings(self) -> dict[str, Any]:
        """The constructor's arguments as JSON holds them; an inner part is {"kind": ..., "settings": ...}."""

    @abstractmethod
    def arrays(self) -> Arrays:
        """Everything learned, by name ("force.alpha"). Raises `NotFittedError` before `fit`."""

    @abstractmethod
    def restore(self, arrays: Arrays) -> Self:
        """Learned state from `arrays()`; returns self."""
