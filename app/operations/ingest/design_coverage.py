"""How much of a design a campaign has recorded, by plan and by level of each factor, and what was
set and measured beside what its plans asked for."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, exists, func, or_, select
from sqlalchemy.orm import Session, aliased

from ....doe.space import Space, space_from_text
from ....schema.base import in_batches
from ....schema.campaigns import STATUSES, ConfigurationLevel, Factor, FactorLevel, Plan, PlannedRun
from ....schema.conditions import listing_key
from ....schema.configurations import iter_levels
from ....schema.impacts import Impact, Shot
from ....schema.run_states import is_rejected, repetition_table, run_status


def worked_off(campaign_key: int, name: str) -> ColumnElement[bool]:
    """Which plans a campaign works off: those that its impacts or shots point at, and the one of
    its own name.

    Asked of each planned run in turn, of which there are few, and not of each impact.
    """
    run = aliased(PlannedRun)  # the callers' own runs are those of the plan, linked or not
    linked = [
        exists().where(
            run.plan_id == Plan.id, t.planned_run_id == run.id, t.campaign_id == campaign_key
        )
        for t in (Impact, Shot)
    ]
    return or_(Plan.name == name, *linked)


def plan_coverage(session: Session, campaign_key: int, name: str) -> list[dict[str, Any]]:
    """A row for each plan: its runs by state, repetitions asked for, and those that this campaign
    has recorded and that no check rejects."""
    query = select(Plan.id, Plan.name, Plan.kind, Plan.method).where(worked_off(campaign_key, name))
    gaps = []
    for key, plan, kind, method in session.execute(query.order_by(Plan.name)).all():
        counts = session.execute(
            select(run_status(), func.count())
            .where(PlannedRun.plan_id == key)
            .group_by("run_status")
        )
        states = dict.fromkeys(STATUSES, 0) | dict(iter(counts))
        wanted = select(func.sum(PlannedRun.repetitions)).where(
            PlannedRun.plan_id == key, PlannedRun.status != "discarded"
        )
        table = repetition_table(kind)
        recorded = (
            select(func.count())
            .select_from(PlannedRun)
            .join(table, table.planned_run_id == PlannedRun.id)
            .where(
                PlannedRun.plan_id == key, table.campaign_id == campaign_key, ~is_rejected(table)
            )
        )
        gaps.append(
            {
                "plan": plan,
                "method": method,
                "runs": sum(states.values()),
                **states,
                "repetitions": int(session.scalar(wanted) or 0),
                "recorded": session.scalar(recorded) or 0,
            }
        )
    return gaps


def level_coverage(session: Session, campaign_key: int, name: str) -> list[dict[str, Any]]:
    """A row for each level of each factor: runs of the campaign's plans by state, impacts and shots
    recorded at it.

    Levels that nobody planned have zeros there; those that nobody recorded, zeros in the rest.
    """
    keys = [
        key for (key,) in session.execute(select(Plan.id).where(worked_off(campaign_key, name)))
    ]
    runs = (
        select(PlannedRun.configuration_id, run_status(), func.count())
        .where(PlannedRun.plan_id.in_(keys))
        .group_by(PlannedRun.configuration_id, "run_status")
    )
    counted: dict[int, dict[str, int]] = {}
    for configuration, state, count in session.execute(runs).all():
        counted.setdefault(configuration, {})[state] = count
    for what, table in (("impacts", Impact), ("shots", Shot)):
        recorded = select(table.configuration_id, func.count()).where(
            table.campaign_id == campaign_key
        )
        for configuration, count in session.execute(
            recorded.group_by(table.configuration_id)
        ).all():
            counted.setdefault(configuration, {})[what] = count
    return _by_level(session, counted)


def _by_level(session: Session, counted: dict[int, dict[str, int]]) -> list[dict[str, Any]]:
    """Counts of configurations added up over the levels that they have, in the order of factors and
    levels."""
    rows: dict[int, dict[str, Any]] = {}
    for setting in iter_levels(session, sorted(counted)):
        new = {"factor": listing_key(setting.factor, setting.si_unit), "level": setting.level}
        row = rows.setdefault(
            setting.level_id, {**new, **dict.fromkeys((*STATUSES, "impacts", "shots"), 0)}
        )
        for what, count in counted[setting.configuration].items():
            row[what] += count
    return sorted(rows.values(), key=_order)


def _order(row: dict[str, Any]) -> tuple[str, bool, float, str]:
    """Numbers rise, words follow the alphabet."""
    word = isinstance(row["level"], str)
    return row["factor"], word, 0.0 if word else row["level"], str(row["level"])


PRESSURE, TRANSDUCER, MASS, VELOCITY = (
    "tank_pressure_pa",
    "recorded_pressure_pa",
    "bullet_mass_kg",
    "velocity_m_s",
)
#: Quantity -> where a shot or an impact says what became of it. `recorded_pressure_pa` is the
#: transducer's word on the planned tank pressure, `tank_pressure_pa` the lab's.
_OF_SHOTS = {
    PRESSURE: Shot.tank_pressure_pa,
    TRANSDUCER: Shot.recorded_pressure_pa,
    MASS: Shot.bullet_mass_kg,
    VELOCITY: Shot.measured_velocity_m_s,
}
_OF_IMPACTS = {VELOCITY: Impact.impact_velocity_m_s}
#: Factors of a plan that are such a quantity, in SI.
_PLANNED = {"tank_pressure": (PRESSURE, TRANSDUCER), "bullet_mass": (MASS,)}


@dataclass(frozen=True)
class Achieved:
    """Per planned run and quantity (its unit in its name): `planned`, and `mean`, `least`,
    `largest` of `recorded`.

    `deviation` is mean / planned - 1. The summary has one row per quantity: the mean deviation, the
    mean of its magnitude, and the run that is furthest off.
    """

    rows: list[dict[str, Any]]
    summary: list[dict[str, Any]]


def achieved_settings(session: Session, campaign_key: int) -> Achieved:
    """Of the runs that the shots or impacts are linked to (`ingest.storing.plan_link`), in order
    of plan and run."""
    recorded = _recorded(session, campaign_key)
    if not recorded:
        return Achieved([], [])
    rows = []
    for run, wanted in _planned(session, sorted(recorded)):
        for quantity, figures in recorded[run["key"]].items():
            planned = wanted.get(quantity)
            if planned is not None and planned > 0:
                row = {
                    "plan": run["plan"],
                    "run": run["run"],
                    "quantity": quantity,
                    "planned": planned,
                }
                rows.append(row | figures | {"deviation": figures["mean"] / planned - 1})
    return Achieved(
        rows, [_summary(rows, quantity) for quantity in _OF_SHOTS if _of(rows, quantity)]
    )


def _recorded(session: Session, campaign_key: int) -> dict[int, dict[str, dict[str, Any]]]:
    """Figures by planned run and quantity, counted in the database; a gun's velocity is that of its
    shots."""
    recorded_by_run: dict[int, dict[str, dict[str, Any]]] = {}
    for table, quantities in ((Shot, _OF_SHOTS), (Impact, _OF_IMPACTS)):
        figures = [
            f(c) for c in quantities.values() for f in (func.count, func.avg, func.min, func.max)
        ]
        query = (
            select(table.planned_run_id, *figures)
            .where(table.campaign_id == campaign_key, table.planned_run_id.is_not(None))
            .group_by(table.planned_run_id)
        )
        for key, *values in session.execute(query).all():
            recorded = recorded_by_run.setdefault(key, {})
            for i, quantity in enumerate(quantities):
                count, mean, least, largest = values[4 * i : 4 * i + 4]
                if count:
                    recorded.setdefault(
                        quantity,
                        {"recorded": count, "mean": mean, "least": least, "largest": largest},
                    )
    return recorded_by_run


def _planned(
    session: Session, keys: list[int]
) -> Iterable[tuple[dict[str, Any], dict[str, float]]]:
    """Planned runs by plan and number, each with the numbers that were asked for."""
    runs: list[tuple[PlannedRun, Plan]] = []
    levels: dict[int, dict[str, float]] = {}
    for some in in_batches(keys):
        query = (
            select(PlannedRun, Plan)
            .join(Plan, PlannedRun.plan_id == Plan.id)
            .where(PlannedRun.id.in_(some))
        )
        runs += [(run, plan) for run, plan in session.execute(query)]
        numbers = (
            select(PlannedRun.id, Factor.name, FactorLevel.number)
            .join(
                ConfigurationLevel,
                ConfigurationLevel.configuration_id == PlannedRun.configuration_id,
            )
            .join(FactorLevel, ConfigurationLevel.level_id == FactorLevel.id)
            .join(Factor, FactorLevel.factor_id == Factor.id)
            .where(PlannedRun.id.in_(some), Factor.name.in_(_PLANNED))
        )
        for key, factor, number in session.execute(numbers):
            if number is not None:
                levels.setdefault(key, {}).update(dict.fromkeys(_PLANNED[factor], number))
    spaces: dict[int, Space | None] = {}
    for run, plan in sorted(runs, key=lambda pair: (pair[1].name, pair[0].run)):
        if plan.id not in spaces:
            spaces[plan.id] = _space(plan)
        space = spaces[plan.id]
        speed = None if space is None else space.velocity_m_s(run.treatment)
        wanted = levels.get(run.id, {}) | ({} if speed is None else {VELOCITY: speed})
        yield {"key": run.id, "plan": plan.name, "run": run.run}, wanted


def _space(plan: Plan) -> Space | None:
    try:
        return space_from_text(plan.factors)
    except ValueError:  # a plan that was stored without the factors that it was made from
        return None


def _of(rows: list[dict[str, Any]], quantity: str) -> list[dict[str, Any]]:
    return [row for row in rows if row["quantity"] == quantity]


def _summary(rows: list[dict[str, Any]], quantity: str) -> dict[str, Any]:
    quantity_rows = _of(rows, quantity)
    worst = max(quantity_rows, key=lambda row: abs(row["deviation"]))
    return {
        "quantity": quantity,
        "runs": len(quantity_rows),
        "mean_deviation": sum(row["deviation"] for row in quantity_rows) / len(quantity_rows),
        "mean_magnitude": sum(abs(row["deviation"]) for row in quantity_rows) / len(quantity_rows),
        "worst_plan": worst["plan"],
        "worst_run": worst["run"],
        "worst_deviation": worst["deviation"],
    }
