"""The experiment that would tell the likeliest causes apart."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..twin.effects import Effect
from .candidates import Candidates, candidates
from .inference.posterior import Posterior
from .inference.subset_fit import SubsetFit, residual, split_parts
from .localisation.rules import column_of
from .observables.base import Stage
from .record import Factor
from .verdict import NONE, UNKNOWN, Cause, NextRun

Floats = NDArray[np.float64]

#: Two causes are told apart at this distance: one case in forty goes wrong.
APART = 4.0
#: Draws of each cause's parameters; more shots of one setting than this are nobody's next experiment.
_DRAWS, MOST_RUNS = 24, 30
#: Shots of the configuration in which most of an unexplained gap remains.
_REPEATS = 3
_PAIRS, _LEAST = 3, 0.01


@dataclass(frozen=True, eq=False)
class _Forecast:
    """What a cause says of n settings: mean (n, D) and covariance (n, D, D) over its likely parameters."""

    mean: Floats
    covariance: Floats


def next_runs(
    posterior: Posterior, stages: Sequence[Stage], causes: Sequence[Cause], rng: np.random.Generator
) -> tuple[NextRun, ...]:
    """For each pair of likely causes the setting that tells them apart with the fewest shots, likely pairs first; where
    the gap is not explained first of all the setting where most of it remains.

    Distance between what two causes say of n shots: (y_j - y_k)' (V_j + V_k + S / n)^-1 (y_j - y_k), V their spread
    over likely parameters, S the scatter of a shot (Buzzi-Ferraris and Forzatti, Chem. Eng. Sci. 38 (1983) 225).
    """
    unexplained = _where_unexplained(posterior) if causes[0].effects == (UNKNOWN,) else ()
    pairs = _pairs(causes)
    if not pairs:
        return unexplained
    names = list(dict.fromkeys(name for pair in pairs for name in pair))
    more = candidates(stages)
    forecasts = {name: _forecast(posterior, name, stages, more, rng) for name in names}
    settings = [row.factors for row in (more.record if more else stages[0].record).configurations]
    noise = posterior.gap.noise.covariance
    runs = [_best(pair, forecasts, settings, noise) for pair in pairs]
    return (*unexplained, *(run for run in runs if run is not None))


def _where_unexplained(posterior: Posterior) -> tuple[NextRun, ...]:
    """The configuration in which the best set of effects leaves most, shot again in another order of runs."""
    gap = posterior.gap
    table = np.zeros(len(gap.rows))
    for block, change in zip(posterior.problem.blocks, posterior.best.change, strict=True):
        np.add.at(table, block.configuration, np.minimum(residual(block, change) ** 2, 1e6))
    settings = gap.record.configurations[int(gap.rows[int(table.argmax())])].factors
    pattern = posterior.likeliest_pattern
    why = (
        "repeats the configuration in which most of the gap remains, in another order of runs: what remains looks most "
        f"like something in the {pattern.stage} that acts {_acts(pattern.pattern)}"
    )
    return (NextRun(why, _columns(settings), _REPEATS),)


def _acts(pattern: str) -> str:
    return f"where {pattern}" if " = " in pattern else pattern


def _pairs(causes: Sequence[Cause]) -> list[tuple[str, str]]:
    """Of the first group's members, and of the first with the next groups, the more probable the earlier."""
    rows = [
        (name, cause.probability * share)
        for cause in causes
        for name, share in zip(cause.effects, cause.split or (1.0,), strict=False)
        if name not in (NONE, UNKNOWN)
    ]
    likely = [(name, p) for name, p in rows if p >= _LEAST][:4]
    joint = [((a, b), p * q) for (a, p), (b, q) in itertools.combinations(likely, 2)]
    return [pair for pair, _ in sorted(joint, key=lambda item: -item[1])[:_PAIRS]]


def _forecast(
    posterior: Posterior, name: str, stages: Sequence[Stage], more: Candidates | None, rng: np.random.Generator
) -> _Forecast:
    sets = _drawn(posterior.representative(name.split("+")), rng)
    asked = more.stages if more else stages
    table = np.concatenate([stage.changes(sets) for stage in asked], axis=2)
    table = table[np.isfinite(table).all(axis=(1, 2))] if not np.isfinite(table).all() else table
    if len(table) < 2:
        n, d = len(asked[0].record.configurations), sum(len(stage.observables) for stage in asked)
        return _Forecast(np.full((n, d), np.nan), np.zeros((n, d, d)))
    away = table - table.mean(axis=0)
    return _Forecast(table.mean(axis=0), np.einsum("kni,knj->nij", away, away) / (len(table) - 1))


def _drawn(fit: SubsetFit, rng: np.random.Generator) -> list[tuple[Effect, ...]]:
    """Parameters as likely as the data leave them; those that differ between levels by what levels have in common."""
    covariance = np.linalg.inv(fit.precision)
    root = np.linalg.cholesky((covariance + covariance.T) / 2 + 1e-9 * np.eye(len(covariance)))
    draws = fit.u + rng.standard_normal((_DRAWS, len(fit.u))) @ root.T
    return [
        tuple(
            law.common.effect(law.common_part(own)) for law, own in zip(fit.laws, split_parts(fit.laws, u), strict=True)
        )
        for u in draws
    ]


def _best(
    pair: tuple[str, str], forecasts: Mapping[str, _Forecast], settings: Sequence[Mapping[str, Factor]], noise: Floats
) -> NextRun | None:
    a, b = (forecasts[name] for name in pair)
    distance = [_distances(a, b, noise, n) for n in range(1, MOST_RUNS + 1)]
    enough = [i for i, row in enumerate(distance) if np.nanmax(row, initial=0.0) > APART]
    shots = enough[0] + 1 if enough else MOST_RUNS
    reach = distance[shots - 1]
    if not np.isfinite(reach).any() or not np.nanmax(reach) > 0:
        return None
    row = int(np.nanargmax(reach))
    why = f"separates {pair[0]} from {pair[1]}"
    if not enough:
        why += f" only to {np.nanmax(reach):.1f} of the {APART:g} standard deviations that it takes"
    return NextRun(why, _columns(settings[row]), shots)


def _distances(a: _Forecast, b: _Forecast, noise: Floats, shots: int) -> Floats:
    """(n,): in standard deviations."""
    between = a.mean - b.mean
    total = a.covariance + b.covariance + noise / shots
    with np.errstate(invalid="ignore"):
        solved = np.linalg.solve(total, between[:, :, None])[:, :, 0]
        return np.asarray(np.sqrt(np.maximum(np.einsum("nd,nd->n", between, solved), 0.0)))


def _columns(factors: Mapping[str, Factor]) -> dict[str, Factor]:
    """As a campaign's runs.csv has them."""
    found: dict[str, Factor] = {}
    for name, value in factors.items():
        column, unit = column_of(name)
        found[column] = value if isinstance(value, str) else float(f"{value / unit:.6g}")
    return found
