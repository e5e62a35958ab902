"""Settings that one more shot could have: the campaign's own, and those between and a little beyond them."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .observables.base import Stage
from .observables.contact.stage import ContactStage
from .observables.gun.stage import GunStage
from .record import CampaignRecord, Configuration, Factor, Run

#: How far beyond the campaign's own range numbers may go: by this factor, down and up.
BEYOND = 1.5
_NUMBERS = 5
_MOST = 160


@dataclass(frozen=True, eq=False)
class Candidates:
    """Stages on a record whose configurations are the settings; None of them was shot."""

    record: CampaignRecord
    stages: tuple[Stage, ...]


def candidates(stages: Sequence[Stage]) -> Candidates | None:
    """For a campaign of one stage, gun or contact. None for others: there the campaign's own settings are all."""
    if len(stages) != 1 or not isinstance(stages[0], GunStage | ContactStage):
        return None
    record = stages[0].record
    if isinstance(stages[0], GunStage):
        made = _of_gun(record)
        return Candidates(made, (GunStage(made, stages[0].uncertain),)) if made.runs else None
    if type(stages[0]) is not ContactStage:
        return None
    made = _of_contact(record)
    return Candidates(made, (ContactStage(made),)) if made.runs else None


def _of_gun(record: CampaignRecord) -> CampaignRecord:
    shots = [run for run in record.runs if run.tank_pressure_pa and run.bullet_mass_kg and run.velocity_m_s]
    pressures = _spread([float(run.tank_pressure_pa or 0) for run in shots])
    masses = _spread([float(run.bullet_mass_kg or 0) for run in shots])
    rows = list(itertools.product(pressures, masses))
    factors: list[dict[str, Factor]] = [{"tank_pressure": p, "bullet_mass": m} for p, m in rows]
    runs = [
        replace(
            shots[0],
            configuration=i,
            run=i,
            order=i,
            tank_pressure_pa=p,
            bullet_mass_kg=m,
            travel_m=_travel_m(shots, m),
        )
        for i, (p, m) in enumerate(rows)
    ]
    return _with(record, factors, runs)


def _travel_m(shots: Sequence[Run], mass_kg: float) -> float | None:
    """Of the projectile whose mass is nearest; None where none has a travel of its own."""
    return min(shots, key=lambda run: abs(float(run.bullet_mass_kg or 0) - mass_kg)).travel_m


def _of_contact(record: CampaignRecord) -> CampaignRecord:
    """Every combination of tip, target and layer that the campaign has levels of, at low and high velocity."""
    hits = [run for run in record.runs if run.velocity_m_s and run.force is not None]
    velocity = np.array([float(run.velocity_m_s or 0) for run in hits])
    speeds = [float(v) for v in np.quantile(velocity, [0.05, 0.95])] if hits else []
    names = sorted({name for each in record.configurations for name in each.factors} - {"tank_pressure"})
    levels = [list(dict.fromkeys(each.factors.get(name, "") for each in record.configurations)) for name in names]
    combinations = [dict(zip(names, row, strict=True)) for row in itertools.islice(itertools.product(*levels), 4000)]
    possible = [row for row in combinations if not _floating(row)]
    step = max(1, len(possible) * len(speeds) // _MOST)
    factors: list[dict[str, Factor]] = []
    runs: list[Run] = []
    for row, speed in itertools.product(possible[::step], speeds):
        like = min(hits, key=lambda run: _unlike(record.configurations[run.configuration], row))
        mass = row.get("bullet_mass", like.bullet_mass_kg)
        runs.append(
            replace(
                like,
                configuration=len(factors),
                run=len(factors),
                order=len(factors),
                velocity_m_s=speed,
                bullet_mass_kg=mass if isinstance(mass, float) else like.bullet_mass_kg,
            )
        )
        factors.append({**row, "impact_velocity_m_s": speed})
    return _with(record, factors, runs)


def _floating(row: dict[str, Factor]) -> bool:
    """An insulator without an anvil to lie on."""
    return row.get("insulator", "none") != "none" and row.get("anvil_material", "none") == "none"


def _unlike(configuration: Configuration, row: dict[str, Factor]) -> int:
    return sum(configuration.factors.get(name) != value for name, value in row.items())


def _spread(values: Sequence[float]) -> list[float]:
    """The distinct values (a few of them), and one beyond each end."""
    found = sorted(set(values))
    if len(found) > _NUMBERS:
        found = [found[round(i)] for i in np.linspace(0, len(found) - 1, _NUMBERS)]
    return [float(f"{v:.3g}") for v in (found[0] / BEYOND, *found, found[-1] * BEYOND)] if found else []


def _with(record: CampaignRecord, factors: Sequence[dict[str, Factor]], runs: Sequence[Run]) -> CampaignRecord:
    made = tuple(Configuration(f"candidate {i}", row) for i, row in enumerate(factors))
    return replace(record, configurations=made, runs=tuple(runs))
