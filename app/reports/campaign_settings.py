"""Settings as they were planned and as they were: pressures, velocities, masses, in SI until they are told."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from ...array_types import Floats
from ...doe.plans import StoredPlan
from ...schema.campaigns import Campaign, ConfigurationLevel, Factor, FactorLevel, Plan, PlannedRun
from ...schema.impacts import Impact, Shot
from ...schema.listings import listing_key

PRESSURE, VELOCITY = "tank_pressure_pa", "velocity_m_s"
WRITTEN, TRANSDUCER, MEASURED = "as written down", "transducer", "measured"


@dataclass(frozen=True, eq=False)
class AchievedSetting:
    """A setting, `planned` and `achieved` (n,), of the repetitions that `where` names. `source` tells who says so."""

    key: str
    source: str
    planned: Floats
    achieved: Floats
    where: tuple[str, ...]

    @property
    def off(self) -> Floats:
        """Achieved less planned, as a share of planned (n,)."""
        return self.achieved / self.planned - 1


_Found = defaultdict[tuple[str, str], list[tuple[float, float, str]]]


def achieved_settings(session: Session, campaign: Campaign, plans: Sequence[StoredPlan]) -> list[AchievedSetting]:
    """Every numeric setting of the planned runs beside what was recorded.

    Pressures are the transducer's too, where there was one, of a shot without a plan beside the one that was set.
    """
    values: _Found = defaultdict(list)
    table: type[Impact] | type[Shot] = Shot if campaign.kind == "gun" else Impact
    velocity = Shot.measured_velocity_m_s if campaign.kind == "gun" else Impact.impact_velocity_m_s
    wanted = {(p.name, run.run): speed for p in plans for run in p.runs if (speed := p.space.velocity_m_s(run.row))}
    columns = (table.run, table.repetition, velocity, table.configuration_id, PlannedRun.configuration_id, Plan.name)
    query = (
        select(*columns)
        .join(PlannedRun, table.planned_run_id == PlannedRun.id)
        .join(Plan, PlannedRun.plan_id == Plan.id)
        .where(table.campaign_id == campaign.id)
        .order_by(table.run, table.repetition)
    )
    rows = session.execute(query).all()
    numbers = _numbers(session, {key for row in rows for key in row[3:5]})
    for run, repetition, speed, recorded, planned, plan in rows:
        where = f"run {run}, repetition {repetition}"
        for key, value in numbers[planned].items():
            if key in numbers[recorded] and value != 0:  # no deviation is a share of nothing
                values[key, WRITTEN].append((value, numbers[recorded][key], where))
        if speed is not None and (plan, run) in wanted:
            values[VELOCITY, MEASURED].append((wanted[plan, run], speed, where))
    _pressures(session, campaign, numbers, values)
    return [_achieved(key, source, pairs) for (key, source), pairs in values.items()]


def _achieved(key: str, source: str, pairs: Sequence[tuple[float, float, str]]) -> AchievedSetting:
    planned, achieved, where = zip(*pairs, strict=True)
    return AchievedSetting(
        key, source, np.array(planned, dtype=np.float64), np.array(achieved, dtype=np.float64), where
    )


def _pressures(session: Session, campaign: Campaign, numbers: Mapping[int, Mapping[str, float]], found: _Found) -> None:
    query = (
        select(Shot.run, Shot.repetition, Shot.tank_pressure_pa, Shot.recorded_pressure_pa, PlannedRun.configuration_id)
        .outerjoin(PlannedRun, Shot.planned_run_id == PlannedRun.id)
        .where(Shot.campaign_id == campaign.id, Shot.recorded_pressure_pa.is_not(None))
        .order_by(Shot.id)
    )
    for run, repetition, given, recorded, planned in session.execute(query):
        assert recorded is not None
        wanted = numbers.get(planned, {}).get(PRESSURE, given)
        found[PRESSURE, TRANSDUCER].append((wanted, recorded, f"run {run}, repetition {repetition}"))


def _numbers(session: Session, configurations: set[int]) -> dict[int, dict[str, float]]:
    """The numeric levels of configurations, by the keys of listings."""
    numbers: dict[int, dict[str, float]] = {key: {} for key in configurations}
    keys, columns = (
        sorted(configurations),
        (ConfigurationLevel.configuration_id, Factor.name, Factor.si_unit, FactorLevel.number),
    )
    for first in range(0, len(keys), 500):  # SQLite allows a limited number of variables
        query = (
            select(*columns)
            .join(FactorLevel, ConfigurationLevel.level_id == FactorLevel.id)
            .join(Factor, FactorLevel.factor_id == Factor.id)
            .where(ConfigurationLevel.configuration_id.in_(keys[first : first + 500]), FactorLevel.number.is_not(None))
            .order_by(Factor.id)
        )
        for key, name, si_unit, number in session.execute(query):
            assert number is not None
            numbers[key][listing_key(name, si_unit)] = number
    return numbers
