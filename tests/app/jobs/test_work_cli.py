"""`pyroshock work` and `pyroshock jobs` as a person types them."""

from __future__ import annotations

import json
import zlib
from pathlib import Path

import pytest
from pyroshock.app.ingest.job import EXTRACT, INGEST, ExtractArguments, IngestArguments
from pyroshock.app.jobs.queue import ask, get_job, list_jobs
from support.records.campaigns import gun_campaign
from support.stores.stores import opened, pyroshock


@pytest.fixture
def url(sqlite_url: str, tmp_path: Path) -> str:
    """A store with two jobs: an ingest, and an extraction of what is not there."""
    folder = gun_campaign(tmp_path / "spring", 2, "spring")
    with opened(sqlite_url, create=True) as store:
        ask(store, INGEST, "Ingest of spring", IngestArguments(str(folder), {}))
        ask(store, EXTRACT, "Extraction of autumn", ExtractArguments("autumn"))
    return sqlite_url


def test_what_was_asked_for_is_done_listed_and_stopped(url: str, tmp_path: Path) -> None:
    refused = pyroshock("work", "--once", "--lease", "0.1s", "--db", url)
    assert (refused.exit_code, refused.stderr.count("\n")) == (2, 1)
    assert "--lease is 0.1s; expected 1s or more" in refused.stderr
    assert "30s" in pyroshock("work", "--help").stdout
    assert "no job 7 in the store" in pyroshock("jobs", "stop", "7", "--db", url).stderr
    result = pyroshock("work", "--once", "--db", url, "--data", tmp_path)
    assert (result.exit_code, result.stdout) == (0, "")
    assert "job 1: Ingest of spring\n" in result.stderr and "2 jobs\n" in result.stderr
    table = pyroshock("jobs", "--db", url).stdout
    assert "no campaign 'autumn'" in table and "2 shots" in table
    found = json.loads(pyroshock("jobs", "--last", "1", "--json", "--db", url).stdout)
    assert [(job["id"], job["state"], job["kind"]) for job in found] == [(2, "failed", "extract")]
    with opened(url) as store:
        waiting = ask(store, EXTRACT, "Extraction of spring", ExtractArguments("spring"))
        result = pyroshock("jobs", "--db", url, "stop", waiting.key)
        assert "Extraction of spring: stopped" in result.stderr
        assert get_job(store, waiting.key).state == "stopped"


def test_a_job_that_an_older_version_was_asked_for_is_done(tmp_path: Path) -> None:
    stored = Path(__file__).parents[2] / "schema" / "stored" / "0004.sqlite.z"
    (tmp_path / "old.db").write_bytes(zlib.decompress(stored.read_bytes()))
    url = f"sqlite:///{tmp_path / 'old.db'}"
    assert pyroshock("db", "upgrade", "--db", url).exit_code == 0
    result = pyroshock("work", "--once", "--db", url)
    assert "1 job\n" in result.stderr, result.stderr
    with opened(url) as store:
        found = list_jobs(store)
    listed_jobs = [(job.state, job.attempt, job.worker == "bench:1:0") for job in found]
    assert listed_jobs == [("done", 1, True), ("done", 1, False)]
