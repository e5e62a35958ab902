"""What every regression promises."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..fit_report import FitReport

#: Learned numbers by name and nothing else: written to disk, and read back without running any code of the file's.
Arrays = dict[str, NDArray[Any]]


@dataclass(frozen=True, eq=False)
class Gaussian:
    """Mean and standard deviation of each output, n x m. `spread` is None where the regression has none of its own."""

    mean: Floats
    spread: Floats | None

    def take(self, rows: slice) -> Gaussian:
        return Gaussian(self.mean[rows], None if self.spread is None else self.spread[rows])


class NotFittedError(ValueError):
    """A regression is asked before it has learned anything."""


class Estimator(ABC):
    """Regression of m outputs on d predictors. The constructor keeps settings only; what `fit` learns ends in `_`.

    Standardisation of x and y is the estimator's own affair. The same data, settings and seed give the same numbers.
    The spread is a new measurement's: noise included.
    """

    #: Under which it is written and found again, unique in `estimators`.
    kind: ClassVar[str]

    @abstractmethod
    def fit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:
        """Learn y (n x m) from x (n x d). `groups` (n,) are configurations: inner cross-validation never parts one."""

    @abstractmethod
    def predict(self, x: Floats) -> Gaussian:
        """Outputs at x (n x d). Raises `NotFittedError` before `fit`."""

    def refit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:
        """A new one, learned from other rows with what this one tuned (kernel parameters, say) kept."""
        return type(self)(**self.settings()).fit(x, y, groups, rng)

    def fit_report(self) -> FitReport:
        """What `fit` searched and found. Histories of the search are known after `fit` only, not after `restore`."""
        return FitReport()

    @abstractmethod
    def settings(self) -> dict[str, Any]:
        """The constructor's arguments, as JSON holds them."""

    @abstractmethod
    def arrays(self) -> Arrays:
        """Everything learned. Raises `NotFittedError` before `fit`."""

    @abstractmethod
    def restore(self, arrays: Arrays) -> Self:
        """Learned state from `arrays()`; returns self. Raises `ValueError` for arrays that are not of this kind."""
