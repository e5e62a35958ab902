"""A folder is checked by a job of its own, and stored or discarded from the page of the check."""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path
from typing import Any

import pytest
from pyroshock.app.operations.ingest.planned_achieved import (
    bench_facts,
    constant_settings,
    planned_achieved_rows,
)
from pyroshock.app.operations.upload_folders import make_scratch
from support.processes.browsers import until
from support.processes.web_client import ended, post, token
from support.records.campaigns import gun_campaign, hammer_campaign, recording_name
from support.stores.web_stores import HAMMER, Lab

pytestmark = pytest.mark.timeout(600)
FORM = {"X-Pyroshock-Form": "1"}


@pytest.fixture(autouse=True)
def _own_scratch(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Folders of uploads that belong to the test alone: another test may upload at the same
    time."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path_factory.mktemp("scratch")))


def sent(folder: Path) -> list[Any]:
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return [
        ("files", (f"{folder.name}/{path.relative_to(folder)}", path.read_bytes()))
        for path in files
    ]


def checked(lab: Lab, folder: Path, **form: str) -> tuple[str, str]:
    """The page of the check of an upload, once it has ended, and its address."""
    answer = post(lab.client, "/ingest/upload", {"dry_run": "1", **form}, files=sent(folder))
    address = answer.headers["location"]
    assert ended(lab.client, answer)["state"] == "done" and address.startswith("/ingest/checks/")
    return lab.client.get(address).text, address


def scratches() -> set[Path]:
    return {
        path
        for name in ("checked", "upload")
        for path in Path(tempfile.gettempdir()).glob(f"pyroshock-{name}-*")
    }


def test_a_checked_upload_is_stored_once(empty: Lab, tmp_path: Path) -> None:
    folder, before, files = (
        hammer_campaign(tmp_path / "spring", 3, 2, "spring"),
        empty.rows(),
        scratches(),
    )
    damaged = folder / recording_name(2)
    damaged.write_bytes(damaged.read_bytes()[:100])
    page, address = checked(empty, folder)
    assert empty.added(before) == {} and len(scratches() - files) == 1
    assert "Nothing is stored yet." in page and "2 recordings, 4 impacts would be stored" in page
    assert "1 damaged recording would be set aside" in page and recording_name(2) in page
    assert f'href="{address}"' in empty.client.get("/").text  # the first page reminds of it
    job = ended(empty.client, post(empty.client, f"{address}/store"))
    assert (job["state"], job["address"], empty.added(before)["impacts"]) == (
        "done",
        "/campaigns/spring",
        4,
    )
    until(
        lambda: scratches() == files
    )  # a folder goes after its job's end is stored: a crash between loses no file
    assert scratches() == files and 'id="gone"' in empty.client.get(address).text
    assert post(empty.client, f"{address}/store").status_code == 404


def test_a_discarded_check_leaves_nothing(empty: Lab, tmp_path: Path) -> None:
    files, before = scratches(), empty.rows()
    _, address = checked(empty, gun_campaign(tmp_path / "shots", 2, "shots"))
    assert post(empty.client, f"{address}/discard").headers["location"] == "/ingest"
    assert scratches() == files and empty.added(before) == {}


def test_a_folder_with_faults_is_told_whole_and_cannot_be_stored(
    empty: Lab, tmp_path: Path
) -> None:
    folder, files = gun_campaign(tmp_path / "wrong", 2, "wrong"), scratches()
    (folder / "runs.csv").write_text("run,repetition\nx,1\n1,one\n", encoding="utf-8")
    page, address = checked(empty, folder)
    assert (
        "faults; nothing of it can be stored" in page
        and "&#39;x&#39;" in page
        and "&#39;one&#39;" in page
    )
    assert 'id="store"' not in page and scratches() == files
    assert post(empty.client, f"{address}/store").status_code == 422


def test_a_folder_of_the_server_is_checked_and_stored(filled: Lab) -> None:
    gun_campaign(filled.folder / "campaigns" / "by-check", 2, "by-check")
    before = filled.rows()
    answer = post(filled.client, "/ingest/path", {"path": "by-check", "dry_run": "1"})
    assert ended(filled.client, answer)["state"] == "done" and filled.added(before) == {}
    page = filled.client.get(answer.headers["location"]).text
    assert "2 shots would be stored" in page and "Do not store it" in page
    assert (
        ended(filled.client, post(filled.client, f"{answer.headers['location']}/store"))["state"]
        == "done"
    )
    assert (
        filled.added(before)["shots"] == 2 and (filled.folder / "campaigns" / "by-check").is_dir()
    )


@pytest.mark.parametrize(("form", "field"), [
    ({"path": "/etc"}, "path"),
    ({"path": HAMMER, "threshold": "much"}, "threshold"),
    ({"path": HAMMER, "threshold": "7"}, "threshold"),
    ({"path": HAMMER, "segmentation": "guess"}, "segmentation"),
    ({"path": HAMMER, "plan": "winter"}, "plan"),
])  # fmt: skip
def test_a_fault_of_the_form_stands_at_its_field(
    filled: Lab, form: dict[str, str], field: str
) -> None:
    (fault,) = post(filled.client, "/ingest/path", form, headers=FORM).json()["faults"]
    assert fault["field"] == field and fault["message"]


def test_faults_of_uploads_stand_at_their_field(filled: Lab) -> None:
    for address, name, field in (
        ("/ingest/upload", "files", "files"),
        ("/ingest/restore", "other", "file"),
    ):
        files = [(name, ("notes.md", b"x"))]
        (fault,) = post(filled.client, address, files=files, headers=FORM).json()["faults"]
        assert fault["field"] == field
    too_large = {**FORM, "content-length": str(10**12), "X-CSRF-Token": token(filled.client)}
    assert "bytes" in filled.client.post("/ingest/upload", headers=too_large).json()["detail"]


def test_checked_uploads_of_yesterday_are_removed() -> None:
    old = make_scratch(dry_run=True)
    yesterday = time.time() - 25 * 3600
    os.utime(old, (yesterday, yesterday))
    new = make_scratch(dry_run=True)
    try:
        assert new.is_dir() and not old.exists()
    finally:
        new.rmdir()


def test_a_campaign_is_archived_and_restored_from_the_pages(filled: Lab) -> None:
    gun_campaign(filled.folder / "campaigns" / "shelf", 2, "shelf")
    ended(filled.client, post(filled.client, "/ingest/path", {"path": "shelf"}))
    saved = filled.client.get("/campaigns/shelf/copy").content
    job = ended(
        filled.client, post(filled.client, "/campaigns/shelf/archive", {"reason": "finished"})
    )
    assert (job["state"], job["error"]) == ("done", None) and Path(job["result"]["file"]).is_file()
    assert filled.client.get("/campaigns/shelf").status_code == 404
    page = filled.client.get("/deleted").text
    assert "finished" in page and 'action="/deleted/1/restore"' in page
    assert filled.client.get("/deleted/1/file").content.startswith(b"SQLite format 3")
    assert (
        ended(filled.client, post(filled.client, "/deleted/1/restore"))["address"]
        == "/campaigns/shelf"
    )
    assert filled.client.get("/campaigns/shelf").status_code == 200
    post(filled.client, "/campaigns/shelf/delete", {"reason": "again"})
    answer = post(filled.client, "/ingest/restore", files=[("file", ("shelf.pyroshock", saved))])
    assert ended(filled.client, answer)["state"] == "done"
    assert filled.client.get("/campaigns/shelf").status_code == 200


@pytest.mark.parametrize(
    ("what", "format"), [("impacts", "csv"), ("pulses", "parquet"), ("series", "csv")]
)
def test_tables_are_saved_by_the_browser(filled: Lab, what: str, format: str) -> None:
    answer = filled.client.get(f"/campaigns/{HAMMER}/export?what={what}&format={format}")
    assert f"{HAMMER}-{what}.{format}" in answer.headers["content-disposition"]
    assert answer.content.startswith(
        b"PAR1" if format == "parquet" else (b"id," if what == "impacts" else b"campaign")
    )


def test_a_campaign_is_extracted_again_as_a_job(filled: Lab) -> None:
    before = filled.rows()
    form = {"segmentation": "mask", "threshold": "0.02", "smoothing": "0.99"}
    job = ended(filled.client, post(filled.client, f"/campaigns/{HAMMER}/extract", form))
    assert job["state"] == "done" and filled.added(before)["pulses"] == job["result"]["added"] > 0


def test_planned_and_achieved_stand_in_one_table() -> None:
    level = {"planned": 1, "done": 2, "discarded": 0, "impacts": 0}
    levels = [
        {**level, "factor": "tank_pressure_pa", "level": 1e5, "shots": 4},
        {**level, "factor": "tank_pressure_pa", "level": 2e5, "shots": 3},
        {**level, "factor": "insulator", "level": "none", "shots": 7},
    ]
    run = {"plan": "p", "planned": 1e5, "recorded": 2, "quantity": "tank_pressure_pa"}
    achieved = [
        {**run, "run": 1, "deviation": 0.02},
        {**run, "run": 2, "deviation": -0.04},
        {**run, "run": 1, "deviation": 0.0, "quantity": "velocity_m_s", "planned": 8.0},
    ]
    first, second, velocity = planned_achieved_rows(levels, achieved)
    assert first == {
        "setting": "tank pressure (bar)", "level": "1", "planned": 1, "done": 2, "discarded": 0,
        "shots": 4,
        "mean_deviation": "−1.0 %", "worst": "−4.0 % (run 2)",
    }  # fmt: skip
    assert second["mean_deviation"] is None
    assert (velocity["setting"], velocity["mean_deviation"]) == ("impact velocity (m/s)", "0.0 %")
    assert constant_settings(levels) == ["no insulator"]


def test_a_bench_is_told_with_units_and_words() -> None:
    bench = {
        "gun": {"tank_volume_m3": 0.0095, "travel_m": 0.885, "efficiency": None},
        "plate": {
            "outline_m": [[0.0, 0.1], [1.0, 0.6]],
            "measured_modes": False,
            "material": "aluminum",
        },
    }
    assert dict(bench_facts(bench)) == {
        "Gun: tank volume": "9.5 L",
        "Gun: travel": "885 mm",
        "Plate: corners": "1000 mm × 500 mm overall; x/y in mm: 0/100, 1000/600",
        "Plate: modes": "computed",
        "Plate: material": "aluminum",
    }
