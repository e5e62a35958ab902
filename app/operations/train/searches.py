"""Searches for settings: their trials on parallel axes, and how much each setting mattered."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ....training.tuning.importance import least_trials
from ...common.number_format import format_number

if TYPE_CHECKING:
    from ....training.estimators.base import SettingValue
    from ....training.tuning.trials import SettingsSearch, Trial, TrialValue

#: Part of a model that a search was for -> what it is called in a sentence.
PARTS = {"force": "the contact force", "time": "the contact time", "process": "the pulse"}
#: Setting of a search -> its axis. Settings have no unit: predictors and outputs are standardised
#: where nothing else is said.
_SETTINGS = {
    "kernel": "kernel",
    "ard": "a lengthscale for each predictor",
    "basis": "mean of the process",
    "standardise": "predictors standardised",
    "log_time": "logarithm of the time learned",
    "noise": "noise at the start of the fit",
    "gamma": "gamma of the kernel",
    "alpha": "ridge alpha",
    "cost": "cost C of an error",
    "components": "components",
    "hidden_layers": "hidden layers",
    "neurons_per_layer": "neurons of each hidden layer",
    "regularisation": "penalty lambda of the weights",
}
#: Trials by their score, the best first.
QUARTERS = ("best quarter of the trials", "second quarter", "third quarter", "worst quarter")
#: More values than these on a logarithmic axis are marked by decades.
_MOST_TICKS = 6
#: Share of an axis between two words on it.
_ROOM = 0.25


@dataclass(frozen=True)
class ParallelAxis:
    """One axis: its title, where each trial crosses it (0 to 1; None where the trial lacks it), and
    its ticks."""

    title: str
    places: tuple[float | None, ...]
    ticks: tuple[tuple[float, str], ...]


def setting_words(name: str) -> str:
    """What an axis calls a setting."""
    return _SETTINGS.get(name, name.replace("_", " "))


def trial_rows(search: SettingsSearch) -> list[dict[str, Any]]:
    """Every trial in a row, the best first: its number, its settings, its score and its duration
    (s)."""
    order = sorted(range(len(search.trials)), key=lambda index: search.trials[index].score)
    return [
        {
            "trial": index + 1,
            **{
                setting_words(name): _word(value)
                for name, value in search.trials[index].settings.items()
            },
            "score": search.trials[index].score,
            "duration_s": search.trials[index].duration_s,
        }
        for index in order
    ]


def searched_settings(searches: Mapping[str, SettingsSearch]) -> list[str]:
    """Names of the settings that searches chose, by part of the model: "force.gamma"."""
    return [
        f"{part}.{name}" if part else name
        for part, search in searches.items()
        for name in search.settings
    ]


def settings_rows(
    settings: Mapping[str, SettingValue], searches: Mapping[str, SettingsSearch]
) -> list[dict[str, Any]]:
    """The settings of a training, and which of them a search chose: the others are what the model
    has without a search, or what its fit found."""
    searched = searched_settings(searches)
    return [
        {
            "setting": name,
            "value": value,
            "chosen by": "a search" if name in searched else "no search",
        }
        for name, value in settings.items()
    ]


def part_words(name: str) -> str:
    """What a sentence calls the part of a model that was searched for."""
    return PARTS.get(name, name.replace(".", " ") or "the model")


def parallel_axes(search: SettingsSearch) -> list[ParallelAxis]:
    """An axis for each setting and, last, one for the score; the score's is logarithmic where the
    worst is more than three times the best."""
    axes = []
    for name in search.settings:
        values = [trial.settings.get(name) for trial in search.trials]
        axes.append(_axis(setting_words(name), values, logarithmic=name in search.logarithmic))
    scores: list[TrialValue | None] = [trial.score for trial in search.trials]
    lowest, highest = (end(trial.score for trial in search.trials) for end in (min, max))
    wide = lowest > 0 and highest > 3 * lowest
    return [*axes, _axis("score (low is good)", scores, logarithmic=wide)]


def _axis(title: str, values: Sequence[TrialValue | None], *, logarithmic: bool) -> ParallelAxis:
    numbers = [
        value for value in values if isinstance(value, int | float) and not isinstance(value, bool)
    ]
    if len(numbers) < sum(value is not None for value in values):
        return _axis_of_words(title, values)
    scale = math.log10 if logarithmic else float
    low, high = scale(min(numbers)), scale(max(numbers))

    def place(value: float) -> float:
        return 0.5 if high == low else (scale(value) - low) / (high - low)

    tried = sorted(set(numbers))
    ticks = tried
    if logarithmic and len(tried) > _MOST_TICKS and high - low >= 2:
        ticks = _decades(low, high)
    elif len(tried) > 1:
        ticks = _spaced(tried, place)
    words = title + (", log scale" if logarithmic else "")
    places = tuple(None if value is None else place(float(value)) for value in values)
    return ParallelAxis(
        words, places, tuple((place(tick), format_number(tick, 3)) for tick in ticks)
    )


def _decades(low: float, high: float) -> list[float]:
    """Powers of ten between two logarithms."""
    return [
        10.0**exponent for exponent in range(math.ceil(low - 1e-9), math.floor(high + 1e-9) + 1)
    ]


def _spaced(tried: Sequence[float], place: Callable[[float], float]) -> list[float]:
    """Of the values that were tried the ends, and between them those whose words have room beside
    each other."""
    ticks = [tried[0]]
    for value in tried[1:-1]:
        if place(value) - place(ticks[-1]) >= _ROOM and 1 - place(value) >= _ROOM:
            ticks.append(value)
    return [*ticks, tried[-1]]


def _axis_of_words(title: str, values: Sequence[TrialValue | None]) -> ParallelAxis:
    words = [None if value is None else _word(value) for value in values]
    levels = sorted({word for word in words if word is not None})
    at = {
        word: index / (len(levels) - 1) if len(levels) > 1 else 0.5
        for index, word in enumerate(levels)
    }
    places = tuple(None if word is None else at[word] for word in words)
    return ParallelAxis(title, places, tuple((at[word], word) for word in levels))


def _word(value: TrialValue) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return value if isinstance(value, str) else format_number(value, 3)


def quarters_of(search: SettingsSearch) -> tuple[int, ...]:
    """0 to 3 for each trial, by the rank of its score: 0 is the best quarter."""
    ranks = np.argsort(
        np.argsort([trial.score for trial in search.trials], kind="stable"), kind="stable"
    )
    return tuple(int(4 * rank // len(ranks)) for rank in ranks)


def trial_words(search: SettingsSearch, index: int) -> str:
    """`trial 7: gamma of the kernel: 0.02; ridge alpha: 0.1; score: 0.134; 0.2 s`."""
    trial = search.trials[index]
    took = "" if trial.duration_s is None else f"; {format_number(trial.duration_s, 2)} s"
    return (
        f"trial {index + 1}: {_settings_words(trial)}; score: {format_number(trial.score, 3)}{took}"
    )


def _settings_words(trial: Trial) -> str:
    return "; ".join(
        f"{setting_words(name)}: {_word(value)}" for name, value in trial.settings.items()
    )


def importance_sentence(search: SettingsSearch) -> str:
    """What the importance says and by which method, or why it cannot be judged."""
    trials, names, importance = len(search.trials), search.settings, search.importance
    if importance is not None:
        first = next(iter(importance.shares))
        return (
            f"What matters most is: {setting_words(first)} ({importance.shares[first]:.0%} of the "
            "importance). The importance of a setting is how much worse a random forest predicts "
            "the score of a trial when the values of that setting are shuffled (permutation "
            f"importance). The forest learned from {trials} trials, and explains "
            f"{importance.explained:.0%} of the differences between trials that it has not seen."
        )
    if len(names) < 2:
        return (
            f"Only one setting was searched ({setting_words(names[0])}), so that "
            f"there is no importance to compare."
        )
    needed = least_trials(len(names))
    if trials < needed:
        return (
            f"The importance of the settings cannot be judged: there are {trials} trials of "
            f"{len(names)} settings, and at least {needed} are needed."
        )
    return (
        f"The importance of the settings cannot be judged: a random forest on the {trials} trials "
        "does not predict the score of trials that it has not seen."
    )


def search_sentence(part: str, search: SettingsSearch) -> str:
    """How much was tried for which part, by which method, and which settings were the best."""
    best = search.best
    return (
        f"For {part_words(part)}, the {search.method} tried {len(search.trials)} combinations of "
        f"settings. The best has the score {format_number(best.score, 3)} ({search.score_name}). "
        f"Its settings are {_settings_words(best)}."
    )
