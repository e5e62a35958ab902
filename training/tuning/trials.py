"""What a search for settings has tried: the settings of each trial, its score and its duration.

A registry keeps it with the model as JSON, so that a reader sees which settings mattered.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

#: A value of a setting, as JSON holds it.
TrialValue = str | bool | int | float


@dataclass(frozen=True)
class Trial:
    """`settings` by name; `score` is what the search minimises; `duration_s` (s), None where nobody
    measured it.

    Trials are equal whatever time they took: the same search on a busy machine gives the same
    trials.
    """

    settings: Mapping[str, TrialValue]
    score: float
    duration_s: float | None = field(default=None, compare=False)


@dataclass(frozen=True)
class Importance:
    """How much each setting matters: shares that sum to 1, the largest first; and how well a forest
    explains trials that it has not seen (R²)."""

    shares: Mapping[str, float]
    explained: float


@dataclass(frozen=True)
class SettingsSearch:
    """Trials in their order. `method` and `score_name` are words: how settings were proposed, what
    the score is.

    `logarithmic` are the settings that the search spaces by their logarithm. `importance` is what
    the trials say of the settings; None where it was not judged, or cannot be.
    """

    method: str
    score_name: str
    trials: tuple[Trial, ...]
    logarithmic: tuple[str, ...] = ()
    importance: Importance | None = field(default=None, compare=False)

    @property
    def settings(self) -> tuple[str, ...]:
        """Names of the settings that were searched, in the order of the search."""
        return tuple(dict.fromkeys(name for trial in self.trials for name in trial.settings))

    @property
    def best(self) -> Trial:
        """The trial with the lowest score. Raises `ValueError` where nothing was tried."""
        return min(self.trials, key=lambda trial: trial.score)

    def as_json(self) -> dict[str, Any]:
        """For `search_from`."""
        return asdict(self)


def search_from(document: Mapping[str, Any]) -> SettingsSearch:
    """A search from what `as_json` made. Raises `TypeError`, `KeyError` for another document."""
    trials = tuple(Trial(**trial) for trial in document["trials"])
    importance = document.get("importance")
    return SettingsSearch(
        document["method"],
        document["score_name"],
        trials,
        tuple(document.get("logarithmic", ())),
        None if importance is None else Importance(**importance),
    )


def searches_from(document: Mapping[str, Mapping[str, Any]]) -> dict[str, SettingsSearch]:
    """Searches by the part of the model that they were for ("force", "time"). Raises as
    `search_from`."""
    return {name: search_from(search) for name, search in document.items()}


def plain_trials(
    settings: Sequence[Mapping[str, Any]],
    scores: Sequence[float],
    durations_s: Sequence[float | None],
) -> tuple[Trial, ...]:
    """Trials of settings that may be NumPy's numbers, which JSON does not know."""
    return tuple(
        Trial(
            {
                name: getattr(value, "item", lambda value=value: value)()
                for name, value in tried.items()
            },
            score,
            took,
        )
        for tried, score, took in zip(settings, scores, durations_s, strict=True)
    )
