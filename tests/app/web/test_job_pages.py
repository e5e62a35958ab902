"""Pages of jobs: state, count, remaining time, result in words, what to do after a failure, and the filter by state."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from pyroshock.app.diagnose.form import arguments_of, fields_of
from pyroshock.app.diagnose.job import DIAGNOSE
from pyroshock.app.ingest.job import INGEST, IngestArguments
from pyroshock.app.jobs.queue import JobView, ask, get_job
from pyroshock.app.web.job_words import duration_words, next_step_words, result_words, time_words
from pyroshock.schema.session import Store
from starlette.testclient import TestClient
from support.checks.well_formed import Page
from support.processes.odd_jobs import Odd, odd, work_off
from support.processes.web_client import post, sqlite, window

__all__ = ["odd"]
Window = tuple[TestClient, Store]


@pytest.fixture
def pages(tmp_path: Path) -> Iterator[Window]:
    """Pages alone: jobs wait until the test works them off."""
    with window(sqlite(tmp_path), works=False) as client_and_store:
        yield client_and_store


def fail(store: Store, odd: Odd) -> int:
    def do(*_: object) -> None:
        raise ValueError("the tolerance is 0; enter a number above 0")

    odd.do = do
    key = odd.ask(store, "wrong").key
    work_off(store)
    return key


def test_a_waiting_job_has_no_button_to_its_result(pages: Window, odd: Odd) -> None:
    client, store = pages
    text = client.get(f"/jobs/{odd.ask(store, 'a').key}").text
    assert 'id="job-result"' not in text and 'id="job-stop"' in text and "You can leave this page" in text


def test_a_done_job_says_what_its_button_opens(pages: Window, odd: Odd) -> None:
    client, store = pages
    key = odd.ask(store, "a").key
    work_off(store)
    text = client.get(f"/jobs/{key}").text
    assert 'id="job-result"' in text and "It took" in text and 'id="job-again"' not in text


def test_a_failed_job_names_the_reason_and_is_tried_again(pages: Window, odd: Odd) -> None:
    client, store = pages
    key = fail(store, odd)
    text = client.get(f"/jobs/{key}").text
    assert "the tolerance is 0" in text and "try again" in text and 'id="job-result"' not in text
    answer = post(client, f"/jobs/{key}/again")
    again = int(answer.headers["location"].rsplit("/", 1)[1])
    assert again != key and get_job(store, again).label == "odd wrong"


def test_a_waiting_job_is_not_asked_for_again(pages: Window, odd: Odd) -> None:
    client, store = pages
    answer = post(client, f"/jobs/{odd.ask(store, 'a').key}/again")
    assert answer.status_code == 422 and "has not ended" in answer.text


def test_a_failed_diagnosis_leads_back_to_its_form_with_the_same_values(pages: Window) -> None:
    client, store = pages
    form = {
        "simulator": "models:/gp@1",
        "gun": "2",
        "contact": "",
        "plate": "0,5",
        "uncertain": "gun.friction_coefficient=0.05",
    }
    arguments = arguments_of("spring", form, 7, (), ())
    key = ask(store, DIAGNOSE, "Diagnosis of spring", arguments).key
    work_off(store)
    page = Page(client.get(f"/jobs/{key}").text)
    (link,) = (item["href"] for item in page.of("a") if item.get("id") == "job-form")
    assert link.startswith("/diagnoses?campaign=spring&simulator=models%3A%2Fgp%401&gun=2&plate=0.5&")
    assert fields_of(vars(arguments))["uncertain"] == "gun.friction_coefficient=0.05"


def test_an_upload_that_failed_is_sent_anew(pages: Window, tmp_path: Path) -> None:
    client, store = pages
    key = ask(store, INGEST, "Ingest", IngestArguments(str(tmp_path), {}, scratch=str(tmp_path / "scratch"))).key
    post(client, f"/jobs/{key}/stop")
    text = client.get(f"/jobs/{key}").text
    assert 'id="job-again"' not in text and 'href="/ingest"' in text
    assert post(client, f"/jobs/{key}/again").status_code == 422


def test_jobs_are_filtered_by_state(pages: Window, odd: Odd) -> None:
    client, store = pages
    failed = fail(store, odd)
    waiting = odd.ask(store, "later").key
    text = client.get("/jobs?state=failed").text
    assert f'href="/jobs/{failed}"' in text and f'href="/jobs/{waiting}"' not in text
    assert "No job is running." in client.get("/jobs?state=running").text
    wrong = client.get("/jobs?state=lost")
    assert wrong.status_code == 422 and 'id="state-error"' in wrong.text and "<option selected>lost" in wrong.text


# --- words ----------------------------------------------------------------------------------------------------------
NOW = datetime(2026, 1, 1, 12, tzinfo=UTC)


def view(**changed: object) -> JobView:
    job = JobView(
        1,
        "odd",
        "odd",
        "running",
        1,
        4,
        "",
        None,
        None,
        None,
        None,
        None,
        1,
        "w",
        False,
        NOW,
        NOW - timedelta(0, 60),
        None,
    )
    return replace(job, **changed)


@pytest.mark.parametrize(("job", "words"), [
    (view(), "It has run for 1 min 0 s; about 3 min 0 s remain."),
    (view(done=0, total=0), "It has run for 1 min 0 s."),
    (view(state="waiting", started_at=None), "It has not started yet."),
    (view(state="stopped", started_at=None), "It did not start."),
    (view(state="done", ended_at=NOW - timedelta(0, 20)), "It took 40 s."),
])  # fmt: skip
def test_times_are_told_in_words(job: JobView, words: str) -> None:
    assert time_words(job, NOW) == words


@pytest.mark.parametrize(("address", "words"), [
    ("/campaigns/spring%2F1", "Open campaign spring/1"),
    ("/diagnoses/3", "Open diagnosis 3"),
    ("/tune/8", "Open the proposed settings"),
    ("/elsewhere", "Open the result"),
])  # fmt: skip
def test_the_button_says_what_it_opens(address: str, words: str) -> None:
    assert result_words(address) == words


def test_durations_and_next_steps_are_sentences() -> None:
    texts = {0.42: "0.4 s", 59.4: "59 s", 200: "3 min 20 s", 7500: "2 h 5 min"}
    assert {seconds: duration_words(seconds) for seconds in texts} == texts
    fault = view(state="failed", error="an error of pyroshock itself, KeyError: x")
    assert "whoever operates" in next_step_words(fault, True) and next_step_words(view(state="done"), True) == ""
