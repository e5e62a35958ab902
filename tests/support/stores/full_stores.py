"""A small store that holds a value in every column of every table."""

from __future__ import annotations

import datetime as dt
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from pyroshock.schema.campaign_counts import recount
from pyroshock.schema.column_kinds import JSON_TEXT, NUMBER, TEXT, TIME, kind_of
from pyroshock.schema.engine import make_engine
from pyroshock.schema.home_pictures import HomePictureRow
from pyroshock.schema.impacts import Impact, Shot
from pyroshock.schema.jobs import DONE, FAILED, Job
from pyroshock.schema.provenance import RECORDING, Tombstone
from pyroshock.schema.recordings import QualityFinding, Recording
from pyroshock.schema.saved_views import SavedView
from pyroshock.schema.tables import metadata
from sqlalchemy import func, select, update
from sqlalchemy.orm import Session

from support.records.campaigns import (
    blows,
    force_record,
    hammer_campaign,
    recording_name,
    write_recording,
)
from support.stores.care_stores import WHEN, fill, registered_version
from support.stores.hammer_stores import url_of
from support.stores.people_rows import add_people_rows
from support.stores.stores import ingested, opened

#: Of a column that no row of these stores has a value in: one that no rule of its table forbids.
_VALUES: dict[str, Any] = {NUMBER: 0.5, TEXT: "words", JSON_TEXT: {"a": [1.5, None]}, TIME: WHEN}


def fill_every_column(folder: Path) -> None:
    """Make `lab.db` in `folder`, one file, by the software's own doors alone."""
    fill(folder)
    url = url_of(folder / "lab.db")
    ingested(url, _counts_campaign(folder / "winter"))
    with opened(url) as store, store.writing() as session:
        _add_rows(session)
        add_people_rows(session, "spring")
        session.flush()
        recount(session)
        for column in _empty_columns(session):
            table = column.table
            first = select(func.min(table.c.id)).scalar_subquery()
            session.execute(
                update(table)
                .where(table.c.id == first)
                .values({column.name: _VALUES[kind_of(column)]})
            )
    with closing(make_engine(url).raw_connection()) as connection:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")


def _counts_campaign(folder: Path) -> Path:
    """A campaign whose samples are multiples of a step, as a converter of 16 bits gives them."""
    hammer_campaign(folder, 1, 1, "winter")
    force = force_record(blows(1, 1), np.random.default_rng(5))
    write_recording(
        folder / recording_name(1), {"force": (np.round(force * 8) / 8 + 0.0).astype(np.float32)}
    )
    return folder


def _add_rows(session: Session) -> None:
    """Rows whose values depend on each other."""
    impact = session.scalars(
        select(Impact).where(Impact.planned_run_id.is_not(None)).order_by(Impact.id)
    ).first()
    recording = session.scalars(select(Recording).where(Recording.id == impact.recording_id)).one()
    ended = {
        "kind": "extract",
        "label": "l",
        "arguments": {},
        "attempt": 1,
        "worker": "bench:1:0",
        "lease_s": 30.0,
    }
    times = {"asked_at": WHEN, "started_at": WHEN, "ended_at": WHEN + dt.timedelta(seconds=5)}
    session.add_all(
        (
            Shot(
                campaign_id=impact.campaign_id,
                run=impact.run,
                repetition=impact.repetition,
                configuration_id=impact.configuration_id,
                recording_id=recording.id,
                planned_run_id=impact.planned_run_id,
                impact_id=impact.id,
                tank_pressure_pa=2e5,
                bullet_mass_kg=0.1,
                stored_at=impact.stored_at,
            ),
            QualityFinding(
                recording_id=recording.id,
                impact_id=impact.id,
                check="rest",
                severity="note",
                message="m",
                evidence={},
            ),
            Job(
                **ended,
                **times,
                state=DONE,
                address="/campaigns/spring",
                words="w",
                result=[1, 2.5],
                host="bench",
            ),
            Job(**ended, **times, state=FAILED, error="e"),
            registered_version(),
            HomePictureRow(picture="runs-by-plan", position=1),
            SavedView(name="view", creator="c", request={"x": "run"}, saved_at=WHEN),
            Tombstone(
                kind=RECORDING,
                campaign="spring",
                recording="recordings/first.npz",
                content_hash="1" * 64,
                deleted_at=WHEN,
                reason="r",
                counts={"impacts": 1},
                stood_on={
                    "datasets": [],
                    "models": [],
                    "diagnoses": [],
                    "adopted": [],
                    "reopened": [],
                },
                file_sha256="2" * 64,
                replaced_by=recording.sha256,
            ),
            Tombstone(
                kind="campaign",
                campaign="winter",
                content_hash="3" * 64,
                deleted_at=WHEN,
                reason="r",
                counts={},
                stood_on={
                    "datasets": [],
                    "models": [],
                    "diagnoses": [],
                    "adopted": [],
                    "reopened": [],
                },
                archive_path="/archive/winter.pyroshock",
                archive_sha256="4" * 64,
                restored_at=WHEN,
            ),
        )
    )


def _empty_columns(session: Session) -> list[Any]:
    """Columns in which no row has a value."""
    return [
        column
        for table in metadata.sorted_tables
        for column in table.columns
        if session.scalar(select(func.count()).select_from(table).where(column.is_not(None))) == 0
    ]
