"""Plans in the store: written once, read back as designs, and what became of each run."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from sqlalchemy import func, select, true
from sqlalchemy.orm import Session

from ..schema.benches import material_names
from ..schema.campaigns import STATUSES, Plan, PlannedRun, plan_turn
from ..schema.configurations import configuration_ids
from ..schema.known_factors import LevelError, MaterialNames, RunLevel, level_of
from ..schema.run_predictions import (
    QUANTITIES,
    RunPrediction,
    counting_predictions,
    lower_of,
    upper_of,
)
from ..schema.run_states import has_rejected, is_rejected, repetition_table, run_status
from ..schema.session import Store
from ..schema.transactions import take_advisory_lock
from .space import Space, space_from_text

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from .designs.base import Design

Settings = Mapping[str, float]
#: Median and the ends of the 90 % band, SI.
ExpectedBand = tuple[float, float, float]


class UnknownPlanError(LookupError):
    """The store has no plan of this name; the message lists those there are."""


class PlanExistsError(ValueError):
    """A plan of this name is in the store already."""


class NoteMissingError(ValueError):
    """What is decided about a run needs a reason."""

    #: The control of a form that the reason is written into.
    field = "note"


@dataclass(frozen=True)
class StoredRun:
    """A planned run. `row` is the treatment as the plan's table writes it; `settings` are numbers
    that follow.

    `accepted` and `rejected` are the numbers of the repetitions that were recorded, by the verdict
    of the checks. `expected` are the bands that were predicted before the first of them, by the
    name of the quantity with its unit (`velocity_m_s`).
    """

    run: int
    position: int
    repetitions: int
    status: str
    reason: str | None
    row: Mapping[str, str]
    settings: Settings
    accepted: tuple[int, ...] = ()
    rejected: tuple[int, ...] = ()
    expected: Mapping[str, ExpectedBand] = field(default_factory=dict)

    @property
    def repeats(self) -> int:
        """How many repetitions are to be recorded again, because those that were recorded are
        rejected."""
        return (
            min(len(self.rejected), self.repetitions - len(self.accepted))
            if self.status == "planned"
            else 0
        )

    @property
    def state(self) -> str:
        """The status in words, with what is recorded and what is to be repeated."""
        count = f"{len(self.accepted)} of {self.repetitions}"
        if self.status == "done":
            return "done" if len(self.accepted) >= self.repetitions else f"done with {count}"
        if self.status == "discarded" or not (self.accepted or self.rejected):
            return self.status
        words = (
            [f"{count} recorded"] if len(self.accepted) + self.repeats < self.repetitions else []
        )
        if self.repeats:
            noun = "repetition" if len(self.rejected) == 1 else "repetitions"
            verb = "is" if len(self.rejected) == 1 else "are"
            numbers = ", ".join(map(str, self.rejected))
            words.append(
                f"repeat {self.repeats} of {self.repetitions}: {noun} {numbers} {verb} rejected"
            )
        return "; ".join(words)


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
        """Treatments `(n, axes)` of the runs in some states, in order of position.

        Parameters:
            statuses: The states of the runs, of "planned", "done" and "discarded"; all runs where
                none is named.
        """
        chosen = [run.row for run in self.runs if not statuses or run.status in statuses]
        return self.space.treatments(chosen)


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
    """Store a design as a plan.

    Parameters:
        store: The store that the plan is written to.
        name: What the plan is called, as no other plan of the store is.
        factors: The TOML that the design's space is made of.
        design: The treatments in order of run, with the method and the seed that made them.
        repetitions: How often each treatment is recorded: a number for each, or one for all.
        settings: For each treatment, numbers that follow from it by the name of their column, such
            as a gun's `tank_pressure_bar`; by default there are none.
        runs: For each treatment, the number of its run; 1, 2, ... by default.
        description: What the plan is for, in words; by default nothing is said.

    Raises:
        PlanExistsError: Where the store has a plan of this name.
        ValueError: For a level that is none of the store's, such as an unknown material.
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
    """Add runs after the last ones of a plan; returns their numbers.

    Parameters:
        store: The store that has the plan.
        name: What the plan is called.
        rows: Column to level for each further run, in order of run.
        repetitions: How often each of these runs is recorded.
        settings: For each row, numbers that follow from it by the name of their column; by default
            there are none.

    Raises:
        UnknownPlanError: Where the store has no plan of this name.
        ValueError: For a level that is none of the store's, such as an unknown material.
    """

    def extend(session: Session) -> list[int]:
        take_advisory_lock(session, plan_turn(name))
        plan = _plan_row(session, name)
        last = select(func.max(PlannedRun.run), func.max(PlannedRun.position)).where(
            PlannedRun.plan_id == plan.id
        )
        run, position = session.execute(last).one()
        numbers = [(run or 0) + 1 + i for i in range(len(rows))]
        _add_runs(session, plan, rows, numbers, position or 0, repetitions, settings)
        return numbers

    return store.write(extend)


def read_plan(session: Session, name: str) -> StoredPlan:
    """The plan of a name as it stands.

    Parameters:
        session: A session of the store.
        name: What the plan is called.

    Raises:
        UnknownPlanError: Where the store has no plan of this name.
    """
    plan = _plan_row(session, name)
    runs = tuple(_stored_runs(session, plan))
    space = space_from_text(plan.factors)
    return StoredPlan(
        plan.name, plan.method, plan.seed, plan.description, plan.factors, space, runs
    )


def list_plans(session: Session) -> list[dict[str, Any]]:
    """Every plan with its counts of runs by state, by name.

    Parameters:
        session: A session of the store.

    Returns:
        For each plan its name, kind, method and seed, the number of its runs (`runs`), and of those
        in each state, by the name of the state; `repeat` is the number of planned runs with
        rejected repetitions.
    """
    columns = (Plan.id, Plan.name, Plan.kind, Plan.method, Plan.seed)
    rows = {
        row["id"]: {**row, "runs": 0, **dict.fromkeys(STATUSES, 0), "repeat": 0}
        for row in session.execute(select(*columns).order_by(Plan.name)).mappings()
    }
    states = select(PlannedRun.plan_id, run_status(), has_rejected(), func.count())
    groups = states.group_by(PlannedRun.plan_id, "run_status", "has_rejected")
    for plan, state, rejected, count in session.execute(groups):
        row = rows[plan]
        row["runs"] += count
        row[state] += count
        row["repeat"] += count if rejected and state == "planned" else 0
    return [{key: value for key, value in row.items() if key != "id"} for row in rows.values()]


def discard_run(store: Store, name: str, run: int, reason: str) -> None:
    """Take a run out of a plan, also a recorded one that is no good.

    Parameters:
        store: The store that has the plan.
        name: What the plan is called.
        run: The number of the run in the plan.
        reason: Why the run is discarded; it stays with the run.

    Raises:
        UnknownPlanError: Where the store has no plan of this name.
        NoteMissingError: For an empty reason.
        ValueError: For a run that the plan has not.
    """
    tick_run(store, name, run, status="discarded", note=reason)


def tick_run(
    store: Store, plan_name: str, run: int, *, status: str, note: str | None = None
) -> StoredRun:
    """Decide at the bench about a run.

    A run whose repetitions are all accepted is done without a decision.

    Parameters:
        store: The store that has the plan.
        plan_name: What the plan is called.
        run: The number of the run in the plan.
        status: The decision: "discarded"; "done", although fewer repetitions than planned are
            accepted; or "planned", which takes such a decision back.
        note: The reason, which stays with the run. By default there is none: a change of the
            decision then drops the old reason, and the same decision again keeps it.

    Returns:
        The run after the decision.

    Raises:
        UnknownPlanError: Where the store has no plan of this name.
        NoteMissingError: For a decision without its reason.
        ValueError: For another status, for a run that the plan has not, for "done" where nothing is
            accepted, and for "planned" where all is.
    """
    if status not in STATUSES:
        raise ValueError(
            f"status of run {run} is {status!r}; expected one of {', '.join(STATUSES)}"
        )
    note_text = (note or "").strip() or None
    if status == "discarded" and note_text is None:
        raise NoteMissingError(
            f"no reason given; say why run {run} is discarded: the reason stays with it"
        )

    def tick(session: Session) -> StoredRun:
        take_advisory_lock(session, plan_turn(plan_name))
        plan = _plan_row(session, plan_name)
        row = session.scalars(select(PlannedRun).filter_by(plan_id=plan.id, run=run)).one_or_none()
        if row is None:
            raise ValueError(f"plan {plan_name!r} has no run {run}")
        (before,) = _stored_runs(session, plan, run)
        complete = len(before.accepted) >= before.repetitions
        if status == "planned" and before.status == "done" and complete:
            raise ValueError(
                f"run {run} of plan {plan_name!r} is done: {len(before.accepted)} of "
                f"{before.repetitions} repetitions are recorded. To record one again, discard its "
                "recording; the run then asks for a repeat"
            )
        if status == "done":
            _check_done(
                plan_name, before, note_text or (row.reason if row.status == "done" else None)
            )
        # What is recorded completely needs no decision: if a recording is rejected later, the run
        # asks for a repeat.
        decision = "planned" if status == "done" and complete else status
        if decision != row.status or note_text is not None:
            row.status, row.reason = decision, note_text
            session.flush()
        (after,) = _stored_runs(session, plan, run)
        return after

    return store.write(tick, idempotent=True)


def _check_done(plan: str, run: StoredRun, note: str | None) -> None:
    """Raises `ValueError` for a run of which nothing is accepted, `NoteMissingError` where nobody
    says why it is done with less than was planned."""
    name = f"run {run.run} of plan {plan!r}"
    if not run.accepted:
        rejected = f" ({len(run.rejected)} rejected)" if run.rejected else ""
        raise ValueError(
            f"{name} is not done: 0 of {run.repetitions} repetitions are recorded and "
            f"accepted{rejected}. Ingest its recordings, or discard the run with a reason"
        )
    if len(run.accepted) < run.repetitions and note is None:
        raise NoteMissingError(
            f"{name} has {len(run.accepted)} of {run.repetitions} repetitions; ingest the others, "
            "or write a note that says why these are enough"
        )


def _stored_runs(session: Session, plan: Plan, run: int | None = None) -> Iterator[StoredRun]:
    """The runs of a plan in order of position, or one of them by its number."""
    chosen = (PlannedRun.plan_id == plan.id, true() if run is None else PlannedRun.run == run)
    table = repetition_table(plan.kind)
    query = select(PlannedRun.id, table.repetition, is_rejected(table))
    query = (
        query.join(table, table.planned_run_id == PlannedRun.id).where(*chosen).order_by(table.id)
    )
    repetitions: defaultdict[tuple[int, bool], list[int]] = defaultdict(list)
    for key, repetition, rejected in session.execute(query):
        repetitions[key, bool(rejected)].append(repetition)
    rows = session.execute(
        select(PlannedRun, run_status()).where(*chosen).order_by(PlannedRun.position)
    ).all()
    predictions = counting_predictions(session, [row.id for row, _ in rows])
    for row, status in rows:
        yield StoredRun(
            run=row.run,
            position=row.position,
            repetitions=row.repetitions,
            status=status,
            reason=row.reason,
            row=row.treatment,
            settings=row.settings,
            accepted=tuple(repetitions[row.id, False]),
            rejected=tuple(repetitions[row.id, True]),
            expected=_expected(predictions.get(row.id)),
        )


def _expected(prediction: RunPrediction | None) -> dict[str, ExpectedBand]:
    if prediction is None:
        return {}
    bands = {
        quantity: (
            getattr(prediction, quantity),
            getattr(prediction, lower_of(quantity)),
            getattr(prediction, upper_of(quantity)),
        )
        for quantity in QUANTITIES
    }
    return {quantity: band for quantity, band in bands.items() if None not in band}


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
    given = (
        [dict(run_settings) for run_settings in settings]
        if settings is not None
        else [{} for _ in rows]
    )
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
