"""What becomes of a job that is asked for: its order, its progress, its stop, its errors; and the
commands for it."""

from __future__ import annotations

import json
import threading
import time
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pyroshock.app.common.model_registry import MissingExtraError
from pyroshock.app.jobs.claims import stop
from pyroshock.app.jobs.kind import JobResult, RunningJob
from pyroshock.app.jobs.known_kinds import KINDS
from pyroshock.app.jobs.queue import JobView, UnknownJobError, ask, get_job, list_jobs
from pyroshock.app.operations.ingest.extract import Extraction
from pyroshock.app.operations.ingest.request import FolderIngest
from pyroshock.app.operations.machine_paths import MachinePath
from pyroshock.app.operations.operation import NotHereError
from pyroshock.schema.jobs import DONE, FAILED, RUNNING, STOPPED, WAITING
from pyroshock.schema.session import Store
from support.processes.odd_jobs import Odd, odd, work_off, working
from support.records.campaigns import gun_campaign
from support.stores.stores import opened, pyroshock

__all__ = ["odd"]


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Store]:
    """One for all: every test ends the jobs that it asks for."""
    with opened(f"sqlite:///{tmp_path_factory.mktemp('queue')}/lab.db", create=True) as found:
        yield found


def until_ended(store: Store, key: int) -> JobView:
    deadline = time.monotonic() + 20
    while not (found := get_job(store, key)).ended:
        assert time.monotonic() < deadline, found
        time.sleep(0.01)
    return found


def test_jobs_are_done_in_the_order_asked_unless_stopped_or_of_another_machine(
    store: Store, odd: Odd
) -> None:
    order: list[str] = []
    odd.do = lambda _, word: order.append(word)
    for word in "abcde":
        odd.ask(store, word)
    assert work_off(store) == 5 and order == list("abcde")
    listed_jobs = [(job.label, job.state, job.attempt) for job in list_jobs(store, 2)]
    assert listed_jobs == [("odd e", DONE, 1), ("odd d", DONE, 1)]
    assert [job.label for job in list_jobs(store, 2, before=list_jobs(store, 1)[0].key)] == [
        "odd d",
        "odd c",
    ]
    done: list[str] = []
    odd.do = lambda _, word: done.append(word)
    first, second = odd.ask(store, "a"), odd.ask(store, "b")
    assert stop(store, first.key).state == STOPPED
    work_off(store)
    assert (done, get_job(store, second.key).state) == (["b"], DONE) and stop(
        store, second.key
    ).state == DONE
    key = odd.ask(store, host="another").key
    assert (
        work_off(store) == 0
        and get_job(store, key).state == WAITING
        and work_off(store, host="another") == 1
    )
    assert get_job(store, key).state == DONE
    for command in (get_job, stop):
        with pytest.raises(UnknownJobError, match="no job 1234"):
            command(store, 1234)
    key = odd.ask(store, "nul\x00 half\ud800 <b>").key
    assert "<b>" in get_job(store, key).label
    work_off(store)
    assert get_job(store, key).ended


def test_progress_and_result_are_told(store: Store, odd: Odd) -> None:
    go_on = threading.Event()

    def do(work: RunningJob, _word: str) -> JobResult:
        work.step(3, 7, "recordings/0003.mat")
        assert go_on.wait(20)
        return JobResult("/campaigns/a", "done", {"impacts": 3, "error": float("nan")})

    odd.do = do
    with working(store):
        key, deadline = odd.ask(store).key, time.monotonic() + 20
        while (job := get_job(store, key)).done == 0:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        assert (job.state, job.done, job.total, job.what) == (RUNNING, 3, 7, "recordings/0003.mat")
        assert job.worker is not None
        go_on.set()
        told = until_ended(store, key).as_json()
    assert (told["state"], told["address"], told["words"]) == (DONE, "/campaigns/a", "done")
    assert told["result"] == {"impacts": 3, "error": None} and list_jobs(store)[0].result is None


def test_a_stop_ends_a_job_at_its_next_step(store: Store, odd: Odd) -> None:
    begun = threading.Event()

    def do(work: RunningJob, _word: str) -> None:
        for i in range(100_000):
            begun.set()
            time.sleep(0.005)
            work.step(i, 100_000, "")

    odd.do = do
    with working(store):
        key = odd.ask(store).key
        assert (
            begun.wait(20)
            and stop(store, key).state == RUNNING
            and until_ended(store, key).state == STOPPED
        )


def test_errors_of_the_user_keep_their_words_and_ours_say_so(
    store: Store, odd: Odd, caplog: pytest.LogCaptureFixture
):
    errors: dict[str, Exception] = {
        "his": ValueError("tip radius is 0; expected above 0"),
        "ours": KeyError("secret"),
    }
    errors["password"] = ValueError("cannot reach postgresql://lab:hunter2@server/lab")

    def do(_work: RunningJob, word: str) -> None:
        raise errors[word]

    odd.do = do
    his, ours, password = (odd.ask(store, word) for word in errors)
    assert work_off(store) == 3  # the worker survives all
    assert "hunter2" not in str(get_job(store, password.key).error)
    assert get_job(store, his.key).error == "tip radius is 0; expected above 0"
    found = get_job(store, ours.key)
    assert found.state == FAILED and "an error of pyroshock itself, KeyError" in str(found.error)
    assert "Traceback" in caplog.text


@pytest.mark.parametrize("lacking", [NotHereError, MissingExtraError])
def test_what_one_worker_lacks_another_does(
    store: Store, odd: Odd, lacking: type[Exception]
) -> None:
    able: list[int] = []

    def do(_work: RunningJob, _word: str) -> None:
        if not able:
            raise lacking("torch is not installed")

    odd.do = do
    key = odd.ask(store).key
    assert work_off(store) == 1
    found = get_job(store, key)
    assert (found.state, found.what) == (
        WAITING,
        "waits for another worker: torch is not installed",
    )
    able.append(1)
    work_off(store)
    assert get_job(store, key).state == DONE


def test_a_job_of_another_version_says_so(
    store: Store, odd: Odd, monkeypatch: pytest.MonkeyPatch
) -> None:
    from pyroshock.app.jobs.kind import Kind

    newer: dict[str, Any] = {"word": "a", "depth": 3}
    monkeypatch.setattr(Kind, "plain", lambda *_: newer)
    key = odd.ask(store).key
    work_off(store)
    assert "depth; this software knows word" in str(get_job(store, key).error)


def test_the_end_of_a_worker_gives_the_job_back(store: Store, odd: Odd) -> None:
    begun = threading.Event()

    def do(work: RunningJob, _word: str) -> None:
        begun.set()
        while not done:
            time.sleep(0.005)
            work.step(1, 2, "")

    done: list[int] = []
    odd.do = do
    key = odd.ask(store).key
    with working(store):
        assert begun.wait(20)
    found = get_job(store, key)
    assert (found.state, found.attempt, found.done) == (WAITING, 1, 0)
    done.append(1)
    work_off(store)
    found = get_job(store, key)
    assert (found.state, found.attempt) == (DONE, 2)


# --- `pyroshock work` and `pyroshock jobs` as a person types them ---
@pytest.fixture
def url(sqlite_url: str, tmp_path: Path) -> str:
    """A store with two jobs: an ingest, and an extraction of what is not there."""
    folder = gun_campaign(tmp_path / "spring", 2, "spring")
    with opened(sqlite_url, create=True) as store:
        path = MachinePath(path=folder)
        ask(store, KINDS["ingest"], "Ingest of spring", FolderIngest(path=path))
        ask(store, KINDS["extract"], "Extraction of autumn", Extraction(campaign="autumn"))
    return sqlite_url


def test_what_was_asked_for_is_done_listed_and_stopped(url: str, tmp_path: Path) -> None:
    refused = pyroshock("work", "--once", "--lease", "0.1s", "--db", url)
    assert (refused.exit_code, refused.stderr.count("\n")) == (2, 1)
    assert (
        "--lease is 0.1s; expected 1s or more" in refused.stderr
        and "30s" in pyroshock("work", "--help").stdout
    )
    assert "no job 7 in the store" in pyroshock("jobs", "stop", "7", "--db", url).stderr
    result = pyroshock("work", "--once", "--db", url, "--data", tmp_path)
    assert (result.exit_code, result.stdout) == (0, "")
    assert "job 1: Ingest of spring\n" in result.stderr and "2 jobs\n" in result.stderr
    table = pyroshock("jobs", "--db", url).stdout
    assert "no campaign 'autumn'" in table and "2 shots" in table
    job_rows = json.loads(pyroshock("jobs", "--last", "1", "--json", "--db", url).stdout)
    assert [(job["id"], job["state"], job["kind"]) for job in job_rows] == [
        (2, "failed", "extract")
    ]
    with opened(url) as store:
        spring = Extraction(campaign="spring")
        waiting = ask(store, KINDS["extract"], "Extraction of spring", spring)
        result = pyroshock("jobs", "--db", url, "stop", waiting.key)
        assert (
            "Extraction of spring: stopped" in result.stderr
            and get_job(store, waiting.key).state == "stopped"
        )


def test_a_job_that_an_older_version_was_asked_for_is_done(tmp_path: Path) -> None:
    stored = Path(__file__).parents[2] / "schema" / "stored" / "0013.sqlite.z"
    (tmp_path / "old.db").write_bytes(zlib.decompress(stored.read_bytes()))
    url = f"sqlite:///{tmp_path / 'old.db'}"
    assert pyroshock("db", "upgrade", "--db", url).exit_code == 0
    result = pyroshock("work", "--once", "--db", url)
    assert "1 job\n" in result.stderr, result.stderr
    with opened(url) as store:
        jobs = list_jobs(store)
    job_rows = [(job.state, job.attempt, job.worker == "bench:1:0") for job in jobs]
    assert job_rows == [("done", 1, True), ("done", 1, False)]
