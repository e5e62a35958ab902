"""Simple ways of answering, which the diagnosis has to beat: a problem in, a probability for each
label out.

A random forest on residuals, trained on campaigns of other seeds.

A campaign as the simple ways of answering see it: arrays, in tolerances.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats
from ..diagnosis.gap import GapTable
from ..diagnosis.inference.effect_laws import EffectLaw
from ..diagnosis.inference.problem import InferenceProblem, StageBlock
from ..diagnosis.verdict import NONE

#: Places of each parameter of a law with so many parameters; a law with more has the last.
_PLACES = (9, 5, 3)


@dataclass(frozen=True, eq=False)
class GapProblem:
    """N cells: means of a configuration's residuals in one observable.

    `z` (N,) the gap, `noise` (N, N) its covariance from repetitions and uncertain nominal
    parameters, with what no simulator is better than; `stage`, `configuration` and `observable` of
    each. `changes` by effect: (M, N), what it does at M places of its parameters; `parameters` how
    many it has (the most of its laws).
    """

    z: Floats
    noise: Floats
    stage: NDArray[np.str_]
    configuration: NDArray[np.intp]
    observable: NDArray[np.intp]
    changes: Mapping[str, Floats]
    parameters: Mapping[str, int]

    @classmethod
    def of(cls, gap: GapTable, inference: InferenceProblem | None = None) -> Self:
        """Without `inference` no effect is simulated, and `changes` is empty."""
        from scipy.linalg import block_diag

        blocks = (
            inference.blocks
            if inference is not None
            else [StageBlock.of(gap, name) for name in gap.stages]
        )
        laws = () if inference is None else tuple(law for law in inference.laws if not law.levels)
        return cls(
            np.concatenate([block.z for block in blocks]),
            block_diag(*(block.covariances[0] for block in blocks)),
            np.concatenate([np.full(len(block.z), block.stage) for block in blocks]),
            np.concatenate([block.configuration for block in blocks]),
            np.concatenate([block.observable for block in blocks]),
            {} if inference is None else _changes(inference, laws),
            {
                name: max(law.size for law in laws if law.id == name)
                for name in dict.fromkeys(law.id for law in laws)
            },
        )


def _changes(inference: InferenceProblem, laws: Sequence[EffectLaw]) -> dict[str, Floats]:
    """Places without an answer are left out, and so is an effect that has none."""
    points = [((law, u),) for law in laws for u in _prior_grid(law.size)]
    table = np.concatenate(inference.changes(points), axis=1)
    effects = np.array([law.id for ((law, _),) in points])
    answered = np.isfinite(table).all(axis=1)
    return {
        str(name): table[answered & (effects == name)] for name in dict.fromkeys(effects[answered])
    }


def _prior_grid(count: int) -> Floats:
    """(M, `count`): a grid that is even in the prior's probability."""
    from scipy.special import ndtri

    places = _PLACES[min(count, len(_PLACES)) - 1]
    middles = ndtri((np.arange(places) + 0.5) / places)
    return np.array(list(product(middles, repeat=count)))


Answering = Callable[[GapProblem], dict[str, float]]

#: Shares of "none" and of all effects together before any evidence, as the diagnosis has them,
#: without the rest.
_NONE, _EFFECTS = 2 / 7, 5 / 7
#: Added to variances, in tolerances squared, as the diagnosis does: no mean is known better than to
#: a hundredth.
_LEAST = 1e-4


def noise_only(problem: GapProblem) -> dict[str, float]:
    """Evidence with the scatter of repetitions alone: no background, no unknown. All places equally
    likely."""
    from scipy.special import logsumexp

    none, logs = _log_likelihoods(problem)
    share = _EFFECTS / max(1, len(logs))
    joint = {
        name: float(logsumexp(places) - np.log(len(places)) + np.log(share))
        for name, places in logs.items()
    }
    return _normalised({NONE: none + np.log(_NONE), **joint})


def bic(problem: GapProblem) -> dict[str, float]:
    """exp(-BIC / 2) of each effect at its best place: Schwarz, Ann. Stat. 6 (1978) 461."""
    none, logs = _log_likelihoods(problem)
    cost = 0.5 * np.log(len(problem.z))
    best = {
        name: float(places.max() - cost * problem.parameters[name]) for name, places in logs.items()
    }
    return _normalised({NONE: none, **best})


def largest_residual(
    problem: GapProblem, frequent: Mapping[str, str] | None = None
) -> dict[str, float]:
    """Names the most frequent effect of the stage whose gap is the largest in tolerances, or none
    within tolerance.

    `frequent` by stage; by default the first effect of the stage that the campaign can show.
    """
    sizes = {
        name: float(np.sqrt(np.mean(problem.z[problem.stage == name] ** 2)))
        for name in set(problem.stage)
    }
    worst = max(sizes, key=lambda name: sizes[name])
    if sizes[worst] <= 1.0:
        return {NONE: 1.0}
    named = (frequent or {}).get(worst) or next(
        (n for n in problem.changes if n.startswith(f"{worst}.")), None
    )
    return {named or next(iter(problem.changes), NONE): 1.0}


BASELINES: Mapping[str, Answering] = {
    "noise-only evidence": noise_only,
    "BIC": bic,
    "largest residual": largest_residual,
}


def _log_likelihoods(problem: GapProblem) -> tuple[float, dict[str, Floats]]:
    """Of none, and (M,) of each effect; without the constant that all share."""
    from scipy.linalg import cholesky, solve_triangular

    lower = cholesky(problem.noise + _LEAST * np.eye(len(problem.z)), lower=True)
    z = solve_triangular(lower, problem.z, lower=True)
    logs = {}
    for name, changes in problem.changes.items():
        misfit = z[:, None] - solve_triangular(lower, changes.T, lower=True)
        logs[name] = np.asarray(-0.5 * np.einsum("nm,nm->m", misfit, misfit))
    return float(-0.5 * z @ z), logs


def _normalised(joint: dict[str, float]) -> dict[str, float]:
    logs = np.array(list(joint.values()))
    weights = np.exp(logs - logs.max())
    return dict(zip(joint, (weights / weights.sum()).tolist(), strict=True))


#: Whitened mean residuals of every campaign are drawn out or drawn together to so many
#: configurations by observables.
CONFIGURATIONS, OBSERVABLES = 12, 24
TREES = 300


@dataclass(frozen=True)
class Forest:
    """One classifier for each kind of campaign; `frequent` are the most frequent effects by stage,
    for a baseline."""

    by_kind: Mapping[str, Any]
    frequent: Mapping[str, str]

    @classmethod
    def trained(
        cls,
        kinds: Sequence[str],
        x: Sequence[Floats],
        y: Sequence[str],
        seed: int,
        trees: int = TREES,
    ) -> Self:
        """From features and labels of campaigns. Raises `ModuleNotFoundError` without
        scikit-learn."""
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
    """(F,): for each stage of gun, contact and plate, residuals over their own standard errors and
    in tolerances.

    A table of configurations by observables is resampled to a fixed size, with its means and
    spreads beside it.
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
    both = np.concatenate(
        [_resampled(full, CONFIGURATIONS), full.mean(axis=0)[None], full.std(axis=0)[None]]
    )
    if len(o) > OBSERVABLES:
        return _resampled(both.T, OBSERVABLES).T
    return np.pad(both, ((0, 0), (0, OBSERVABLES - len(o))))


def _resampled(table: Floats, rows: int) -> Floats:
    """Rows interpolated at evenly spaced places."""
    place = np.linspace(0, len(table) - 1, rows)
    return np.stack([np.interp(place, np.arange(len(table)), column) for column in table.T], axis=1)
