"""A small store with a row in every table that a campaign can have, and copies of it that a test
may damage."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from pyroshock.dataset.snapshot import build_snapshot
from pyroshock.ingest.extraction.settings import ExtractionSettings
from pyroshock.ingest.storing.plan_link import link_campaign
from pyroshock.ingest.storing.reextraction import reextract_recording
from pyroshock.schema.attached_files import store_content
from pyroshock.schema.attachments import Attachment
from pyroshock.schema.campaigns import Campaign, Plan, PlannedRun
from pyroshock.schema.corrections import FactCorrection
from pyroshock.schema.diagnoses import Diagnosis, TwinVersion
from pyroshock.schema.engine import make_engine
from pyroshock.schema.impacts import Impact
from pyroshock.schema.jobs import Job
from pyroshock.schema.person_roles import SYSTEM
from pyroshock.schema.provenance import Tombstone
from pyroshock.schema.recordings import QualityFinding, RecordedChannel, Recording
from pyroshock.schema.registered_models import RegisteredVersion
from pyroshock.schema.row_sealing import seal_table
from pyroshock.schema.run_predictions import RunPrediction
from pyroshock.schema.session import Store
from pyroshock.schema.tables import metadata
from pyroshock.schema.transfer.copying import copy_store
from sqlalchemy import select, text

from support.records.campaigns import (
    blows,
    force_record,
    gun_campaign,
    hammer_campaign,
    recording_name,
    write_recording,
)
from support.stores.hammer_stores import HITS, full_campaign, url_of
from support.stores.stores import ingested, opened

#: What is attached to the campaign of the hammer.
DOCUMENT = b"certificate of the load cell: 1.000 +- 0.005\n"
HAMMER, GUN, OTHER = "spring", "gun", "autumn"
RECORDINGS = 2
WHEN = dt.datetime(2026, 3, 2, 12, 30, 15, 250, tzinfo=dt.timezone(dt.timedelta(hours=2)))

_SENSOR = """
[channels.acceleration_1]
quantity = "acceleration"
unit = "g"
position = "plate"

[known]
sensor.force_gain.gain = { value = 1.0, u = 0.005, \
source = "certificate of the load cell", date = 2025-11-30 }
"""
_MODES = """\
mode,frequency_hz,damping_ratio,shape_impact,shape_acceleration_1
1,310,0.01,0.4,-0.25
2,640,0.012,0.3,0.35
"""


def care_folder(folder: Path) -> Path:
    """A campaign of force and acceleration on a plate with a modal table: ten impacts in two
    recordings."""
    full_campaign(folder, HAMMER, RECORDINGS)
    card = folder / "campaign.toml"
    card.write_text(
        card.read_text().replace("[bench.plate]", '[bench.plate]\nmodes = "plate_modes.csv"')
        + _SENSOR
    )
    (folder / "plate_modes.csv").write_text(_MODES)
    for number in range(1, RECORDINGS + 1):
        rng = np.random.default_rng(number)
        force = force_record(blows(number, HITS), rng)
        noise = rng.standard_normal(force.size).astype(np.float32)
        write_recording(folder / recording_name(number), {"force": force, "acceleration_1": noise})
    return folder


def fill(folder: Path) -> None:
    """Make `lab.db` in `folder`, and the campaign folders beside it that it is filled from."""
    url = url_of(folder / "lab.db")
    other = hammer_campaign(folder / OTHER, 1, 1, OTHER)
    ingested(url, care_folder(folder / HAMMER), gun_campaign(folder / GUN, 2), other)
    with opened(url) as store:
        _fill(store)
    with closing(
        make_engine(url).raw_connection()
    ) as connection:  # into one file, which is easily copied
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")


def _fill(store: Store) -> None:
    for key in range(1, RECORDINGS + 1):
        assert reextract_recording(store, key, ExtractionSettings(threshold=0.05)).added == HITS
    build_snapshot(store, "small", [HAMMER])
    with store.writing() as session:
        campaign = session.scalars(select(Campaign).where(Campaign.name == HAMMER)).one()
        runs = select(Impact.run, Impact.configuration_id).where(Impact.campaign_id == campaign.id)
        configurations = dict(iter(session.execute(runs.distinct())))
        plan = Plan(name=HAMMER, kind="hammer", factors="", method="import", seed=2**30)
        session.add(plan)
        session.flush()
        planned: dict[str, Any] = {"plan_id": plan.id, "repetitions": HITS, "treatment": {"a": "b"}}
        for run in (1, 2, 3):
            key = configurations[min(run, RECORDINGS)]
            row = PlannedRun(
                **planned,
                run=run,
                position=run,
                configuration_id=key,
                settings={"velocity": 1.5},
            )
            session.add(row)
            session.flush()
            if run != 2:  # one that was shot since, and one that was not
                session.add(run_prediction(row.id))
        cause = {"effects": ["none"], "probability": float("nan")}
        gap = {"before": -0.0, "noise_floor": float("inf"), "metric": "„ü“"}
        report = {"causes": [cause], "gap": gap}
        diagnosis = Diagnosis(
            campaign_id=campaign.id, simulator="hertz", diagnosed_at=WHEN, report=report
        )
        session.add(diagnosis)
        session.flush()
        session.add(
            TwinVersion(version=1, campaign_id=campaign.id, diagnosis_id=diagnosis.id,
            adopted_at=WHEN, reason="r",
                        configuration={"stages": [], "effects": []})
        )  # fmt: skip
        recording = session.scalars(
            select(Recording).where(Recording.campaign_id == campaign.id)
        ).first()
        assert recording is not None
        channel = session.scalars(
            select(RecordedChannel).where(RecordedChannel.recording_id == recording.id)
        ).first()
        assert channel is not None
        session.add(
            QualityFinding(recording_id=recording.id, channel_id=channel.id, check="rest",
            severity="note",
                           message="m", evidence={"share": 0.1})
        )  # fmt: skip
        session.add(
            Tombstone(kind="campaign", campaign="winter", content_hash="0" * 64, deleted_at=WHEN,
            reason="r", counts={},
                      stood_on={"datasets": [], "models": [], "diagnoses": [], "adopted": [],
                      "reopened": []})
        )  # fmt: skip
        session.add(
            FactCorrection(
                campaign_id=campaign.id,
                fact="tip_radius_mm",
                earlier=[{"value": "10", "hits": [[1, 1]]}],
                value="12",
                reason="measured anew",
                corrected_at=WHEN,
            )
        )
        about = {"subject_kind": "campaign", "subject": HAMMER, "author": "a"}
        session.add(
            Attachment(
                **about,
                author_kind=SYSTEM,
                content_id=store_content(session, DOCUMENT).id,
                file_name="sensor.txt",
                attached_at=WHEN,
            )
        )
        session.add(Job(kind="ingest", label="l", arguments={"folder": "x"}, asked_at=WHEN))
    link_campaign(store, HAMMER, HAMMER)


def run_prediction(planned_run: int, made_at: dt.datetime = WHEN, **values: Any) -> RunPrediction:
    """A prediction of a run with a value in every column; `values` are other ones."""
    band = {"median": [90.0, 140.5], "lower": [80.0, 120.0], "upper": [99.0, 170.0]}
    usual: dict[str, Any] = {
        "campaign": HAMMER,
        "models": {"gun": "none", "contact": "tree@1", "plate": "modal table"},
        "adopted": [{"version": 1, "campaign": HAMMER, "effects": ["contact.layer_compliance"]}],
        "settings": {"tip_material": "steel"},
        "options": {"contact": "tree@1"},
        "draws": 4,
        "seed": 0,
        "velocity_m_s": 1.5,
        "velocity_lower_m_s": 1.4,
        "velocity_upper_m_s": 1.6,
        "contact_time_s": 2e-4,
        "contact_time_lower_s": 1.5e-4,
        "contact_time_upper_s": 2.5e-4,
        "peak_force_n": 900.0,
        "peak_force_lower_n": 800.0,
        "peak_force_upper_n": 1000.0,
        "drawn": {
            "velocity_m_s": [1.4, 1.5, 1.5, 1.6],
            "contact_time_s": [1.5e-4, 2e-4, 2e-4, 2.5e-4],
            "peak_force_n": [800.0, 900.0, 900.0, 1000.0],
        },
        "spectra": {"q": 10.0, "frequency_hz": [100.0, 200.0], "sensors": {"a": band}},
        "warnings": ["the velocity lies beyond the shots that the model learned from"],
        "remarks": ["the plate is that of the bench"],
    }
    return RunPrediction(planned_run_id=planned_run, made_at=made_at, **(usual | values))


def registered_version() -> RegisteredVersion:
    """A version that no registry has: a check with a registry would tell it."""
    return RegisteredVersion(
        label="linear@1",
        name="linear",
        version=1,
        dataset=HAMMER,
        dataset_hash="0" * 64,
        sha256="1" * 64,
        registry_address="sqlite:///lab-models.db",
        registered_at=WHEN,
        record={"run_id": "r", "model_id": "m", "tags": {}},
    )


def copied(
    source: str, target: str, progress: Callable[[int, int, str], None] | None = None
) -> list[Any]:
    """`copy_store` between addresses."""
    engine = make_engine(target)
    try:
        with opened(source) as store:
            return copy_store(store, engine, progress)
    finally:
        engine.dispose()


def execute(
    url: str, *statements: str, keys: bool = True, sealed: bool = False, **values: Any
) -> None:
    """SQL that no rule of ours sees; in SQLite with foreign keys switched off where `keys` is
    False.

    With `sealed`, the rows get the hashes of what they hold now: as one would do who forges.
    """
    engine = make_engine(url)
    with engine.connect() as connection:
        if not keys:
            connection.connection.execute("PRAGMA foreign_keys = OFF")
        with connection.begin():
            for statement in statements:
                connection.execute(text(statement), values)
            if sealed:
                for table in metadata.sorted_tables:
                    seal_table(connection, table)
    engine.dispose()


def flip(url: str, table: str, column: str, where: str, at: int) -> None:
    """Change one byte of a stored frame."""
    engine = make_engine(url)
    with engine.begin() as connection:
        row = connection.execute(text(f"SELECT {column} FROM {table} WHERE {where}")).scalar_one()
        changed = bytearray(row)
        changed[at] ^= 0xFF
        connection.execute(
            text(f"UPDATE {table} SET {column} = :frame WHERE {where}"), {"frame": bytes(changed)}
        )
    engine.dispose()
