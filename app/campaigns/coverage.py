"""How much of a design a campaign has recorded: by plan, and by level of each factor."""

from __future__ import annotations

from typing import Any

from sqlalchemy import ColumnElement, case, exists, func, or_, select
from sqlalchemy.orm import Session, aliased

from ...schema.campaigns import STATUSES, ConfigurationLevel, Factor, FactorLevel, Plan, PlannedRun
from ...schema.conditions import listing_key
from ...schema.impacts import Impact, Shot

Table = type[Impact] | type[Shot]


def worked_off(campaign_key: int, name: str) -> ColumnElement[bool]:
    """Which plans a campaign works off: those that its impacts or shots point at, and the one of its own name.

    Asked of each planned run in turn, of which there are few, and not of each impact.
    """
    run = aliased(PlannedRun)  # the callers' own runs are those of the plan, linked or not
    linked = [
        exists().where(run.plan_id == Plan.id, t.planned_run_id == run.id, t.campaign_id == campaign_key)
        for t in (Impact, Shot)
    ]
    return or_(Plan.name == name, *linked)


def plan_coverage(session: Session, campaign_key: int, name: str) -> list[dict[str, Any]]:
    """A row for each plan: its runs by state, repetitions asked for, and those that this campaign has recorded."""
    states = _runs_by_state()
    query = (
        select(Plan.id, Plan.name, Plan.kind, Plan.method, func.count(PlannedRun.id), *states)
        .outerjoin(PlannedRun, PlannedRun.plan_id == Plan.id)
        .where(worked_off(campaign_key, name))
        .group_by(Plan.id)
        .order_by(Plan.name)
    )
    gaps = []
    for key, plan, kind, method, runs, *counts in session.execute(query).all():
        wanted = select(func.sum(PlannedRun.repetitions)).where(
            PlannedRun.plan_id == key, PlannedRun.status != "discarded"
        )
        table: Table = Shot if kind == "gun" else Impact
        recorded = (
            select(func.count())
            .select_from(PlannedRun)
            .join(table, table.planned_run_id == PlannedRun.id)
            .where(PlannedRun.plan_id == key, table.campaign_id == campaign_key)
        )
        gaps.append(
            {
                "plan": plan,
                "method": method,
                "runs": runs,
                **{state: int(count or 0) for state, count in zip(STATUSES, counts, strict=True)},
                "repetitions": int(session.scalar(wanted) or 0),
                "recorded": session.scalar(recorded) or 0,
            }
        )
    return gaps


def level_coverage(session: Session, campaign_key: int, name: str) -> list[dict[str, Any]]:
    """A row for each level of each factor: runs of the campaign's plans by state, impacts and shots recorded at it.

    Levels that nobody planned have zeros there; those that nobody recorded, zeros in the rest.
    """
    keys = [key for (key,) in session.execute(select(Plan.id).where(worked_off(campaign_key, name)))]
    runs = (
        select(PlannedRun.configuration_id, *_runs_by_state())
        .where(PlannedRun.plan_id.in_(keys))
        .group_by(PlannedRun.configuration_id)
    )
    counted: dict[int, dict[str, int]] = {}
    for configuration, *states in session.execute(runs).all():
        counted[configuration] = {state: int(count or 0) for state, count in zip(STATUSES, states, strict=True)}
    for what, table in (("impacts", Impact), ("shots", Shot)):
        recorded = select(table.configuration_id, func.count()).where(table.campaign_id == campaign_key)
        for configuration, count in session.execute(recorded.group_by(table.configuration_id)).all():
            counted.setdefault(configuration, {})[what] = count
    return _by_level(session, counted)


def _runs_by_state() -> list[ColumnElement[int]]:
    return [func.sum(case((PlannedRun.status == state, 1), else_=0)) for state in STATUSES]


def _by_level(session: Session, counted: dict[int, dict[str, int]]) -> list[dict[str, Any]]:
    """Counts of configurations added up over the levels that they have, in the order of factors and levels."""
    columns = (Factor.name, Factor.si_unit, FactorLevel.id, FactorLevel.label, FactorLevel.number)
    rows: dict[int, dict[str, Any]] = {}
    keys = sorted(counted)
    for i in range(0, len(keys), 500):  # SQLite allows a limited number of variables
        query = (
            select(ConfigurationLevel.configuration_id, *columns)
            .join(FactorLevel, ConfigurationLevel.level_id == FactorLevel.id)
            .join(Factor, FactorLevel.factor_id == Factor.id)
            .where(ConfigurationLevel.configuration_id.in_(keys[i : i + 500]))
        )
        for configuration, factor, si_unit, level, label, number in session.execute(query):
            key = listing_key(factor, si_unit)
            new = {"factor": key, "level": label if number is None else number}
            row = rows.setdefault(level, {**new, **dict.fromkeys((*STATUSES, "impacts", "shots"), 0)})
            for what, count in counted[configuration].items():
                row[what] += count
    return sorted(rows.values(), key=_order)


def _order(row: dict[str, Any]) -> tuple[str, bool, float, str]:
    """Numbers rise, words follow the alphabet."""
    word = isinstance(row["level"], str)
    return row["factor"], word, 0.0 if word else row["level"], str(row["level"])
