"""The search of settings, on functions whose minimum is known."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import optuna
import pytest
from pyroshock.training.tuning.bayesian import BayesianResult, Between, OneOf, bayesian_minimum
from pyroshock.training.tuning.trials import Trial

SPACE = {"shape": OneOf(("round", "flat")), "width": Between(1e-3, 1e3)}


def bowl(settings: dict[str, Any]) -> float:
    """Least, 0, at a round one of width 10."""
    return math.log10(settings["width"] / 10) ** 2 + (settings["shape"] == "flat")


def searched(iterations: int = 25, **more: Any) -> BayesianResult:
    return bayesian_minimum(bowl, SPACE, iterations, np.random.default_rng(3), **more)


@cache
def found() -> BayesianResult:
    return searched()


def test_finds_known_minimum_and_beats_its_random_start() -> None:
    assert found().settings["shape"] == "round"
    assert found().settings["width"] == pytest.approx(10, rel=0.1)
    scores = [trial.score for trial in found().trials]
    assert found().value == min(scores) < min(scores[:10])
    assert all(trial.score == bowl(dict(trial.settings)) for trial in found().trials)
    assert all(
        trial.duration_s is not None and 0 <= trial.duration_s < 60 for trial in found().trials
    )
    assert searched(iterations=13) == searched(iterations=13)
    first = {"shape": "flat", "width": 0.1}
    assert searched(iterations=1, first=first) == BayesianResult(first, 5.0, (Trial(first, 5.0),))


def test_says_nothing_and_leaves_optuna_as_it_was(capfd: pytest.CaptureFixture[str]) -> None:
    before = optuna.logging.get_verbosity()
    searched(iterations=12)
    assert optuna.logging.get_verbosity() == before
    assert capfd.readouterr() == ("", "")


def test_refuses_what_is_no_search() -> None:
    with pytest.raises(ValueError, match="at least one iteration, got 0"):
        searched(iterations=0)
    with pytest.raises(ValueError, match="the objective is nan at"):
        bayesian_minimum(lambda _: math.nan, SPACE, 3, np.random.default_rng(0))
