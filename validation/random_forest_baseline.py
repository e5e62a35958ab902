"""A random forest on residuals, trained on campaigns of other seeds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats
from .problem import GapProblem

#: Whitened mean residuals of every campaign are drawn out or drawn together to so many configurations by observables.
CONFIGURATIONS, OBSERVABLES = 12, 24
TREES = 300


@dataclass(frozen=True)
class Forest:
    """One classifier for each kind of campaign; `frequent` are the most frequent effects by stage, for a baseline."""

    by_kind: Mapping[str, Any]
    frequent: Mapping[str, str]

    @classmethod
    def trained(
        cls, kinds: Sequence[str], x: Sequence[Floats], y: Sequence[str], seed: int, trees: int = TREES
    ) -> Self:
        """From features and labels of campaigns. Raises `ModuleNotFoundError` without scikit-learn."""
        from sklearn.ensemble import RandomForestClassifier

        by_kind = {}
        for kind in sorted(set(kinds)):
            rows = [i for i, row_kind in enumerate(kinds) if row_kind == kind]
            forest = RandomForestClassifier(trees, min_samples_leaf=2, random_state=seed, n_jobs=1)
            by_kind[kind] = forest.fit(np.stack([x[i] for i in rows]), [y[i] for i in rows])
        return cls(by_kind, most_frequent(y))

    def answer(self, kind: str, problem: GapProblem) -> dict[str, float]:
        """Shares of trees by label; nothing for a kind that it was not trained on."""
        return self.shares(kind, features(problem))

    def shares(self, kind: str, x: Floats) -> dict[str, float]:
        """The same from features (F,)."""
        forest = self.by_kind.get(kind)
        if forest is None:
            return {}
        shares = forest.predict_proba(x[None])[0]
        return {str(label): float(p) for label, p in zip(forest.classes_, shares, strict=True)}


def features(problem: GapProblem) -> Floats:
    """(F,): for each stage of gun, contact and plate, residuals over their own standard errors and in tolerances.

    A table of configurations by observables is resampled to a fixed size, with its means and spreads beside it.
    """
    sigma = np.sqrt(np.diag(problem.noise))
    parts = [
        _table(problem, np.flatnonzero(problem.stage == stage), values)
        for stage in ("gun", "contact", "plate")
        for values in (problem.z / sigma, problem.z)
    ]
    return np.concatenate([np.arcsinh(part).ravel() for part in parts])


def most_frequent(labels: Sequence[str]) -> dict[str, str]:
    """By stage, the effect that was most often the cause, alone."""
    counts = Counter(label for label in labels if "." in label and "+" not in label)
    label_by_kind: dict[str, str] = {}
    for label, _ in sorted(counts.items(), key=lambda item: (-item[1], item[0])):
        label_by_kind.setdefault(label.split(".")[0], label)
    return label_by_kind


def _table(problem: GapProblem, cells: NDArray[np.intp], values: Floats) -> Floats:
    table = np.zeros((CONFIGURATIONS + 2, OBSERVABLES))
    if not cells.size:
        return table
    c, row = np.unique(problem.configuration[cells], return_inverse=True)
    o, column = np.unique(problem.observable[cells], return_inverse=True)
    full = np.zeros((len(c), len(o)))
    full[row, column] = values[cells]
    both = np.concatenate([_resampled(full, CONFIGURATIONS), full.mean(axis=0)[None], full.std(axis=0)[None]])
    return (
        _resampled(both.T, OBSERVABLES).T if len(o) > OBSERVABLES else np.pad(both, ((0, 0), (0, OBSERVABLES - len(o))))
    )


def _resampled(table: Floats, rows: int) -> Floats:
    """Rows interpolated at evenly spaced places."""
    place = np.linspace(0, len(table) - 1, rows)
    return np.stack([np.interp(place, np.arange(len(table)), column) for column in table.T], axis=1)
