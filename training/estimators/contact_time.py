"""The thesis's Gaussian process for contact time, its settings found by Bayesian optimisation
(section 4.4)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..gp.maximise import one_core
from ..tuning.bayesian import Between, OneOf, Space, bayesian_minimum
from ..tuning.folds import grouped_folds
from ..tuning.trials import SettingsSearch, Trial
from .base import RELEARNING_CHANGE, Arrays, FitReport, Gaussian, LearnedArrays, Shape
from .exact_process import ProcessSolution, fitted, left_out_error

#: What is searched. `noise` is where the likelihood starts (a tenth of it is the least), relative
#: to the output's deviation; `basis` is the mean's; without `standardise` the predictors' own units
#: weigh them. What a model learned is stored as a position in these lists: append only.
SPACE: Space = {
    "kernel": OneOf(("rbf", "matern32", "matern52", "rational-quadratic")),
    "ard": OneOf((True, False)),
    "basis": OneOf(("zero", "constant", "linear")),
    "standardise": OneOf((True, False)),
    "log_time": OneOf((True, False)),
    "noise": Between(1e-2, 0.5),
}

#: Table 4.6's: exponential quadratic with one lengthscale, nothing searched.
THESIS: Mapping[str, Any] = {
    "kernel": "rbf",
    "ard": False,
    "basis": "constant",
    "standardise": True,
    "log_time": False,
    "noise": 0.1,
}


class ContactTimeProcess(LearnedArrays):
    """One positive output (n x 1). `iterations` settings are tried, each by one fit of its
    likelihood on at most `search_rows` random rows and the grouped `folds`-fold error of eq. 4.7
    there. The best is fitted to `fit_rows` and predicts from all.

    `choice` fixes some settings (all of `THESIS`: no search). `tuned` is another's `tuned_`:
    nothing is searched or fitted, only solved. The spread of a logarithm is taken to first order:
    the time times its deviation.
    """

    kind = "contact-time"

    def __init__(
        self,
        iterations: int = 30,
        choice: Mapping[str, Any] | None = None,
        tuned: Mapping[str, Any] | None = None,
        search_rows: int = 480,
        folds: int = 5,
        fit_rows: int = 1440,
    ) -> None:
        unknown = set(choice or {}) - set(SPACE)
        if unknown:
            raise ValueError(
                f"no setting {', '.join(sorted(unknown))}; there are: {', '.join(SPACE)}"
            )
        self.iterations = iterations
        self.choice = dict(choice or {})
        self.tuned = None if tuned is None else dict(tuned)
        self.search_rows = search_rows
        self.folds = folds
        self.fit_rows = fit_rows

    _solution: ProcessSolution

    #: What was found, as JSON holds it: the settings, `lengthscales`, `signal`, `noise_level` and
    #: the search's `error`.
    tuned_: dict[str, Any] | None = None
    #: The settings that were tried with their errors, and losses of the last fit, in turn; not kept
    #: in `arrays`.
    search_: SettingsSearch | None = None
    losses_: list[float] | None = None

    def settings(self) -> dict[str, Any]:
        return {
            "iterations": self.iterations,
            "choice": dict(self.choice),
            "tuned": None if self.tuned is None else dict(self.tuned),
            "search_rows": self.search_rows,
            "folds": self.folds,
            "fit_rows": self.fit_rows,
        }

    def shapes(self) -> Mapping[str, Shape]:
        return {
            "x": ("n", "d"),
            "y": ("n", 1),
            "settings": (len(SPACE) - 1,),
            "lengthscales": ("d",),
            "signal": (),
            "noise": (),
            "noise_level": (),
            "error": (),
        }

    def fit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:
        if y.ndim != 2 or y.shape[1] != 1:
            raise ValueError(f"{self.kind!r} learns one output (n x 1), got the shape {y.shape}")
        tuned = self.tuned
        if tuned is None:
            with one_core():
                choice, error = self._searched(x, y, groups, rng)
                rows = np.sort(rng.permutation(len(x))[: self.fit_rows])
                start_settings = None
                if len(rows) > self.search_rows:  # steps on few rows cost little, and most are far
                    coarse_rows = rows[:: math.ceil(len(rows) / self.search_rows)]
                    coarse_parameters, _ = fitted(x[coarse_rows], y[coarse_rows], choice, 30)
                    start_settings = {**choice, **coarse_parameters}
                parameters, self.losses_ = fitted(x[rows], y[rows], choice, 30, start_settings)
                tuned = {**choice, **parameters, "error": error}
        return self.restore(_as_arrays(x, y, tuned))

    def refit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:  # noqa: ARG002
        return type(self)(**self.settings()).restore(_as_arrays(x, y, self._tuned()))

    def relearn(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:  # noqa: ARG002
        """Keeps the settings. The kernel's parameters are fitted to `search_rows` from those that
        were learned: what comes of it differs little from a fit to all rows."""
        tuned = self._tuned()
        choice = {name: tuned[name] for name in SPACE}
        start: Mapping[str, Any] | None = tuned
        if choice["log_time"] and not np.all(y > 0):
            choice["log_time"], start = False, None
        with one_core():
            rows = np.sort(rng.permutation(len(x))[: self.search_rows])
            parameters, _ = fitted(x[rows], y[rows], choice, 30, start, RELEARNING_CHANGE)
        return type(self)(**self.settings()).restore(
            _as_arrays(x, y, {**choice, **parameters, "error": tuned["error"]})
        )

    def _tuned(self) -> dict[str, Any]:
        self._learned()
        assert self.tuned_ is not None
        return self.tuned_

    def restore(self, arrays: Arrays) -> Self:
        super().restore(arrays)
        self.tuned_ = _as_tuned(arrays)
        with one_core():
            self._solution = ProcessSolution(arrays["x"], arrays["y"], self.tuned_)
        return self

    def predict(self, x: Floats) -> Gaussian:
        learned = self._learned()
        return self._solution.at(self._asked(x, learned["x"].shape[1]))

    def _check(self, arrays: Arrays) -> dict[str, int]:
        lengths = super()._check(arrays)
        choices = [values.values for values in SPACE.values() if isinstance(values, OneOf)]
        if any(
            not 0 <= at < len(values)
            for at, values in zip(arrays["settings"], choices, strict=True)
        ):
            raise ValueError(
                f"{self.kind!r}: settings {arrays['settings']} are not "
                f"positions in the lists it searches"
            )
        return lengths

    def _searched(
        self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator
    ) -> tuple[dict[str, Any], float]:
        """The best settings, and their error on rows left out."""
        rows = np.sort(rng.permutation(len(x))[: self.search_rows])
        folds = grouped_folds(groups[rows], self.folds, rng)
        fixed = self.choice if np.all(y > 0) else {**self.choice, "log_time": False}
        space = {name: values for name, values in SPACE.items() if name not in fixed}

        def error_of(settings: dict[str, Any]) -> float:
            return left_out_error(x[rows], y[rows], {**fixed, **settings}, folds)

        if not space:
            error = error_of({})
            self.search_ = _search_of((Trial({}, error),))
            return dict(fixed), error
        first = {name: THESIS[name] for name in space}
        minimum = bayesian_minimum(error_of, space, self.iterations, rng, first)
        self.search_ = _search_of(minimum.trials)
        return {**fixed, **minimum.settings}, minimum.value

    def fit_report(self) -> FitReport:
        tuned = self._tuned()
        settings = {name: tuned[name] for name in SPACE}
        own_scales = tuned["lengthscales"] if tuned["ard"] else tuned["lengthscales"][:1]
        learned = {
            "signal": tuned["signal"],
            "noise_level": tuned["noise_level"],
            "best_search_error": tuned["error"],
        }
        common = {} if tuned["ard"] else {"lengthscale": float(own_scales[0])}
        trials = () if self.search_ is None else self.search_.trials
        histories = {"search_error": [trial.score for trial in trials], "loss": self.losses_ or []}
        return FitReport(
            {**settings, **learned, **common, "search_iterations": self.iterations},
            {"lengthscale": list(own_scales)} if tuned["ard"] else {},
            {name: history for name, history in histories.items() if history},
            {"": self.search_} if self.search_ is not None and self.search_.settings else {},
        )


def _search_of(trials: tuple[Trial, ...]) -> SettingsSearch:
    logarithmic = tuple(name for name, setting in SPACE.items() if isinstance(setting, Between))
    return SettingsSearch(
        "Bayesian optimisation", "mean relative error of left-out rows", trials, logarithmic
    )


def _as_arrays(x: Floats, y: Floats, tuned: Mapping[str, Any]) -> Arrays:
    positions = [
        values.values.index(tuned[name])
        for name, values in SPACE.items()
        if isinstance(values, OneOf)
    ]
    numbers = {name: np.array(tuned[name], dtype=np.float64) for name in _NUMBERS}
    return {
        "x": x.copy(),
        "y": y.copy(),
        "settings": np.array(positions, dtype=np.int64),
        **numbers,
    }


_NUMBERS = ("lengthscales", "signal", "noise", "noise_level", "error")


def _as_tuned(arrays: Arrays) -> dict[str, Any]:
    names = [(name, values.values) for name, values in SPACE.items() if isinstance(values, OneOf)]
    settings = {
        name: values[int(at)] for (name, values), at in zip(names, arrays["settings"], strict=True)
    }
    return {**settings, **{name: arrays[name].tolist() for name in _NUMBERS}}
