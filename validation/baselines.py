"""Simple ways of answering, which the diagnosis has to beat: a problem in, a probability for each label out."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ..array_types import Floats
from ..diagnosis.verdict import NONE
from .problem import GapProblem

Answering = Callable[[GapProblem], dict[str, float]]

#: Shares of "none" and of all effects together before any evidence, as the diagnosis has them, without the rest.
_NONE, _EFFECTS = 2 / 7, 5 / 7
#: Added to variances, in tolerances squared, as the diagnosis does: no mean is known better than to a hundredth.
_LEAST = 1e-4


def noise_only(problem: GapProblem) -> dict[str, float]:
    """Evidence with the scatter of repetitions alone: no background, no unknown. All places equally likely."""
    from scipy.special import logsumexp

    none, logs = _log_likelihoods(problem)
    share = _EFFECTS / max(1, len(logs))
    joint = {
        name: float(logsumexp(log_likelihoods) - np.log(len(log_likelihoods)) + np.log(share))
        for name, log_likelihoods in logs.items()
    }
    return _normalised({NONE: none + np.log(_NONE), **joint})


def bic(problem: GapProblem) -> dict[str, float]:
    """exp(-BIC / 2) of each effect at its best place: Schwarz, Ann. Stat. 6 (1978) 461."""
    none, logs = _log_likelihoods(problem)
    cost = 0.5 * np.log(len(problem.z))
    best = {
        name: float(log_likelihoods.max() - cost * problem.parameters[name]) for name, log_likelihoods in logs.items()
    }
    return _normalised({NONE: none, **best})


def largest_residual(problem: GapProblem, frequent: Mapping[str, str] | None = None) -> dict[str, float]:
    """Names the most frequent effect of the stage whose gap is the largest in tolerances, or none within tolerance.

    `frequent` by stage; by default the first effect of the stage that the campaign can show.
    """
    sizes = {name: float(np.sqrt(np.mean(problem.z[problem.stage == name] ** 2))) for name in set(problem.stage)}
    worst = max(sizes, key=lambda name: sizes[name])
    if sizes[worst] <= 1.0:
        return {NONE: 1.0}
    named = (frequent or {}).get(worst) or next((n for n in problem.changes if n.startswith(f"{worst}.")), None)
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
