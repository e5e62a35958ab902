"""Plans in the store: written once, read back as designs, and what became of each run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import case, func, select
from sqlalchemy.orm import Session

from ..schema.benches import material_names
from ..schema.campaigns import STATUSES, Plan, PlannedRun, plan_turn
from ..schema.configurations import configuration_ids
from ..schema.impacts import Impact, Shot
from ..schema.known_factors import LevelError, MaterialNames, RunLevel, level_of
from ..schema.session import Store
from ..schema.transactions import take_advisory_lock
from .designs.base import Design
from .space import Space, space_from_text

Settings = Mapping[str, float]


class UnknownPlanError(LookupError):
    """The store has no plan of this name; the message lists those there are."""


class PlanExistsError(ValueError):
    """A plan of this name is in the store already."""


@dataclass(frozen=True)
class StoredRun:
    """A planned run. `row` is the treatment as the plan's table writes it; `settings` are numbers that follow."""

    run: int
    position: int
    repetitions: int
    status: str
    reason: str | None
    row: Mapping[str, str]
    settings: Settings
    recorded: int  # repetitions that were recorded


@dataclass(frozen=True)
class StoredPlan:
    """A plan as it stands: its runs in order of position."""

    name: str
    method: str
    seed: int | None
    description: str | None
    factors: str  # TOML
    space: Space
    runs: tuple[StoredRun, ...]

    def treatments(self, *statuses: str) -> NDArray[np.int64]:
        """Treatments (n, axes) of the runs in these states (all where none is named), in order of position."""
        chosen = [run.row for run in self.runs if not statuses or run.status in statuses]
        return self.space.treatments(chosen) if chosen else np.empty((0, len(self.space.axes)), dtype=np.int64)


def add_plan(
    store: Store,
    name: str,
    factors: str,
    design: Design,
    *,
    repetitions: int | Sequence[int],
    settings: Sequence[Settings] | None = None,
    runs: Sequence[int] | None = None,
    description: str | None = None,
) -> None:
    """Store a design as plan `name`, its treatments in order of run; `factors` is the TOML that its space is made of.

    `settings`, `runs` (numbers; 1, 2, ... by default) and `repetitions` (or one for all) go with the treatments.
    Raises `PlanExistsError`, and `ValueError` for a level that is none of the store's, such as an unknown material.
    """
    numbers = list(runs) if runs is not None else list(range(1, len(design.treatments) + 1))

    def add(session: Session) -> None:
        take_advisory_lock(session, plan_turn(name))
        if session.scalar(select(Plan.id).where(Plan.name == name)) is not None:
            raise PlanExistsError(f"plan {name!r} is in the store already; choose another name")
        plan = Plan(
            name=name,
            kind=design.space.kind,
            factors=factors,
            method=design.method,
            seed=design.seed,
            description=description,
        )
        session.add(plan)
        session.flush()
        _add_runs(session, plan, design.rows, numbers, 0, repetitions, settings)

    store.write(add)


def extend_plan(
    store: Store,
    name: str,
    rows: Sequence[Mapping[str, str]],
    *,
    repetitions: int,
    settings: Sequence[Settings] | None = None,
) -> list[int]:
    """Add runs after the last ones of plan `name`; returns their numbers. Raises as `add_plan` does."""

    def extend(session: Session) -> list[int]:
        take_advisory_lock(session, plan_turn(name))
        plan = _plan_row(session, name)
        last = select(func.max(PlannedRun.run), func.max(PlannedRun.position)).where(PlannedRun.plan_id == plan.id)
        run, position = session.execute(last).one()
        numbers = [(run or 0) + 1 + i for i in range(len(rows))]
        _add_runs(session, plan, rows, numbers, position or 0, repetitions, settings)
        return numbers

    return store.write(extend)


def read_plan(session: Session, name: str) -> StoredPlan:
    """The plan called `name`. Raises `UnknownPlanError`."""
    plan = _plan_row(session, name)
    recorded = _recorded(session, plan)
    rows = session.scalars(select(PlannedRun).where(PlannedRun.plan_id == plan.id).order_by(PlannedRun.position))
    runs = tuple(_stored_run(row, recorded.get(row.id, 0)) for row in rows)
    space = space_from_text(plan.factors)
    return StoredPlan(plan.name, plan.method, plan.seed, plan.description, plan.factors, space, runs)


def list_plans(session: Session) -> list[dict[str, Any]]:
    """Every plan with its counts of runs by state, by name."""
    states = {
        state: func.sum(case((PlannedRun.status == state, 1), else_=0)).label(state)
        for state in ("planned", "done", "discarded")
    }
    query = (
        select(Plan.name, Plan.kind, Plan.method, Plan.seed, func.count(PlannedRun.id).label("runs"), *states.values())
        .outerjoin(PlannedRun, PlannedRun.plan_id == Plan.id)
        .group_by(Plan.id)
        .order_by(Plan.name)
    )
    rows = [dict(row) for row in session.execute(query).mappings()]
    return [{**row, **{state: int(row[state] or 0) for state in states}} for row in rows]


def discard_run(store: Store, name: str, run: int, reason: str) -> None:
    """Take a run out of plan `name`, also a recorded one that is no good. Raises `UnknownPlanError`, `ValueError`."""
    tick_run(store, name, run, status="discarded", note=reason)


def tick_run(store: Store, plan_name: str, run: int, *, status: str, note: str | None = None) -> StoredRun:
    """Mark a run at the bench as "done", "discarded", or "planned" again; `note` stays with it as its reason.

    A discarded run needs a note, and so does one that goes back to planned though something was recorded of it. A
    change of status without a note drops the old one; the same status again keeps it. Raises `UnknownPlanError`,
    `ValueError` for another status, for a run that the plan has not, and where the note is missing.
    """
    if status not in STATUSES:
        raise ValueError(f"status of run {run} is {status!r}; expected one of {', '.join(STATUSES)}")
    note_text = (note or "").strip() or None
    if status == "discarded" and note_text is None:
        raise ValueError("no reason given; a discarded run needs one")

    def tick(session: Session) -> StoredRun:
        take_advisory_lock(session, plan_turn(plan_name))
        plan = _plan_row(session, plan_name)
        row = session.scalars(select(PlannedRun).filter_by(plan_id=plan.id, run=run)).one_or_none()
        if row is None:
            raise ValueError(f"plan {plan_name!r} has no run {run}")
        recorded = _recorded(session, plan).get(row.id, 0)
        if status == "planned" and row.status != "planned" and recorded and note_text is None:
            raise ValueError(
                f"run {run} of plan {plan_name!r} has {recorded} recorded repetitions; say why it is to be run again"
            )
        if status != row.status or note_text is not None:
            row.status, row.reason = status, note_text
        return _stored_run(row, recorded)

    return store.write(tick, idempotent=True)


def _stored_run(row: PlannedRun, recorded: int) -> StoredRun:
    return StoredRun(
        run=row.run,
        position=row.position,
        repetitions=row.repetitions,
        status=row.status,
        reason=row.reason,
        row=row.treatment,
        settings=row.settings,
        recorded=recorded,
    )


def _plan_row(session: Session, name: str) -> Plan:
    plan = session.scalars(select(Plan).where(Plan.name == name)).one_or_none()
    if plan is None:
        existing_names = ", ".join(session.scalars(select(Plan.name).order_by(Plan.name))) or "none"
        raise UnknownPlanError(f"no plan {name!r} in the store; there: {existing_names}")
    return plan


def _add_runs(
    session: Session,
    plan: Plan,
    rows: Sequence[Mapping[str, str]],
    numbers: Sequence[int],
    after: int,
    repetitions: int | Sequence[int],
    settings: Sequence[Settings] | None,
) -> None:
    names = material_names(session)
    wanted = [repetitions] * len(rows) if isinstance(repetitions, int) else list(repetitions)
    given = [dict(run_settings) for run_settings in settings] if settings is not None else [{} for _ in rows]
    levels = [
        _levels(number, {**row, **{column: repr(value) for column, value in more.items()}}, names)
        for row, number, more in zip(rows, numbers, given, strict=True)
    ]
    configurations = configuration_ids(session, levels)
    for index, (row, number) in enumerate(zip(rows, numbers, strict=True)):
        session.add(
            PlannedRun(
                plan_id=plan.id,
                run=number,
                position=after + index + 1,
                repetitions=wanted[index],
                configuration_id=configurations[index],
                treatment=dict(row),
                settings=given[index],
            )
        )


def _levels(number: int, row: Mapping[str, str], names: MaterialNames) -> list[RunLevel]:
    levels = []
    for column, text in row.items():
        try:
            levels.append(level_of(column, text, names))
        except LevelError as error:
            raise ValueError(f"run {number}: {column} is {text!r}; expected {error}") from error
    return levels


def _recorded(session: Session, plan: Plan) -> dict[int, int]:
    """Recorded repetitions by planned run: a gun's shots, a hammer's impacts."""
    table: type[Impact] | type[Shot] = Shot if plan.kind == "gun" else Impact
    query = (
        select(table.planned_run_id, func.count())
        .join(PlannedRun, table.planned_run_id == PlannedRun.id)
        .where(PlannedRun.plan_id == plan.id)
        .group_by(table.planned_run_id)
    )
    return {key: count for key, count in session.execute(query) if key is not None}
