"""What every regression promises.

Means and widths of columns, for regressions that want their inputs and outputs near one.

A regression whose learned state is a handful of plain arrays of declared shapes.

What they learned is small enough to evaluate here, so nothing on disk can carry code. Regressions
of scikit-learn are kept as its own objects (`scikit_pipeline`).

What a training searched and found, for the registry: settings as parameters, histories as metrics
by step.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..tuning.trials import SettingsSearch

#: A search for a process's parameters ends where its loss changes by less than this share of it.
USUAL_CHANGE = 1e-6
#: The same for a process that only calibrates the bands of another (`Estimator.relearn`), and the
#: rows on which it is tuned, as many as `SingleOutputs` takes. The predictions differ by a
#: twentieth of their spreads from those of a finer search.
RELEARNING_CHANGE, RELEARNING_ROWS = 1e-4, 480

#: A setting as MLflow keeps it: text and truth values as parameters, numbers as parameters and
#: figures.
SettingValue = str | bool | int | float


@dataclass(frozen=True)
class FitReport:
    """`settings` that were searched or learned, by name ("kernel", "noise", "layers",
    "regularisation").

    `by_predictor` are numbers of which there is one for each predictor ("lengthscale"), in the
    predictors' order. `histories` are values by step ("loss", "search_error"), the first step
    first. `searches` are the trials of a search for settings, by the part of the model that it was
    for; "" for the whole. Numbers are of standardised columns where the name does not say
    otherwise.
    """

    settings: Mapping[str, SettingValue] = field(default_factory=dict)
    by_predictor: Mapping[str, Sequence[float]] = field(default_factory=dict)
    histories: Mapping[str, Sequence[float]] = field(default_factory=dict)
    searches: Mapping[str, SettingsSearch] = field(default_factory=dict)

    def under(self, prefix: str) -> FitReport:
        """The same report with every name below a prefix ("force.kernel").

        Parameters:
            prefix: The name of a part of the model, such as "force".
        """
        return FitReport(
            {f"{prefix}.{name}": value for name, value in self.settings.items()},
            {f"{prefix}.{name}": values for name, values in self.by_predictor.items()},
            {f"{prefix}.{name}": values for name, values in self.histories.items()},
            {f"{prefix}.{name}".rstrip("."): search for name, search in self.searches.items()},
        )

    def joined(self, other: FitReport) -> FitReport:
        """Both reports in one.

        Parameters:
            other: The report that is added. Where both have a name, its value counts.
        """
        return FitReport(
            {**self.settings, **other.settings},
            {**self.by_predictor, **other.by_predictor},
            {**self.histories, **other.histories},
            {**self.searches, **other.searches},
        )

    def parameters(self, predictors: Sequence[str]) -> dict[str, SettingValue]:
        """All settings by name, those of each predictor below theirs
        ("force.lengthscale.tip_radius").

        Parameters:
            predictors: Names of the predictors, in the order in which the model learned from them.

        Raises:
            ValueError: Where a setting has another number of values than there are predictors.
        """
        parameters = dict(self.settings)
        for name, values in self.by_predictor.items():
            if len(values) != len(predictors):
                raise ValueError(
                    f"{name!r} has {len(values)} values for {len(predictors)} predictors"
                )
            pairs = zip(predictors, values, strict=True)
            parameters |= {f"{name}.{predictor}": float(value) for predictor, value in pairs}
        return parameters


#: Learned numbers by name and nothing else: written to disk, and read back without running any code
#: of the file's.
Arrays = dict[str, NDArray[Any]]


@dataclass(frozen=True, eq=False)
class Gaussian:
    """Mean and standard deviation of each output, n x m. `spread` is None where the regression has
    none of its own."""

    mean: Floats
    spread: Floats | None

    def take(self, rows: slice) -> Gaussian:
        """The same of some rows.

        Parameters:
            rows: The rows that are taken, as a slice.
        """
        return Gaussian(self.mean[rows], None if self.spread is None else self.spread[rows])


_Part = TypeVar("_Part")


class NotFittedError(ValueError):
    """A regression is asked before it has learned anything."""


def require_fitted(part: _Part | None, kind: str) -> _Part:
    """What a regression or model has learned.

    Parameters:
        part: What was learned; None where that is nothing yet.
        kind: What the regression or model is called in the message.

    Raises:
        NotFittedError: Where nothing was learned yet.
    """
    if part is None:
        raise NotFittedError(f"{kind!r} has learned nothing yet: call fit, or restore")
    return part


class Estimator(ABC):
    """Regression of m outputs on d predictors. The constructor keeps settings only; what `fit`
    learns ends in `_`.

    Standardisation of x and y is the estimator's own affair. The same data, settings and seed give
    the same numbers. The spread is a new measurement's: noise included.
    """

    #: Under which it is written and found again, unique in `estimators`.
    kind: ClassVar[str]
    #: A sentence for a person who chooses among models, of an estimator of another package.
    description: ClassVar[str] = ""

    @abstractmethod
    def fit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:
        """Learn outputs from predictors.

        Parameters:
            x: Values of the predictors (n, d).
            y: Values of the outputs (n, m).
            groups: The configuration (n,) of each row: inner cross-validation never parts one.
            rng: The generator of what is random in the training.

        Returns:
            The estimator itself.
        """

    @abstractmethod
    def predict(self, x: Floats) -> Gaussian:
        """Outputs for values of the predictors.

        Parameters:
            x: Values of the predictors (n, d).

        Returns:
            The mean and, where the regression has one, the standard deviation (n, m) of a new
            measurement.

        Raises:
            NotFittedError: Before `fit`.
        """

    def refit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:
        """A new estimator, learned from other rows with what this one tuned (kernel parameters,
        say) kept.

        Parameters:
            x: Values of the predictors (n, d).
            y: Values of the outputs (n, m).
            groups: The configuration (n,) of each row.
            rng: The generator of what is random in the training.
        """
        return type(self)(**self.settings()).fit(x, y, groups, rng)

    def relearn(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:
        """A new estimator, learned and tuned from other rows: it knows nothing of the rows left
        out. What only a long search finds (the size of a network, the form of a kernel) is kept.

        Parameters:
            x: Values of the predictors (n, d).
            y: Values of the outputs (n, m).
            groups: The configuration (n,) of each row.
            rng: The generator of what is random in the training.
        """
        return type(self)(**self.settings()).fit(x, y, groups, rng)

    def fit_report(self) -> FitReport:
        """What `fit` searched and found. Histories of the search are known after `fit` only, not
        after `restore`."""
        return FitReport()

    @abstractmethod
    def settings(self) -> dict[str, Any]:
        """The constructor's arguments, as JSON holds them."""

    @abstractmethod
    def arrays(self) -> Arrays:
        """Everything learned. Raises `NotFittedError` before `fit`."""

    @abstractmethod
    def restore(self, arrays: Arrays) -> Self:
        """Take over a learned state.

        Parameters:
            arrays: The state, as `arrays()` of a fitted estimator gives it.

        Returns:
            The estimator itself.

        Raises:
            ValueError: For arrays that are not of this kind.
        """


@dataclass(frozen=True, eq=False)
class Standard:
    """Columns to mean 0 and standard deviation 1. `mean` and `width` are (d,); width 0 is a column
    that never varied.

    Such a column always becomes 0, whatever is asked later: nothing was learned about it.
    """

    mean: Floats
    width: Floats

    @classmethod
    def of(cls, columns: Floats) -> Standard:
        """Mean and width of each column. Rounding makes the deviation of a constant tiny, not 0: it
        counts as constant.

        Parameters:
            columns: Values (n, d).
        """
        mean = columns.mean(axis=0)
        width = columns.std(axis=0)
        return cls(mean, np.where(width > 1e-12 * np.abs(mean), width, 0.0))

    def apply(self, columns: Floats) -> Floats:
        """Columns in standard deviations from their mean; a column that never varied becomes 0.

        Parameters:
            columns: Values (n, d), in the units of those that `of` was given.
        """
        return (columns - self.mean) / np.where(self.width > 0, self.width, np.inf)

    def undo(self, columns: Floats) -> Floats:
        """Columns in their own units again; a column that never varied becomes its mean.

        Parameters:
            columns: Values (n, d), as `apply` gives them.
        """
        return columns * self.width + self.mean


#: Lengths of an array's axes: a number, or a letter that stands for the same number in all arrays
#: of a regression.
Shape = tuple[int | str, ...]
#: Of `standard_arrays`.
STANDARDS: dict[str, Shape] = {
    "x_mean": ("d",),
    "x_width": ("d",),
    "y_mean": ("m",),
    "y_width": ("m",),
}


def standard_arrays(inputs: Standard, outputs: Standard) -> Arrays:
    """Means and widths under names that `standard_of` reads.

    Parameters:
        inputs: The standardisation of the predictors.
        outputs: The standardisation of the outputs.
    """
    return {
        "x_mean": inputs.mean,
        "x_width": inputs.width,
        "y_mean": outputs.mean,
        "y_width": outputs.width,
    }


def standard_of(arrays: Arrays, axis: str) -> Standard:
    """The standardisation of the predictors or the outputs.

    Parameters:
        arrays: Learned arrays, among them those of `standard_arrays`.
        axis: "x" for the predictors, "y" for the outputs.
    """
    return Standard(arrays[f"{axis}_mean"], arrays[f"{axis}_width"])


class LearnedArrays(Estimator):
    """Keeps what it learned in `learned_`, checked against `shapes` whether it comes from `fit` or
    from a file."""

    learned_: Arrays | None = None

    @abstractmethod
    def shapes(self) -> Mapping[str, Shape]:
        """Names and shapes of all learned arrays. The letter d is the number of predictors."""

    def settings(self) -> dict[str, Any]:
        return {}

    def arrays(self) -> Arrays:
        return dict(self._learned())

    def restore(self, arrays: Arrays) -> Self:
        """Take over a learned state that has the `shapes` of this kind.

        Parameters:
            arrays: The state, as `arrays()` of a fitted estimator gives it.

        Returns:
            The estimator itself.

        Raises:
            ValueError: For arrays of other names or shapes, and for numbers that are not finite.
        """
        self._check(arrays)
        self.learned_ = dict(arrays)
        return self

    def _check(self, arrays: Arrays) -> dict[str, int]:
        """Lengths by letter. Raises `ValueError` for arrays that are not of this kind; a leaf may
        ask for more."""
        shapes = self.shapes()
        if set(arrays) != set(shapes):
            raise ValueError(
                f"{self.kind!r} is restored from {_listed(shapes)}, not from {_listed(arrays)}"
            )
        lengths: dict[str, int] = {}
        for name, shape in shapes.items():
            array = arrays[name]
            if array.dtype.kind not in "if" or not np.all(np.isfinite(array)):
                raise ValueError(
                    f"{self.kind!r}: {name!r} must hold finite numbers, not {array.dtype}"
                )
            if not _fits(array.shape, shape, lengths):
                raise ValueError(
                    f"{self.kind!r}: {name!r} has the shape "
                    f"{array.shape}, not {shape} with {lengths}"
                )
        return lengths

    def _learned(self) -> Arrays:
        return require_fitted(self.learned_, self.kind)

    def _asked(self, x: Floats, predictors: int) -> Floats:
        """x as n x d float64. Raises `ValueError` for another number of predictors than learned."""
        inputs = np.asarray(x, dtype=np.float64)
        if inputs.ndim != 2 or inputs.shape[1] != predictors:
            raise ValueError(
                f"{self.kind!r} learned from {predictors} predictors; asked "
                f"with the shape {inputs.shape}"
            )
        return inputs


def _fits(found_shape: tuple[int, ...], shape: Shape, lengths: dict[str, int]) -> bool:
    if len(found_shape) != len(shape):
        return False
    return all(
        length == (expected if isinstance(expected, int) else lengths.setdefault(expected, length))
        for length, expected in zip(found_shape, shape, strict=True)
    )


def _listed(names: Mapping[str, object]) -> str:
    return ", ".join(sorted(names)) or "nothing"
