"""Repetitions of planned runs as an ingest leaves them in a store, and findings of the checks on
them."""

from __future__ import annotations

import datetime as dt
from collections.abc import Iterable
from typing import Any

from pyroshock.schema.campaigns import Campaign, Plan, PlannedRun
from pyroshock.schema.impacts import Impact, Shot
from pyroshock.schema.recordings import STORED, QualityFinding, RecordedChannel, Recording
from pyroshock.schema.run_states import repetition_table
from pyroshock.schema.session import Store
from pyroshock.schema.transactions import get_or_add
from sqlalchemy import select
from sqlalchemy.orm import Session

#: A channel whose samples nobody reads.
_CHANNEL = {
    "unit": "V", "si_unit": "V", "si_gain": 1.0, "si_offset": 0.0, "sampling_rate_hz": 1e5,
    "start_s": 0.0,
    "samples": 1, "dtype": "<f4", "chunk_samples": 1, "sha256": "0" * 64, "header": {},
}  # fmt: skip
_SHOT = {"tank_pressure_pa": 1e5, "bullet_mass_kg": 0.5}


def record_run(
    store: Store,
    plan: str,
    run: int,
    repetitions: Iterable[int] = (1,),
    stored_at: dt.datetime | None = None,
    **columns: Any,
) -> None:
    """Shots or impacts of a planned run, each with a recording of its own, in a campaign of the
    plan's name; stored at this time, by default now. `columns` are values of theirs."""
    with store.writing() as session:
        planned, kind = _planned(session, plan, run)
        values = {"kind": kind, "date": dt.date(2026, 1, 2), "fingerprint": plan}
        campaign = get_or_add(session, Campaign, {"name": plan}, values)
        for repetition in repetitions:
            path = f"run-{run}-{repetition}.npz"
            recording = Recording(
                campaign_id=campaign.id, path=path, sha256=path.rjust(64, "0"), size_bytes=1,
                format="npz",
                status=STORED,
            )  # fmt: skip
            session.add(recording)
            session.flush()
            table = repetition_table(kind)
            session.add(
                table(
                    campaign_id=campaign.id, configuration_id=planned.configuration_id,
                    planned_run_id=planned.id,
                    recording_id=recording.id, run=run, repetition=repetition,
                    stored_at=stored_at or dt.datetime.now(dt.UTC),
                    **((_SHOT if table is Shot else {}) | columns),
                )
            )  # fmt: skip


def find_fault(
    store: Store, plan: str, run: int, repetition: int, severity: str = "reject", quantity: str = ""
) -> None:
    """A check finds fault with the recording of a repetition, or with a channel of this quantity in
    it."""
    with store.writing() as session:
        planned, kind = _planned(session, plan, run)
        table: type[Impact] | type[Shot] = repetition_table(kind)
        key = session.scalars(
            select(table.recording_id).where(
                table.planned_run_id == planned.id, table.repetition == repetition
            )
        ).one()
        finding = {"check": "clipping", "severity": severity, "message": "cut off", "evidence": {}}
        channel = None
        if quantity:
            channel = RecordedChannel(
                recording_id=key, name=f"{quantity}-{repetition}", quantity=quantity, **_CHANNEL
            )
            session.add(channel)
            session.flush()
        session.add(QualityFinding(recording_id=key, channel_id=channel and channel.id, **finding))


def _planned(session: Session, plan: str, run: int) -> tuple[PlannedRun, str]:
    query = select(PlannedRun, Plan.kind).join(Plan, PlannedRun.plan_id == Plan.id)
    planned, kind = session.execute(query.where(Plan.name == plan, PlannedRun.run == run)).one()
    return planned, kind
