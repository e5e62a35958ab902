"""Predictions of planned runs that were made and stored before their shots, and which of them
counts.

A prediction counts for a run if it was made before the first hit of the run was stored. Of several
that count, the newest is the prediction of the run. What is made later says nothing about a model:
it may have learned from the shot. A row is written once and stays as it is.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import CheckConstraint, ForeignKey, UniqueConstraint, select
from sqlalchemy.orm import Mapped, Session, mapped_column, relationship, undefer

from .base import Base, HasId, PlainJson, WithProvenance, in_batches
from .campaigns import Plan, PlannedRun
from .impacts import Impact, Shot
from .provenance import Tombstone

#: Quantities with columns of their own: the name is the column of the median.
QUANTITIES = ("velocity_m_s", "contact_time_s", "peak_force_n")
#: Of hits that were stored before the store kept the time: before any prediction was.
LONG_AGO = datetime(1, 1, 2, tzinfo=UTC)
#: Key of `Tombstone.stood_on`: runs that what was deleted had hits of, each with its plan and with
#: the time at which the first of them was stored.
SHOT_RUNS = "shot"


def lower_of(quantity: str) -> str:
    """The column of the lower end of a quantity's 90 % band: `velocity_lower_m_s`.

    Parameters:
        quantity: One of `QUANTITIES`.
    """
    return _with_word(quantity, "lower")


def upper_of(quantity: str) -> str:
    """The column of the upper end of a quantity's 90 % band: `velocity_upper_m_s`.

    Parameters:
        quantity: One of `QUANTITIES`.
    """
    return _with_word(quantity, "upper")


def _with_word(quantity: str, word: str) -> str:
    for unit in ("_m_s", "_s", "_n"):
        if quantity.endswith(unit):
            return f"{quantity.removesuffix(unit)}_{word}{unit}"
    raise ValueError(f"quantity {quantity!r} has no unit at its end; expected one of {QUANTITIES}")


def _whole_and_ordered(quantity: str) -> CheckConstraint:
    """All three numbers of a quantity are there, in their order, or none is."""
    lower, upper = lower_of(quantity), upper_of(quantity)
    return CheckConstraint(
        f"({quantity} IS NULL AND {lower} IS NULL AND {upper} IS NULL) OR "
        f"({lower} IS NOT NULL AND {upper} IS NOT NULL AND {quantity} IS NOT NULL "
        f"AND {lower} <= {quantity} AND {quantity} <= {upper})",
        f"{quantity}_ordered",
    )


class RunPrediction(HasId, WithProvenance, Base):
    """What a twin said of one planned run at one time: medians and the ends of 90 % bands, SI.

    A quantity that the twin could not predict is NULL, and `remarks` say why.
    """

    __tablename__ = "run_predictions"
    __table_args__ = (
        # also "the predictions of this run"
        UniqueConstraint("planned_run_id", "made_at"),
        *(_whole_and_ordered(quantity) for quantity in QUANTITIES),
        CheckConstraint("draws >= 1", "draws_positive"),
    )

    planned_run_id: Mapped[int] = mapped_column(ForeignKey("planned_runs.id"))
    made_at: Mapped[datetime]
    campaign: Mapped[str | None]  # whose bench the twin has; None for the shipped bench
    models: Mapped[dict[str, Any]]  # stage -> what answered there, with its version
    #: Effects that diagnoses had left in the twin: [{"version", "campaign", "effects"}, ...].
    adopted: Mapped[list[Any]]
    settings: Mapped[dict[str, Any]]  # column -> cell of the run, as a table of runs has them
    options: Mapped[dict[str, Any]]  # of the request, where they were not the usual ones
    draws: Mapped[int]
    seed: Mapped[int]
    velocity_m_s: Mapped[float | None]
    velocity_lower_m_s: Mapped[float | None]
    velocity_upper_m_s: Mapped[float | None]
    contact_time_s: Mapped[float | None]
    contact_time_lower_s: Mapped[float | None]
    contact_time_upper_s: Mapped[float | None]
    peak_force_n: Mapped[float | None]
    peak_force_lower_n: Mapped[float | None]
    peak_force_upper_n: Mapped[float | None]
    #: Quantity -> the values of the draws, ascending: a measured value has its rank among them.
    #: "peak_SENSOR_m_s2" are peak accelerations, which have no columns of their own.
    drawn: Mapped[dict[str, Any]] = mapped_column(deferred=True)
    #: {"q", "frequency_hz": [...], "sensors": {name: {"median", "lower", "upper": [...]}}}, m/s2.
    spectra: Mapped[dict[str, Any] | None] = mapped_column(
        PlainJson(none_as_null=True), deferred=True
    )
    warnings: Mapped[list[Any]]  # sentences: what lies beyond what the models have learned
    remarks: Mapped[list[Any]]  # sentences: what was assumed, and what was not predicted and why
    planned_run: Mapped[PlannedRun] = relationship()


def first_hits(session: Session, runs: Collection[int]) -> dict[int, datetime]:
    """When the first hit of planned runs was stored, also of one that was deleted since.

    Parameters:
        session: A session of the store.
        runs: Keys of planned runs.

    Returns:
        The time by the key of the run, `LONG_AGO` where it was not kept; a run without a hit is
        left out.
    """
    times: dict[int, datetime] = {}
    for keys in in_batches(sorted(runs)):
        for table in (Impact, Shot):
            query = select(table.planned_run_id, table.stored_at)
            for key, stored_at in session.execute(query.where(table.planned_run_id.in_(keys))):
                assert key is not None  # it is one of `keys`
                times[key] = min(times.get(key, stored_at or LONG_AGO), stored_at or LONG_AGO)
    for key, deleted_hit in _deleted_hits(session, runs):
        times[key] = min(times.get(key, deleted_hit), deleted_hit)
    return times


def _deleted_hits(session: Session, runs: Collection[int]) -> Iterator[tuple[int, datetime]]:
    """Runs of which tombstones say that they were shot, with the time."""
    named = [
        shot
        for stood_on in session.scalars(select(Tombstone.stood_on))
        if isinstance(stood_on, dict)  # a row that was altered has a finding of its own
        for shot in stood_on.get(SHOT_RUNS, ())
    ]
    if not named:
        return
    places: dict[tuple[str, int], int] = {}
    for keys in in_batches(sorted(runs)):
        query = select(Plan.name, PlannedRun.run, PlannedRun.id).join(
            Plan, PlannedRun.plan_id == Plan.id
        )
        for plan, run, key in session.execute(query.where(PlannedRun.id.in_(keys))):
            places[plan, run] = key
    for shot in named:
        place = (shot["plan"], shot["run"])
        if place in places:
            yield places[place], datetime.fromisoformat(shot["stored_at"])


def shot_runs(session: Session, runs: Collection[int]) -> list[dict[str, Any]]:
    """What a tombstone keeps of the planned runs whose hits are deleted.

    Parameters:
        session: A session of the store, which still has the hits.
        runs: Keys of the planned runs.

    Returns:
        For each run its plan, its number and when its first hit was stored, as ISO 8601.
    """
    times = first_hits(session, runs)
    query = select(Plan.name, PlannedRun.run, PlannedRun.id).join(
        Plan, PlannedRun.plan_id == Plan.id
    )
    return [
        {"plan": plan, "run": run, "stored_at": times[key].isoformat()}
        for plan, run, key in session.execute(
            query.where(PlannedRun.id.in_(times)).order_by(PlannedRun.id)
        )
    ]


def counting_predictions(
    session: Session, runs: Collection[int], *, with_draws: bool = False
) -> dict[int, RunPrediction]:
    """The prediction that counts of each planned run: the newest that was made before the run's
    first hit was stored.

    Parameters:
        session: A session of the store.
        runs: Keys of planned runs.
        with_draws: Whether the values of the draws are read at once; by default they are read when
            they are asked for.

    Returns:
        The prediction by the key of its run; a run that has none is left out.
    """
    counting: dict[int, RunPrediction] = {}
    predictions = list(_of_runs(session, runs, with_draws=with_draws))
    times = first_hits(session, {row.planned_run_id for row in predictions})
    for row in predictions:
        first_hit = times.get(row.planned_run_id)
        if first_hit is None or row.made_at < first_hit:
            counting[row.planned_run_id] = row
    return counting


def late_predictions(session: Session, runs: Collection[int]) -> list[RunPrediction]:
    """Predictions that were made when a hit of their run was stored already; they do not count.

    Parameters:
        session: A session of the store.
        runs: Keys of planned runs.
    """
    predictions = list(_of_runs(session, runs))
    times = first_hits(session, {row.planned_run_id for row in predictions})
    return [
        row
        for row in predictions
        if row.planned_run_id in times and row.made_at >= times[row.planned_run_id]
    ]


def _of_runs(
    session: Session, runs: Collection[int], *, with_draws: bool = False
) -> Iterator[RunPrediction]:
    """The predictions of runs, of each run the oldest first."""
    read_at_once = [undefer(RunPrediction.drawn)] if with_draws else []
    for keys in in_batches(sorted(runs)):
        query = (
            select(RunPrediction)
            .options(*read_at_once)
            .where(RunPrediction.planned_run_id.in_(keys))
            .order_by(RunPrediction.planned_run_id, RunPrediction.made_at, RunPrediction.id)
        )
        yield from session.scalars(query)
