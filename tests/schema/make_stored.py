"""Makes the stored database of the newest revision: run it once when a revision is added, and
commit the file.

    python tests/schema/make_stored.py

The database holds a hammer campaign of two recordings with two hits each, and the shipped gun shots
with two diagnoses (one with details) and what was adopted from the first, a job that waits beside
one that is done, a tombstone, and what people have left (a user with a password and a token, rows
of the audit trail, notes, a tag and a saved filter), so that an upgrade is tried on every kind of
row that they write.
It is deflated: SQLite pages are mostly air.
"""

from __future__ import annotations

import sys
import tempfile
import zlib
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from pyroshock.app.operations.diagnose.stored import verdict_to_json
from pyroshock.diagnosis.verdict import Cause, GapSize, Pictures, ResidualPicture, Verdict, Where
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.campaigns import Configuration, Plan, PlannedRun
from pyroshock.schema.corrections import FactCorrection
from pyroshock.schema.diagnoses import Diagnosis, TwinVersion
from pyroshock.schema.home_pictures import HomePictureRow
from pyroshock.schema.jobs import DONE, Job
from pyroshock.schema.listings import get_campaign_id
from pyroshock.schema.migrate import HEAD
from pyroshock.schema.provenance import Tombstone
from pyroshock.schema.registered_models import RegisteredVersion
from pyroshock.schema.run_predictions import RunPrediction
from pyroshock.schema.saved_views import SavedView
from pyroshock.schema.session import Store, Writer, open_store
from sqlalchemy import select

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))  # `support`, where this file is run by itself

from support.stores.people_rows import add_people_rows  # noqa: E402  # its folder comes first

EXAMPLES = HERE.parents[1] / "examples"
SHOWN = np.array([0.04])

CAMPAIGN = """
[campaign]
name = "stored"
kind = "hammer"
date = "2026-01-02"

[bench.hammer]
mass_kg = 0.32

[bench.plate]
modes = "plate_modes.csv"

[channels.force]
quantity = "force"
unit = "N"

[channels.acceleration]
quantity = "acceleration"
unit = "g"

[known]
sensor.force_gain.gain = { value = 1.0, u = 0.005, \
source = "certificate of the load cell", date = 2025-11-30 }
"""

RUNS = """run,repetition,tip_material,tip_radius_mm,hammer_speed,operator_mood,recording
1,1,steel,30,low,good,1.npz
2,1,delrin,45,high,,2.npz
"""

MODES = """mode,frequency_hz,damping_ratio,shape_impact,shape_acceleration
1,231,0.004,-0.27,0.31
2,402,0.005,0.02,-0.1
"""


def write_campaign(folder: Path) -> None:
    """The small hammer campaign."""
    rng = np.random.default_rng(7)
    time = np.arange(8000) / 20000
    for name, peak in (("1.npz", 800.0), ("2.npz", 300.0)):
        force = sum(
            peak * np.where(abs(time - t) < 4e-4, np.cos((time - t) / 4e-4 * np.pi / 2), 0)
            for t in (0.1, 0.3)
        )
        force = np.asarray(force + rng.normal(size=time.size) * 0.2, dtype=np.float32)
        np.savez(
            folder / name, force=force, acceleration=(force / 9.81).astype(np.float32), fs=20000.0
        )
    (folder / "campaign.toml").write_text(CAMPAIGN)
    (folder / "runs.csv").write_text(RUNS)
    (folder / "plate_modes.csv").write_text(MODES)


def add_diagnosis(store: Store) -> None:
    """A report on the shots, and the effect that was adopted from it."""
    when = datetime(2026, 1, 3, tzinfo=UTC)
    with store.writing() as session:
        shots = get_campaign_id(session, "first-shots")
        report = Diagnosis(
            campaign_id=shots, simulator="gun:adiabatic", diagnosed_at=when, report={"causes": []}
        )
        session.add(report)
        session.flush()
        effect = {"id": "gun.back_pressure"}
        configuration = {"stages": ["gun"], "effects": [effect], "sources": {}}
        version = TwinVersion(version=1, campaign_id=shots, diagnosis_id=report.id, adopted_at=when,
        reason="stored",
                              configuration=configuration)  # fmt: skip
        session.add(version)
        session.add(_with_details(shots, when))


def _with_details(campaign_id: int, when: datetime) -> Diagnosis:
    """A diagnosis as it is kept, pictures and all."""
    pictures = Pictures(
        ("0.3 bar",), (ResidualPicture("ln_velocity", "gun", "1", 0.01, SHOWN, None, SHOWN),)
    )
    gap = GapSize("rms error of velocity", 0.04, 0.01, 0.01, True)
    causes = (Cause(("unknown",), 0.9), Cause(("none",), 0.1))
    made = Verdict(
        "first-shots", "gun:adiabatic", gap, Where(), causes, seconds=1.0, pictures=pictures
    )
    report, details = verdict_to_json(made)
    return Diagnosis(
        campaign_id=campaign_id,
        simulator=made.simulator,
        diagnosed_at=when,
        report=report,
        details=details,
    )


def add_jobs(store: Store) -> None:
    """One that waits, and one that an earlier worker has done."""
    when = datetime(2026, 1, 4, tzinfo=UTC)
    kind, arguments = "extract", {"campaign": "stored", "settings": {}}
    with store.writing() as session:
        session.add(
            Job(kind=kind, label="Extraction of stored", arguments=arguments, asked_at=when)
        )
        session.add(
            Job(
                kind=kind,
                label="Extraction of stored",
                arguments=arguments,
                state=DONE,
                attempt=1,
                worker="bench:1:0",
                address="/campaigns/stored",
                result={"campaign": "stored", "added": 4},
                asked_at=when,
                started_at=when,
                ended_at=when,
            )
        )


def add_tombstone(store: Store) -> None:
    """A campaign that was there once."""
    when = datetime(2026, 1, 5, tzinfo=UTC)
    stood_on: dict[str, list[str]] = {
        "datasets": [],
        "models": [],
        "diagnoses": [],
        "adopted": [],
        "reopened": [],
    }
    with store.writing() as session:
        session.add(
            Tombstone(kind="campaign", campaign="gone", content_hash="0" * 64, deleted_at=when,
            reason="a test",
                      counts={"impacts": 2}, stood_on=stood_on)
        )  # fmt: skip


def add_registered_version(store: Store) -> None:
    """A version of a model whose registry is elsewhere."""
    with store.writing() as session:
        session.add(
            RegisteredVersion(label="linear@1", name="linear", version=1, dataset="stored",
            dataset_hash="0" * 64,
                              sha256="1" * 64, registry_address="sqlite:///lab-models.db",
                              registered_at=datetime(2026, 1, 6, tzinfo=UTC),
                              record={"run_id": "r", "model_id": "m", "tags": {}})
        )  # fmt: skip


def add_saved_views(store: Store) -> None:
    """One that is in use, and one that was deleted and left its name to it."""
    when = datetime(2026, 1, 7, tzinfo=UTC)
    with store.writing() as session:
        for deleted in (when, None):
            session.add(
                SavedView(
                    name="force by velocity",
                    request={"x": "impact_velocity_m_s", "y": "peak_force_n"},
                    saved_at=when,
                    deleted_at=deleted,
                )
            )


def add_home_pictures(store: Store) -> None:
    with store.writing() as session:
        session.add(HomePictureRow(picture="runs-by-plan", position=1))


def add_correction(store: Store) -> None:
    """A fact of the small campaign that was corrected."""
    with store.writing() as session:
        session.add(
            FactCorrection(
                campaign_id=get_campaign_id(session, "stored"),
                fact="tip_radius_mm",
                earlier=[{"value": "30", "hits": [[1, 1], [1, 2]]}],
                value="31",
                reason="measured anew",
                corrected_at=datetime(2026, 1, 7, tzinfo=UTC),
            )
        )


def add_prediction(store: Store) -> None:
    """A plan of one run, and what was predicted of it: velocity alone."""
    when = datetime(2026, 1, 8, tzinfo=UTC)
    velocity = {"velocity_m_s": 5.0, "velocity_lower_m_s": 4.5, "velocity_upper_m_s": 5.5}
    with store.writing() as session:
        plan = Plan(name="later", kind="gun", factors="", method="import")
        configuration = session.scalars(select(Configuration)).first()
        session.add(plan)
        session.flush()
        assert configuration is not None
        run = PlannedRun(
            plan_id=plan.id,
            run=1,
            position=1,
            repetitions=1,
            configuration_id=configuration.id,
            treatment={"tip_material": "steel"},
            settings={"tank_pressure_bar": 5.0},
        )
        session.add(run)
        session.flush()
        session.add(
            RunPrediction(
                planned_run_id=run.id,
                made_at=when,
                models={"gun": "adiabatic"},
                adopted=[],
                settings={"tank_pressure_bar": "5.0"},
                options={},
                draws=3,
                seed=0,
                **velocity,
                drawn={"velocity_m_s": [4.5, 5.0, 5.5]},
                warnings=[],
                remarks=["no contact model is in use"],
            )
        )


def add_people(store: Store) -> None:
    """A user, what was changed, and what was written beside the rows."""
    with store.writing() as session:
        add_people_rows(session, "stored")


def main() -> int:
    target = HERE / "stored" / f"{HEAD}.sqlite.z"
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        write_campaign(folder)
        database = folder / "store.db"
        with open_store(
            f"sqlite:///{database}", Writer("make_stored.py", "0.1.0"), create=True
        ) as store:
            ingest_folder(store, folder)
            ingest_folder(store, EXAMPLES / "first-shots")
            add_diagnosis(store)
            add_jobs(store)
            add_tombstone(store)
            add_registered_version(store)
            add_saved_views(store)
            add_home_pictures(store)
            add_correction(store)
            add_prediction(store)
            add_people(store)
            with store.engine.connect() as connection:
                connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)")
        target.write_bytes(zlib.compress(database.read_bytes(), 9))
    print(target, target.stat().st_size, "bytes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
