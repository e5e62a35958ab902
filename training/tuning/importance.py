"""How much each setting of a search matters for the score of a trial."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...array_types import Floats
from .trials import Importance, SettingsSearch, TrialValue, search_from

#: Fewer trials than these, or than so many for each setting, say nothing of importance.
_LEAST_TRIALS, _LEAST_FOR_EACH = 12, 4
#: A forest that explains less of the trials that it has not seen says nothing of importance.
_LEAST_EXPLAINED = 0.2


def least_trials(settings: int) -> int:
    """So many trials are needed to judge the importance of so many settings."""
    return max(_LEAST_TRIALS, _LEAST_FOR_EACH * settings)


def importance_of(search: SettingsSearch) -> Importance | None:
    """Permutation importance of a random forest that predicts the score of a trial from its
    settings.

    Breiman, "Random forests", Machine Learning 45 (2001), as scikit-learn has it. The forest learns
    the logarithm of the score, so that a few very bad trials do not hide the others. None where the
    trials are too few, one setting alone was searched, or the forest explains less than a fifth of
    trials that it has not seen (out of its bags).
    """
    names = search.settings
    if len(names) < 2 or len(search.trials) < least_trials(len(names)):
        return None
    scores = np.array([trial.score for trial in search.trials])
    if scores.min() <= 0 or np.ptp(scores) == 0:
        return None
    from sklearn.ensemble import RandomForestRegressor
    from sklearn.inspection import permutation_importance

    x = np.column_stack(
        [
            _column(
                [trial.settings.get(name) for trial in search.trials],
                logarithmic=name in search.logarithmic,
            )
            for name in names
        ]
    )
    target = np.log(scores)
    forest = RandomForestRegressor(60, oob_score=True, random_state=0, n_jobs=1).fit(x, target)
    if not forest.oob_score_ >= _LEAST_EXPLAINED:
        return None
    means = permutation_importance(
        forest, x, target, n_repeats=5, random_state=0, n_jobs=1
    ).importances_mean
    sizes = np.clip(means, 0.0, None)
    if sizes.sum() == 0:
        return None
    pairs = sorted(
        zip(names, (sizes / sizes.sum()).tolist(), strict=True), key=lambda pair: -pair[1]
    )
    return Importance(dict(pairs), float(forest.oob_score_))


def _column(values: Sequence[TrialValue | None], *, logarithmic: bool) -> Floats:
    """A setting as numbers (trials,), NaN where a trial lacks it: words by their place in the
    alphabet, truth values as 0 and 1."""
    words = sorted({value for value in values if isinstance(value, str)})

    def number(value: TrialValue | None) -> float:
        if value is None:
            return math.nan
        if isinstance(value, str):
            return float(words.index(value))
        return math.log10(value) if logarithmic else float(value)

    return np.array([number(value) for value in values])


def with_importance(search: SettingsSearch) -> SettingsSearch:
    """The same search with the importance of its settings."""
    return replace(search, importance=importance_of(search))


def registered_searches(document: Mapping[str, Mapping[str, Any]]) -> dict[str, SettingsSearch]:
    """Searches by the part of the model that they were for ("force", "time"), with the importance
    of their settings, which is computed where older software registered the model. Raises as
    `search_from`."""
    searches = {}
    for name, text in document.items():
        search = search_from(text)
        searches[name] = search if "importance" in text else with_importance(search)
    return searches
