"""The queue behind the window: it outlives the server, whose worker is one of those that work on
it."""

from __future__ import annotations

import re
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from pyroshock.app.jobs.kind import RunningJob
from pyroshock.app.jobs.queue import ask, get_job
from pyroshock.app.operations.upload_folders import discard, is_scratch, make_scratch
from pyroshock.app.twins.building import TwinRequest
from pyroshock.schema.jobs import DONE, WAITING
from pyroshock.twin.tune.attainability import Attainability, Obstacle
from support.processes.odd_jobs import Odd, claimed, odd, work_off
from support.processes.web_client import ended, post, post_json, sqlite, window
from support.records.campaigns import gun_campaign

__all__ = ["odd"]

SPECIFICATION = "frequency_hz,level_g\n100,30\n1000,1000\n"


def until(true: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 30
    while not true():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def sent(tmp_path: Path) -> dict[str, Any]:
    folder = gun_campaign(tmp_path / "sent", 2, "sent")
    return {
        "files": [("files", (f"sent/{path.name}", path.read_bytes())) for path in folder.iterdir()]
    }


@pytest.fixture
def scratches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], list[Path]]:
    """Gives the folders of uploads that there are."""
    place = tmp_path / "tmp"
    place.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(place))
    return lambda: sorted(place.glob("pyroshock-upload-*"))


def test_a_job_outlives_its_server(tmp_path: Path, odd: Odd) -> None:
    begun, told = threading.Event(), list[int]()

    def do(work: RunningJob, _word: str) -> None:
        begun.set()
        while not told:
            time.sleep(0.005)
            work.step(1, 2, "half")

    odd.do = do
    with window(sqlite(tmp_path)) as (client, store):
        first, second = odd.ask(store, "a"), odd.ask(store, "b")
        assert begun.wait(20) and client.get(f"/api/jobs/{first.key}").json()["state"] == "running"
    told.append(1)
    with window(sqlite(tmp_path)) as (client, store):
        page = client.get("/jobs").text
        assert "odd a" in page and "odd b" in page
        for job in (first, second):
            until(lambda job=job: get_job(store, job.key).ended)  # type: ignore[misc]
        listed = client.get("/api/jobs").json()
        states = [(job["label"], job["state"], job["attempt"]) for job in listed]
        assert states == [("odd b", DONE, 1), ("odd a", DONE, 2)]
        assert client.get(f"/api/jobs?limit=1&before={second.key}").json() == listed[1:]
        assert "attempt 2" in client.get(f"/jobs/{first.key}").text


def test_a_job_is_stopped_from_its_page(tmp_path: Path, odd: Odd) -> None:
    begun = threading.Event()

    def do(work: RunningJob, _word: str) -> None:
        for i in range(10_000):
            begun.set()
            time.sleep(0.005)
            work.step(i, 10_000, "waiting")

    odd.do = do
    with window(sqlite(tmp_path)) as (client, store):
        address = f"/jobs/{odd.ask(store).key}"
        assert begun.wait(20) and 'id="job-stop"' in client.get(address).text
        answer = post(client, f"{address}/stop")
        assert answer.headers["location"] == address and ended(client, answer)["state"] == "stopped"
        assert 'id="job-stop"' not in client.get(address).text


def test_a_tunings_page_is_drawn_from_the_store(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import numpy as np

    lines, level = np.array([100.0, 1e4]), np.array([50.0, 80.0])
    goal = SimpleNamespace(
        frequency_hz=lines, level_db=level, lower_db=np.full(2, 6.0), upper_db=np.full(2, np.inf)
    )
    obstacle = Obstacle(
        "bench limit", "The bench refuses all of 648 settings.", 0.0, 1e4, -np.inf, ("closed",)
    )
    refusal = Attainability(0.0, 0.5, 0, 0, "every line lies within tolerance", obstacle)
    search_result = SimpleNamespace(proposals=[], choices=[], avoid=[], attainability=refusal)
    session = SimpleNamespace(
        goal=goal,
        notes=("learned from none",),
        run=lambda step: search_result,
        answering=TwinRequest(),
    )
    monkeypatch.setattr("pyroshock.app.operations.tune.session.session_of", lambda *_: session)
    with window(sqlite(tmp_path)) as (client, _):
        job = ended(
            client, post_json(client, "/api/tune", {"target": SPECIFICATION, "tolerance": "3dB"})
        )
        assert (job["state"], job["error"], job["address"]) == (DONE, None, f"/tune/{job['id']}")
        # the job, its result and its page say the same
        sentence = "No setting meets the target. The bench refuses all of 648 settings."
        assert job["words"] == job["result"]["attainability"]["sentence"] == sentence
        assert (
            job["result"]["attainability"]["obstacle"]["margin_db"] is None
        )  # JSON knows no infinity
    with window(sqlite(tmp_path)) as (client, _):
        page = client.get(job["address"])
        assert page.status_code == 200 and "learned from none" in page.text
        assert (
            re.search(rf'id="attainability"[^>]*>{re.escape(sentence)}', page.text)
            and 'id="proposals"' not in page.text
        )
        assert client.get(f"/api/jobs/{job['id']}").json() == job


def test_pages_alone_leave_jobs_to_workers(
    tmp_path: Path, scratches: Callable[[], list[Path]]
) -> None:
    with window(sqlite(tmp_path), works=False) as (client, store):
        answer = post(client, "/ingest/upload", **sent(tmp_path))
        key = int(answer.headers["location"].rsplit("/", 1)[1])
        time.sleep(0.2)
        assert (
            get_job(store, key).state == WAITING and len(scratches()) == 1 and work_off(store) == 1
        )
        job = ended(client, answer)
        assert (job["state"], job["result"]["shots"]) == (DONE, 2)
    assert scratches() == []


def test_an_upload_is_removed_however_its_job_ends(
    tmp_path: Path, scratches: Callable[[], list[Path]]
) -> None:
    upload = sent(tmp_path)
    with window(sqlite(tmp_path), works=False) as (client, store):

        def asked() -> int:
            return int(
                post(client, "/ingest/upload", **upload).headers["location"].rsplit("/", 1)[1]
            )

        stopped = asked()
        assert post(client, f"/jobs/{stopped}/stop").status_code == 303 and scratches() == []
        damaged = asked()
        next(scratches()[0].rglob("runs.csv")).write_text("run,repetition\n1,one\n")
        work_off(store)
        assert get_job(store, damaged).state == "failed" and scratches() == []
        orphaned = asked()
        claimed(store)  # by a worker that dies
        work_off(store)
        assert get_job(store, orphaned).attempt == 2 and scratches() == []


def test_no_row_makes_a_worker_remove_what_is_no_upload(
    tmp_path, scratches: Callable[[], list[Path]], monkeypatch
):
    precious, upload = tmp_path / "pyroshock-upload-precious", make_scratch()
    precious.mkdir()
    (link := upload.parent / "pyroshock-upload-link").symlink_to(precious)
    for path in (precious, link, upload.parent, upload / ".." / ".." / precious.name, Path("/")):
        assert not is_scratch(path)
        discard(path)
    assert precious.is_dir() and link.is_symlink() and upload.is_dir()
    discard(upload)
    assert not upload.exists()


def test_a_folder_beyond_those_of_a_worker_is_not_read_and_scripts_name_what_there_is(
    tmp_path: Path,
) -> None:
    from pyroshock.app.jobs.known_kinds import KINDS
    from pyroshock.app.operations.ingest.request import FolderIngest
    from pyroshock.app.operations.machine_paths import MachinePath

    folder = gun_campaign(tmp_path / "data" / "spring", 2, "spring")
    (tmp_path / "other").mkdir()
    with window(sqlite(tmp_path), works=False) as (_, store):
        asked = FolderIngest(path=MachinePath(path=folder))
        key = ask(store, KINDS["ingest"], "Ingest", asked).key
        work_off(store, folders=(tmp_path / "other",))
        found = get_job(store, key)
        assert (found.state, f"may not read {folder}" in found.what) == (WAITING, True)
        work_off(store, folders=(tmp_path / "data",))
        assert get_job(store, key).state == DONE
    with window(sqlite(tmp_path)) as (client, _):
        assert post_json(client, "/api/campaigns/unknown/extract", {}).status_code == 404
        assert post_json(client, "/api/train", {"dataset": "unknown"}).status_code == 404
        assert (
            "no-such-model"
            in post_json(client, "/api/train", {"dataset": "a", "models": "no-such-model"}).text
        )
