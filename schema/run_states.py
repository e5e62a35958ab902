"""The state of a planned run, which follows from what was recorded for it and from what a person
decided about it.

Of `planned_runs`, `status` and `reason` hold the decision alone: "discarded", or "done" with the
reason why fewer repetitions than planned are enough, or "planned" where nothing was decided.
Whether a run is done is asked here.
"""

from __future__ import annotations

from collections.abc import Collection

from sqlalchemy import ColumnElement, Label, ScalarSelect, and_, case, exists, func, or_, select
from sqlalchemy.orm import Session

from .campaigns import Plan, PlannedRun
from .impacts import Impact, Shot
from .recordings import REJECT, QualityFinding, RecordedChannel


def repetition_table(kind: str) -> type[Impact] | type[Shot]:
    """What a repetition of a plan of this kind is: a gun's shot, a hammer's impact."""
    return Shot if kind == "gun" else Impact


def is_rejected(table: type[Impact] | type[Shot]) -> ColumnElement[bool]:
    """Whether a check rejects an impact or a shot, so that a dataset leaves it out by its usual
    rule.

    A finding counts that is on the hit itself, on its recording as a whole, or on the force of its
    recording. An accelerometer that failed over the whole recording does not count: the pulse of
    the hit is good.
    """
    impact = Impact.id if table is Impact else Shot.impact_id
    forces = select(RecordedChannel.id).where(
        RecordedChannel.recording_id == QualityFinding.recording_id,
        RecordedChannel.quantity == "force",
    )
    of_the_recording = and_(
        QualityFinding.impact_id.is_(None),
        or_(
            QualityFinding.channel_id.is_(None),
            QualityFinding.channel_id.in_(forces.correlate(QualityFinding)),
        ),
    )
    return exists().where(
        QualityFinding.recording_id == table.recording_id,
        QualityFinding.severity == REJECT,
        or_(QualityFinding.impact_id == impact, of_the_recording),
    )


def accepted_repetitions() -> ColumnElement[int]:
    """Of each `PlannedRun` of a query, the repetitions that were recorded and that no check
    rejects."""
    return _count(rejected=False)


def run_status() -> Label[str]:
    """Of each `PlannedRun` of a query: "discarded", "done" or "planned", as the column
    "run_status".

    A run is done when as many repetitions as planned are accepted, or when a person has given the
    reason why fewer are enough, as long as one of them is accepted.
    """
    accepted = accepted_repetitions()
    fewer_are_enough = and_(
        PlannedRun.status == "done", PlannedRun.reason.is_not(None), accepted > 0
    )
    return case(
        (PlannedRun.status == "discarded", "discarded"),
        (or_(accepted >= PlannedRun.repetitions, fewer_are_enough), "done"),
        else_="planned",
    ).label("run_status")


def has_rejected() -> Label[bool]:
    """Of each `PlannedRun` of a query, whether repetitions are rejected, as the column
    "has_rejected"."""
    return (_count(rejected=True) > 0).label("has_rejected")


def done_runs(session: Session, keys: Collection[int]) -> set[int]:
    """Those of the planned runs with these keys that are done."""
    return set(
        session.scalars(
            select(PlannedRun.id).where(PlannedRun.id.in_(keys), run_status() == "done")
        )
    )


def _count(*, rejected: bool) -> ColumnElement[int]:
    kind = (
        select(Plan.kind)
        .where(Plan.id == PlannedRun.plan_id)
        .correlate(PlannedRun)
        .scalar_subquery()
    )
    return case((kind == "gun", _count_in(Shot, rejected)), else_=_count_in(Impact, rejected))


def _count_in(table: type[Impact] | type[Shot], rejected: bool) -> ScalarSelect[int]:
    quality = is_rejected(table) if rejected else ~is_rejected(table)
    query = (
        select(func.count())
        .select_from(table)
        .where(table.planned_run_id == PlannedRun.id, quality)
    )
    return query.correlate(PlannedRun).scalar_subquery()
