"""Settings by Bayesian optimisation: the thesis's way to tune the process for contact time (section
4.4)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from .trials import Trial


@dataclass(frozen=True)
class OneOf:
    """A setting without order."""

    values: tuple[Any, ...]


@dataclass(frozen=True)
class Between:
    """A positive number, searched by its logarithm."""

    low: float
    high: float


Space = Mapping[str, OneOf | Between]


@dataclass(frozen=True)
class BayesianResult:
    """The best settings and what the objective gave there; `trials` are all that was tried, in
    their order."""

    settings: dict[str, Any]
    value: float
    trials: tuple[Trial, ...]


def bayesian_minimum(
    objective: Callable[[dict[str, Any]], float],
    space: Space,
    iterations: int,
    rng: np.random.Generator,
    first: Mapping[str, Any] | None = None,
) -> BayesianResult:
    """The best of `iterations` settings: `first` if given, ten at random, then those Optuna's
    `GPSampler` proposes.

    Raises `ValueError` for no iterations, and where the objective is not finite (with the
    settings).
    """
    if iterations < 1:
        raise ValueError(f"a search takes at least one iteration, got {iterations}")
    import optuna

    # Brings a BLAS of its own, which is limited only where it is loaded.
    import scipy.linalg  # noqa: F401
    import torch  # noqa: F401 - the sampler's: loaded here, so that its threads are limited too
    from threadpoolctl import threadpool_limits

    with (
        _quiet(),
        threadpool_limits(1),
    ):  # the same sums, and so the same search, whatever else runs
        sampler = optuna.samplers.GPSampler(seed=int(rng.integers(2**31)))
        study = optuna.create_study(sampler=sampler)
        if first is not None:
            study.enqueue_trial(dict(first))
        study.optimize(
            lambda trial: _finite(objective, _proposed(trial, space)), n_trials=iterations
        )
    return BayesianResult(dict(study.best_params), float(study.best_value), _trials(study))


def _trials(study: Any) -> tuple[Trial, ...]:
    ended = [trial for trial in study.trials if trial.value is not None]
    return tuple(
        Trial(dict(trial.params), float(trial.value), trial.duration.total_seconds())
        for trial in ended
    )


def _proposed(trial: Any, space: Space) -> dict[str, Any]:
    return {
        name: trial.suggest_categorical(name, setting.values)
        if isinstance(setting, OneOf)
        else trial.suggest_float(name, setting.low, setting.high, log=True)
        for name, setting in space.items()
    }


def _finite(objective: Callable[[dict[str, Any]], float], settings: dict[str, Any]) -> float:
    value = float(objective(settings))
    if not math.isfinite(value):
        raise ValueError(
            f"the objective is {value} at {settings}: return a large number for what cannot be used"
        )
    return value


@contextmanager
def _quiet() -> Iterator[None]:
    """Optuna logs each trial and each missing extra; its level is its own again afterwards."""
    import optuna

    before = optuna.logging.get_verbosity()
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    try:
        yield
    finally:
        optuna.logging.set_verbosity(before)
