"""Pages of jobs: state, count, remaining time, result in words, what to do after a failure, and the
filter by state."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from pyroshock.app.jobs.known_kinds import KINDS
from pyroshock.app.jobs.queue import JobView, ask, get_job, stop_job
from pyroshock.app.operations.catalogue import OPERATIONS, operation
from pyroshock.app.operations.diagnose.blind_check import BlindCheckRequest
from pyroshock.app.operations.diagnose.request import DiagnosisRequest
from pyroshock.app.operations.faults import read
from pyroshock.app.operations.tune.request import Tuning
from pyroshock.app.operations.validate.request import ValidationRequest
from pyroshock.app.web.job_words import duration_words, next_step_words, result_words, time_words
from pyroshock.schema.session import Store
from starlette.testclient import TestClient
from support.checks.well_formed import Page
from support.processes.odd_jobs import Odd, odd, work_off
from support.processes.web_client import post, sqlite, window
from support.stores.web_stores import DATASET, FACTORS, GUN, HAMMER

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
    assert (
        'id="job-result"' not in text
        and 'id="job-stop"' in text
        and "You can leave this page" in text
    )


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
    stored = {
        "target": "spring",
        "simulator": "models:/gp@1",
        "tolerances": {"gun": 0.02, "plate": 0.5},
        "uncertain": {"gun.friction_coefficient": 0.05},
        "seed": 7,
    }  # as a former version stored it
    key = ask(store, KINDS["diagnose"], "Diagnosis", KINDS["diagnose"].read(stored)).key
    work_off(store)
    page = Page(client.get(f"/jobs/{key}").text)
    (link,) = (item["href"] for item in page.of("a") if item.get("id") == "job-form")
    assert link == f"/diagnoses?again={key}"
    assert client.get(f"/jobs/{key}/form").json()["fields"] == {
        "campaign": "spring",
        "simulator": "models:/gp@1",
        "tolerances": "gun=2%,plate=0.5dB",
        "uncertain": "gun.friction_coefficient=0.05",
        "seed": "7",
    }


SPECIFICATION = "frequency_hz,level_g\n100,30\n10000,300\n"
#: Arguments of a job of each kind that a form asks for, none of them what the form has of itself.
ASKED: dict[str, Any] = {
    **{
        kind: KINDS[kind].read(
            {
                **{"path": {"path": "/lab/spring"}, "plan": "winter"},
                **{"segmentation": "mask", "threshold": 0.03},
            }
        )
        for kind in ("ingest", "check")
    },
    "describe": KINDS["describe"].read({"path": {"path": "/lab/spring"}}),
    "db-check": KINDS["db-check"].read({"campaign": HAMMER, "fast": True}),
    "archive": KINDS["archive"].read({"campaign": HAMMER, "reason": "the bench was rebuilt"}),
    "extract": KINDS["extract"].read(
        {"campaign": HAMMER, "segmentation": "mask", "threshold": 0.03, "smoothing": 0.2}
    ),
    "plan-predict": KINDS["plan-predict"].read(
        {"name": "winter", "runs": "3-7", "contact": "hertz", "draws": 40, "seed": 3}
    ),
    "plan": KINDS["plan"].read(
        {
            **{"name": "winter", "method": "lhs", "kind": "hammer", "runs": 12, "seed": 7},
            **{"repetitions": 3, "factors": {"text": FACTORS}, "description": "cold"},
            "criterion": "maximin",
        }
    ),
    "train": KINDS["train"].read(
        {"dataset": DATASET, "models": ["linear", "gp"], "split": "repetitions", "seed": 5}
        | {"budget": "full"}
    ),
    "learning-curve": KINDS["learning-curve"].read({"model": "linear", "version": 1}),
    # as older software has stored it
    "tune": read(
        Tuning,
        {
            "target": SPECIFICATION,
            "tolerance": "6dB",
            "measured": [HAMMER],
            "campaign": GUN,
            "plate": None,
            "contact": None,
            "sensor": None,
            "factors": "",
            "share": 0.9,
            "q": 10.0,
            "extrapolate": False,
            "adopted": True,
            "seed": 0,
            "at_least": 0.8,
        },
        "stored",
    ),
    "validate": read(
        ValidationRequest,
        {"campaign": GUN, "contact": "hertz", "folds": 5, "draws": 64, "seed": 0},
        "stored",
    ),
    "diagnose": DiagnosisRequest(campaign=GUN, tolerances={"gun": 0.02}, seed=4),
    "plan-augment": KINDS["plan-augment"].read({"name": "winter", "runs": 2, "seed": 4}),
    "blind-check": BlindCheckRequest(cases=2, split="development"),
}
#: Kinds without a form of values: their files are chosen again.
WITHOUT_VALUES = {"restore"}


@pytest.fixture
def unworked(filled_lab: Path, quick_plates: None, tmp_path: Path) -> Iterator[Window]:
    """The pages of a filled store whose jobs nobody works off."""
    shutil.copy(filled_lab / "lab.db", tmp_path / "lab.db")
    with window(sqlite(tmp_path), folders=(tmp_path,), works=False) as client_and_store:
        yield client_and_store


def test_every_kind_of_job_has_a_form_that_takes_its_values_back(unworked: Window) -> None:
    client, store = unworked
    jobs = {
        name
        for name in KINDS
        if name not in OPERATIONS
        or (
            operation(name).long
            and ("json" not in operation(name).absent or operation(name).form is not None)
        )
    }
    assert set(ASKED) | WITHOUT_VALUES == jobs - {"odd"}
    missing = []
    for name, arguments in ASKED.items():
        key = ask(store, KINDS[name], name, arguments).key
        stop_job(store, key)
        link = Page(client.get(f"/jobs/{key}").text)
        (address,) = (item["href"] for item in link.of("a") if item.get("id") == "job-form")
        assert address is not None
        page = Page(client.get(address.partition("#")[0]).text)
        values = client.get(f"/jobs/{key}/form").json()
        assert bool(values["fields"]) == (f"again={key}" in address)
        controls = {
            item["name"]
            for tag in ("input", "select", "textarea")
            for item in page.of(tag)
            if "name" in item
        }
        if values["fields"]:
            assert values["form"] in {form.get("id") for form in page.of("form")}
            missing += [f"{name}: {field}" for field in set(values["fields"]) - controls]
    assert missing == []


def test_form_of_a_job_has_the_texts_that_were_typed(unworked: Window) -> None:
    client, store = unworked

    def fields(name: str) -> dict[str, Any]:
        key = ask(store, KINDS[name], name, ASKED[name]).key
        values: dict[str, Any] = client.get(f"/jobs/{key}/form").json()["fields"]
        return values

    plan = {
        "name": "winter",
        "runs": "12",
        "repetitions": "3",
        "seed": "7",
        "factors": FACTORS,
        "criterion": "maximin",
    }
    assert plan.items() <= fields("plan").items()
    assert (
        fields("train")["models"] == ["linear", "gp"] and fields("tune")["target"] == SPECIFICATION
    )
    assert fields("check") == {
        "path": "spring",  # without the place where the server keeps it
        "segmentation": "mask",
        "threshold": "0.03",
        "plan": "winter",
    }
    extract = ask(store, KINDS["extract"], "e", ASKED["extract"]).key
    stop_job(store, extract)
    text = client.get(f"/jobs/{extract}").text
    assert (
        f"/campaigns/{HAMMER}/extract?segmentation=mask&amp;threshold=0.03&amp;smoothing=0.2"
        in text
    )
    assert client.get("/jobs/999/form").status_code == 404


def test_an_upload_that_failed_is_sent_anew(pages: Window, tmp_path: Path) -> None:
    client, store = pages
    key = ask(
        store,
        KINDS["ingest"],
        "Ingest",
        KINDS["ingest"].read(
            {"path": {"path": str(tmp_path), "scratch": str(tmp_path / "scratch")}}
        ),
    ).key
    post(client, f"/jobs/{key}/stop")
    text = client.get(f"/jobs/{key}").text
    assert 'id="job-again"' not in text and f'href="/ingest?again={key}"' in text
    assert client.get(f"/jobs/{key}/form").json()["form"] == "upload"
    assert post(client, f"/jobs/{key}/again").status_code == 422


def test_jobs_are_filtered_by_state(pages: Window, odd: Odd) -> None:
    client, store = pages
    failed = fail(store, odd)
    waiting = odd.ask(store, "later").key
    text = client.get("/jobs?state=failed").text
    assert f'href="/jobs/{failed}"' in text and f'href="/jobs/{waiting}"' not in text
    assert "No job is running." in client.get("/jobs?state=running").text
    wrong = client.get("/jobs?state=lost")
    assert (
        wrong.status_code == 422
        and 'id="state-error"' in wrong.text
        and "<option selected>lost" in wrong.text
    )


# --- words ---
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
    (view(done=9, total=100), "It has run for 1 min 0 s."),
    (view(done=10, total=100), "It has run for 1 min 0 s; about 9 min 0 s remain."),
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
    assert (
        "whoever operates" in next_step_words(fault, True)
        and next_step_words(view(state="done"), True) == ""
    )
