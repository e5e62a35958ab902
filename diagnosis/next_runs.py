"""The experiment that would tell the likeliest causes apart: at the campaign's settings, or between
and near them."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..array_types import Floats
from ..schema.known_factors import column_of
from ..twin.effects import Effect
from .inference.posterior import HypothesisPosterior
from .inference.subset_fit import SubsetFit, residual, split_parts
from .observables.base import Stage
from .observables.contact.stage import ContactObservables
from .observables.gun.stage import GunObservables
from .record import CampaignRecord, Factor, Run, RunConfiguration
from .verdict import NONE, UNKNOWN, Cause, NextRun

#: Two causes are told apart at this distance: one case in forty goes wrong.
APART = 4.0
#: Draws of each cause's parameters; more shots of one setting than this are nobody's next
#: experiment.
_DRAWS, MOST_RUNS = 24, 30
#: Shots of the configuration in which most of an unexplained gap remains.
_REPEATS = 3
_PAIRS, _LEAST = 3, 0.01
#: How far beyond the campaign's own range numbers may go: by this factor, down and up; so many
#: numbers within it, and so many settings of a contact at most.
_BEYOND, _NUMBERS, _MOST = 1.5, 5, 160


@dataclass(frozen=True, eq=False)
class _Forecast:
    """What a cause says of n settings: mean (n, D) and covariance (n, D, D) over its likely
    parameters."""

    mean: Floats
    covariance: Floats


def next_runs(
    posterior: HypothesisPosterior,
    stages: Sequence[Stage],
    causes: Sequence[Cause],
    rng: np.random.Generator,
) -> tuple[NextRun, ...]:
    """For each pair of likely causes the setting that tells them apart with the fewest shots,
    likely pairs first; where the gap is not explained first of all the setting where most of it
    remains.

    Distance between what two causes say of n shots: (y_j - y_k)' (V_j + V_k + S / n)^-1 (y_j -
    y_k), V their spread over likely parameters, S the scatter of a shot.

    Parameters:
        posterior: The sets of effects with their probabilities.
        stages: The stages of the campaign.
        causes: The causes of the report, by falling probability.
        rng: Random numbers of the draws of each cause's parameters.

    Source:
        Buzzi-Ferraris and Forzatti, Chem. Eng. Sci. 38 (1983) 225, for the distance.
    """
    unexplained = _where_unexplained(posterior) if causes[0].effects == (UNKNOWN,) else ()
    pairs = _pairs(causes)
    if not pairs:
        return unexplained
    stages = candidate_stages(stages)
    names = dict.fromkeys(name for pair in pairs for name in pair)
    forecasts = {name: _forecast(posterior, name, stages, rng) for name in names}
    settings = [row.factors for row in stages[0].record.configurations]
    noise = posterior.gap.noise.covariance
    runs = (_best(pair, forecasts, settings, noise) for pair in pairs)
    return (*unexplained, *filter(None, runs))


def _where_unexplained(posterior: HypothesisPosterior) -> tuple[NextRun, ...]:
    """The configuration in which the best set of effects leaves most, shot again in another order
    of runs."""
    gap = posterior.gap
    table = np.zeros(len(gap.mean))
    for block, change in zip(posterior.problem.blocks, posterior.best.change, strict=True):
        np.add.at(table, block.configuration, np.minimum(residual(block, change) ** 2, 1e6))
    factors = gap.record.configurations[int(table.argmax())].factors
    pattern = posterior.likeliest_pattern
    acts = f"where {pattern.pattern}" if " = " in pattern.pattern else pattern.pattern
    why = (
        "repeats the configuration in which most of the gap remains, in another order of runs: "
        f"what remains looks most like something in the {pattern.stage} that acts {acts}"
    )
    return (NextRun(why, _columns(factors), _REPEATS),)


def _pairs(causes: Sequence[Cause]) -> list[tuple[str, str]]:
    """Of the first group's members, and of the first with the next groups, the more probable the
    earlier."""
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
    posterior: HypothesisPosterior, name: str, stages: Sequence[Stage], rng: np.random.Generator
) -> _Forecast:
    sets = _parameter_draws(posterior.representative(name.split("+")), rng)
    changes = np.concatenate([stage.changes(sets) for stage in stages], axis=2)
    changes = changes[np.isfinite(changes).all(axis=(1, 2))]
    if len(changes) < 2:
        n, d = changes.shape[1:]
        return _Forecast(np.full((n, d), np.nan), np.zeros((n, d, d)))
    deviation = changes - changes.mean(axis=0)
    return _Forecast(
        changes.mean(axis=0), np.einsum("kni,knj->nij", deviation, deviation) / (len(changes) - 1)
    )


def _parameter_draws(fit: SubsetFit, rng: np.random.Generator) -> list[tuple[Effect, ...]]:
    """Parameters as likely as the data leave them; those that differ between levels by what levels
    have in common."""
    covariance = np.linalg.inv(fit.precision)
    root = np.linalg.cholesky((covariance + covariance.T) / 2 + 1e-9 * np.eye(len(covariance)))
    draws = fit.u + rng.standard_normal((_DRAWS, len(fit.u))) @ root.T
    return [
        tuple(
            law.common.effect(law.common_part(part))
            for law, part in zip(fit.laws, split_parts(fit.laws, u), strict=True)
        )
        for u in draws
    ]


def _best(
    pair: tuple[str, str],
    forecasts: Mapping[str, _Forecast],
    settings: Sequence[Mapping[str, Factor]],
    noise: Floats,
) -> NextRun | None:
    a, b = (forecasts[name] for name in pair)
    for shots in range(1, MOST_RUNS + 1):
        distance = np.nan_to_num(_distances(a, b, noise, shots))
        if distance.max() > APART:
            break
    row = int(distance.argmax())
    if not distance[row] > 0:
        return None
    why = f"separates {pair[0]} from {pair[1]}"
    if not distance[row] > APART:
        why += f" only to {distance[row]:.1f} of the {APART:g} standard deviations that it takes"
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
    columns = {column_of(name): value for name, value in factors.items()}
    return {
        column: value if isinstance(value, str) else float(f"{value / unit:.6g}")
        for (column, unit), value in columns.items()
    }


def candidate_stages(stages: Sequence[Stage]) -> Sequence[Stage]:
    """The stages on a record of settings that one more shot could have, none of which was shot.

    For a campaign of one stage, gun or contact: its own settings, and those between and a little
    beyond them. For others, and where nothing was shot, the stages as they are: their own settings
    are all.

    Parameters:
        stages: The stages of the campaign.
    """
    stage = stages[0]
    if len(stages) == 1 and isinstance(stage, GunObservables):
        record = _gun_settings(stage.record)
        return (GunObservables(record, stage.uncertain),) if record.runs else stages
    if len(stages) == 1 and type(stage) is ContactObservables:
        record = _contact_settings(stage.record)
        return (ContactObservables(record),) if record.runs else stages
    return stages


def _gun_settings(record: CampaignRecord) -> CampaignRecord:
    """Every combination of pressure and mass; the travel is that of the projectile whose mass is
    nearest."""
    shots = [
        run
        for run in record.runs
        if run.tank_pressure_pa and run.bullet_mass_kg and run.velocity_m_s
    ]
    pressures = _spread([float(run.tank_pressure_pa or 0) for run in shots])
    masses = _spread([float(run.bullet_mass_kg or 0) for run in shots])
    settings: list[tuple[dict[str, Factor], Run]] = []
    for pressure, mass in itertools.product(pressures, masses):
        nearest = min(shots, key=lambda run: abs(float(run.bullet_mass_kg or 0) - mass))
        run = replace(
            shots[0], tank_pressure_pa=pressure, bullet_mass_kg=mass, travel_m=nearest.travel_m
        )
        settings.append(({"tank_pressure": pressure, "bullet_mass": mass}, run))
    return _record_of(record, settings)


def _contact_settings(record: CampaignRecord) -> CampaignRecord:
    """Every combination of tip, target and layer that the campaign has levels of, at low and high
    velocity."""
    hits = [run for run in record.runs if run.velocity_m_s and run.force is not None]
    speeds = (
        np.quantile([float(run.velocity_m_s or 0) for run in hits], [0.05, 0.95]).tolist()
        if hits
        else []
    )
    measured = [configuration.factors for configuration in record.configurations]
    names = sorted({name for row in measured for name in row} - {"tank_pressure"})
    levels = [list(dict.fromkeys(row.get(name, "") for row in measured)) for name in names]
    combinations = [
        dict(zip(names, row, strict=True))
        for row in itertools.islice(itertools.product(*levels), 4000)
    ]
    # an insulator needs an anvil to lie on
    possible = [
        row
        for row in combinations
        if row.get("insulator", "none") == "none" or row.get("anvil_material", "none") != "none"
    ]
    step = max(1, len(possible) * len(speeds) // _MOST)
    settings: list[tuple[dict[str, Factor], Run]] = []
    for row, speed in itertools.product(possible[::step], speeds):
        similar = min(
            hits,
            key=lambda run: sum(measured[run.configuration].get(name) != row[name] for name in row),
        )
        mass = row.get("bullet_mass")
        mass = mass if isinstance(mass, float) else similar.bullet_mass_kg
        run = replace(similar, velocity_m_s=speed, bullet_mass_kg=mass)
        settings.append(({**row, "impact_velocity_m_s": speed}, run))
    return _record_of(record, settings)


def _spread(values: Sequence[float]) -> list[float]:
    """The distinct values (a few of them), and one beyond each end."""
    levels = sorted(set(values))
    if len(levels) > _NUMBERS:
        levels = [levels[round(i)] for i in np.linspace(0, len(levels) - 1, _NUMBERS)]
    return (
        [float(f"{v:.3g}") for v in (levels[0] / _BEYOND, *levels, levels[-1] * _BEYOND)]
        if levels
        else []
    )


def _record_of(
    record: CampaignRecord, settings: Sequence[tuple[dict[str, Factor], Run]]
) -> CampaignRecord:
    """One run of each of the settings."""
    configurations = tuple(
        RunConfiguration(f"candidate {i}", factors) for i, (factors, _) in enumerate(settings)
    )
    runs = tuple(
        replace(run, configuration=i, run=i, order=i) for i, (_, run) in enumerate(settings)
    )
    return replace(record, configurations=configurations, runs=runs)
