"""Rows that are here already and yet take something on: what the other laboratory knows further."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum, auto
from typing import Any

from sqlalchemy import Connection, select, update

from ..impacts import Impact, Pulse
from ..plans import PlannedRun
from ..recordings import Recording
from ..shots import Shot
from .merge_rules import Row

Writer = Callable[[], int]


class Settled(Enum):
    """What became of a row whose key is here: nothing yet, it is `KNOWN`, or it was `REPLACED` by the better one."""

    NEW, OPEN, KNOWN, REPLACED = auto(), auto(), auto(), auto()


def _recording(target: Connection, row: Row, here: Row, writer: Writer) -> Settled:
    """A recording that one side set aside is the other's: a stored one counts."""
    if row["status"] != "stored":
        return Settled.KNOWN
    if here["status"] == "stored":
        return Settled.OPEN
    better = {name: row[name] for name in ("sha256", "size_bytes", "format", "status", "reason")}
    target.execute(update(Recording).where(Recording.id == here["id"]).values(**better, written_by_id=writer()))
    return Settled.REPLACED


def _planned_run(target: Connection, row: Row, here: Row, _: Writer) -> Settled:
    """What was still to do here and is done there is done."""
    if here["status"] == "planned" and row["status"] != "planned":
        values = {"status": row["status"], "reason": row["reason"]}
        target.execute(update(PlannedRun).where(PlannedRun.id == here["id"]).values(**values))
    return Settled.OPEN


def _linked(model: type[Impact] | type[Shot]) -> Callable[[Connection, Row, Row, Writer], Settled]:
    """A hit that nobody here has linked to its planned run is linked as there."""

    def settle(target: Connection, row: Row, here: Row, _: Writer) -> Settled:
        if here["planned_run_id"] is None and row["planned_run_id"] is not None:
            target.execute(update(model).where(model.id == here["id"]).values(planned_run_id=row["planned_run_id"]))
        return Settled.OPEN

    return settle


#: Table -> what is done first for a row whose key is here.
SETTLED: dict[str, Callable[[Connection, Any, Row, Writer], Settled]] = {
    "recordings": _recording,
    "planned_runs": _planned_run,
    "impacts": _linked(Impact),
    "shots": _linked(Shot),
}


def leave_in_use(target: Connection, rows: list[dict[str, Any]]) -> None:
    """New versions of pulses do not push aside those that are in use here."""
    current_impacts = {row["impact_id"] for row in rows if row["current"]}
    used: set[int] = set()
    if current_impacts:  # at most a batch of them
        used = set(target.scalars(select(Pulse.impact_id).where(Pulse.impact_id.in_(current_impacts), Pulse.current)))
    for row in rows:
        row["current"] = row["current"] and row["impact_id"] not in used
