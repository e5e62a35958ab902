"""Workers as processes of their own: ended, killed or put to sleep in the midst of a job, and what
the next does."""

from __future__ import annotations

import os
import signal
import sqlite3
import subprocess
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from pyroshock.app.jobs.known_kinds import KINDS
from pyroshock.app.jobs.queue import ask, get_job, list_jobs
from pyroshock.app.operations.diagnose.request import DiagnosisRequest
from pyroshock.app.operations.ingest.extract import Extraction
from pyroshock.app.operations.ingest.request import FolderIngest
from pyroshock.app.operations.machine_paths import MachinePath
from pyroshock.schema.campaigns import Plan
from pyroshock.schema.diagnoses import Diagnosis
from pyroshock.schema.jobs import DONE, RUNNING, WAITING
from pyroshock.schema.recordings import Recording
from pyroshock.schema.session import Store
from sqlalchemy import func, select
from support.records.campaigns import gun_campaign, hammer_campaign
from support.stores.stores import content, ingested, opened, pyroshock, run_pyroshock, start_cli
from support.stores.web_stores import FACTORS

#: A process imports for seconds, on a machine that may be busy.
PATIENCE_S = 60.0
RECORDINGS = 16
PLAN = KINDS["plan"]
PLANNED = PLAN.read(
    {
        **{"name": "p", "method": "lhs", "kind": "hammer", "runs": 8, "seed": 1},
        "factors": {"text": FACTORS},
    }
)


def until(true: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not true():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def count(store: Store) -> int:
    with store.reading() as session:
        return session.scalar(select(func.count()).select_from(Recording)) or 0


def asked_ingest(store: Store, folder: Path) -> int:
    return ask(store, KINDS["ingest"], "Ingest", FolderIngest(path=MachinePath(path=folder))).key


def begun(store: Store, key: int, url: str, folder: Path) -> subprocess.Popen[str]:
    """A worker in the midst of an ingest: some recordings are stored."""
    worker = start_cli("work", "--db", url, "--lease", "1s", "--data", folder.parent)
    until(lambda: count(store) >= 2 or worker.poll() is not None)
    assert get_job(store, key).state == RUNNING
    return worker


def put_to_sleep(worker: subprocess.Popen[str], file: Path) -> None:
    """Stop a worker between two transactions: a process that sleeps within one keeps SQLite's lock,
    and nobody else can write."""
    while True:
        worker.send_signal(signal.SIGSTOP)
        with closing(sqlite3.connect(file, timeout=0.2, isolation_level=None)) as connection:
            try:
                connection.execute("BEGIN IMMEDIATE")
            except sqlite3.OperationalError:  # it sleeps within a transaction: try a moment later
                worker.send_signal(signal.SIGCONT)
                time.sleep(0.01)
            else:
                connection.execute("ROLLBACK")
                return


def test_a_killed_workers_ingest_is_finished_by_the_next(tmp_path: Path, sqlite_url: str) -> None:
    folder = hammer_campaign(tmp_path / "spring", RECORDINGS, 1)
    ingested(undisturbed := f"sqlite:///{tmp_path / 'undisturbed.db'}", folder)
    with opened(sqlite_url, create=True) as store:
        key = asked_ingest(store, folder)
        worker = begun(store, key, sqlite_url, folder)
        worker.kill()
        worker.communicate()
        assert count(store) < RECORDINGS
        assert get_job(store, key).state == RUNNING  # nobody was left to say otherwise
        run_pyroshock(
            "work", "--db", sqlite_url, "--once", "--lease", "1s", "--data", folder.parent
        )
        found = get_job(store, key)
    assert (found.state, found.attempt) == (DONE, 2) and found.result["impacts"] == RECORDINGS
    assert content(sqlite_url) == content(undisturbed)


@pytest.mark.slow
def test_a_worker_that_is_told_to_end_gives_its_job_back(tmp_path: Path, sqlite_url: str) -> None:
    folder = hammer_campaign(tmp_path / "spring", RECORDINGS, 1)
    with opened(sqlite_url, create=True) as store:
        key = asked_ingest(store, folder)
        worker = begun(store, key, sqlite_url, folder)
        worker.terminate()
        _, told = worker.communicate(timeout=PATIENCE_S)
        assert worker.returncode == 130, told
        assert "interrupted; what was stored is whole" in told and "Traceback" not in told
        assert get_job(store, key).state == WAITING


@pytest.mark.slow
def test_a_worker_that_slept_through_its_lease_changes_nothing(
    tmp_path: Path, sqlite_url: str
) -> None:
    folder = hammer_campaign(tmp_path / "spring", RECORDINGS, 1)
    undisturbed = f"sqlite:///{tmp_path / 'undisturbed.db'}"
    ingested(undisturbed, folder)
    with opened(sqlite_url, create=True) as store:
        key = asked_ingest(store, folder)
        worker = begun(store, key, sqlite_url, folder)
        try:
            put_to_sleep(worker, tmp_path / "pyroshock.db")
            run_pyroshock(
                "work", "--db", sqlite_url, "--once", "--lease", "1s", "--data", folder.parent
            )
            before = get_job(store, key)
            assert (before.state, before.attempt) == (DONE, 2)
            following = ask(store, PLAN, "Plan", PLANNED).key
            worker.send_signal(signal.SIGCONT)
            until(
                lambda: get_job(store, following).ended
            )  # it lives, and is through with the one it slept over
            assert (
                get_job(store, following).worker != before.worker and get_job(store, key) == before
            )
        finally:
            worker.kill()
            _, told = worker.communicate()
    assert f"job {key}" in told and "nothing more of it is stored" in told
    assert measured(sqlite_url) == measured(undisturbed)


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_workers_killed_at_any_moment_leave_every_effect_once(
    tmp_path: Path, database_url: str
) -> None:
    """Four kinds of jobs; each worker is killed after a while, twice a job at most, till all is
    done."""
    folder = hammer_campaign(tmp_path / "autumn", RECORDINGS, 2, "autumn")
    known = (
        hammer_campaign(tmp_path / "spring", RECORDINGS, 1, "spring"),
        gun_campaign(tmp_path / "gun", 6, "gun"),
    )
    undisturbed = f"sqlite:///{tmp_path / 'undisturbed.db'}"
    ingested(undisturbed, folder, *known)
    pyroshock("extract", "spring", "--threshold", "0.01", "--db", undisturbed)
    ingested(database_url, *known)
    with opened(database_url) as store:
        asked_ingest(store, folder)
        ask(store, KINDS["extract"], "Extraction", Extraction(campaign="spring", threshold=0.01))
        ask(store, PLAN, "Plan", PLANNED)
        diagnosis = DiagnosisRequest(campaign="gun", seed=1)
        ask(store, KINDS["diagnose"], "Diagnosis", diagnosis)
        deaths = 0
        for moment in (2.0, 3.1, 4.3, 2.6, 3.7, 5.2):
            worker = start_cli(
                "work", "--db", database_url, "--lease", "1s", "--data", folder.parent
            )
            time.sleep(moment)
            # a third death of one job would be its last: that one may end
            until(lambda: not any(job.attempt >= 3 and not job.ended for job in list_jobs(store)))
            deaths += worker.poll() is None
            os.kill(worker.pid, signal.SIGKILL)
            worker.communicate()
        last = start_cli(
            "work", "--db", database_url, "--once", "--lease", "1s", "--data", folder.parent
        )
        _, told = last.communicate(timeout=300)
        assert last.returncode == 0, told
        assert deaths >= 3 and [job.error for job in list_jobs(store) if job.state != DONE] == []
        with store.reading() as session:
            kept = [
                session.scalar(select(func.count()).select_from(table))
                for table in (Diagnosis, Plan)
            ]
        assert kept == [1, 1]
    assert measured(database_url) == measured(undisturbed)


def measured(url: str) -> dict[str, list[str]]:
    """What ingest and extraction have stored."""
    rows = content(url)
    return {name: rows[name] for name in ("recordings", "channels", "impacts", "pulses")}
