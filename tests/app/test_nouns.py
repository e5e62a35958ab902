"""One grammar for every noun: list, show, delete; what is in use is not deleted; and the next step
after a job."""

from __future__ import annotations

import json
from pathlib import Path

import click
import pytest
from pyroshock.app.doors.command_line.main import main
from pyroshock.app.jobs.known_kinds import KINDS
from pyroshock.app.jobs.queue import ask
from pyroshock.app.operations.diagnose.diagnosing import keep
from support.records.verdicts import verdict
from support.stores.hammer_stores import copied, filled_store, full_campaign
from support.stores.registries import fresh_registry, without_figures
from support.stores.stores import opened, refusal, run_pyroshock

NOUNS = (
    "campaigns",
    "plans",
    "runs",
    "impacts",
    "datasets",
    "models",
    "diagnoses",
    "jobs",
    "views",
)


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store with the hammer campaign "spring": two recordings of several impacts."""
    root = tmp_path_factory.mktemp("campaigns")
    return filled_store(root, full_campaign(root / "a"))


@pytest.fixture
def lab(filled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """The address of a copy of that store, the one that commands take by default."""
    url = copied(filled, tmp_path)
    fresh_registry(tmp_path)
    without_figures(monkeypatch)
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    monkeypatch.setenv("PYROSHOCK_DB", url)
    return url


def rows(*words: str) -> list[dict]:
    return json.loads(run_pyroshock(*words, "--json").stdout)


@pytest.mark.parametrize("noun", NOUNS)
def test_every_noun_has_list_show_and_delete(noun):
    group = main.get_command(click.Context(main), noun)
    assert isinstance(group, click.Group)
    assert {"list", "show", "delete"} <= set(group.list_commands(click.Context(group)))


@pytest.mark.parametrize("noun", [noun for noun in NOUNS if noun != "runs"])
def test_a_noun_alone_lists(noun, lab):
    assert run_pyroshock(noun, "--json").stdout == run_pyroshock(noun, "list", "--json").stdout


def test_options_before_a_command_count_for_it(lab, monkeypatch):
    monkeypatch.setenv("PYROSHOCK_DB", "sqlite:///missing.db")
    shown = run_pyroshock("campaigns", "--db", lab, "show", "spring").stdout
    assert shown.startswith("name ") and "spring" in shown
    assert rows("impacts", "--campaign", "spring", "--db", lab, "list") == rows(
        "impacts", "--db", lab
    )


def test_a_campaign_and_a_recording_are_shown_with_what_they_hold(lab):
    assert rows("campaigns", "show", "spring")["campaign"]["name"] == "spring"
    path = rows("runs", "list", "spring")[0]["recording"]
    contents = rows("runs", "show", "spring", path)
    assert contents["recording"] == path and contents["impacts"] and contents["channels"]
    assert "no recording 'x'" in refusal("runs", "show", "spring", "x")


def test_a_plan_is_deleted_unless_something_was_recorded_for_it(lab):
    run_pyroshock("plan", "lhs", "autumn", "--runs", "4")
    assert "add --yes" in refusal("plans", "delete", "autumn")
    assert "nothing was deleted" in run_pyroshock("plans", "delete", "autumn", "--dry-run").stderr
    assert [row["name"] for row in rows("plans")] == ["autumn"]
    assert "with its 4 runs" in run_pyroshock("plans", "delete", "autumn", "--yes").stderr
    assert rows("plans") == [] and "no plan 'autumn'" in refusal(
        "plans", "delete", "autumn", "--yes"
    )


def test_a_plan_with_recorded_runs_is_kept(lab, tmp_path):
    run_pyroshock("plan", "lhs", "autumn", "--runs", "4", "--repetitions", "1")
    with opened(lab) as store:
        from pyroshock.schema.campaigns import PlannedRun
        from pyroshock.schema.impacts import Impact
        from sqlalchemy import select

        def link(session):
            session.scalars(select(Impact)).first().planned_run_id = session.scalars(
                select(PlannedRun.id)
            ).first()

        store.write(link)
    assert "recorded in campaign spring" in refusal("plans", "delete", "autumn", "--yes")


def test_a_dataset_is_deleted_unless_models_were_trained_on_it(lab):
    run_pyroshock("dataset", "build", "pulses", "--from", "spring", "--quality", "none")
    run_pyroshock("train", "pulses", "--models", "hann", "--split", "configurations")
    assert "hann@1 was trained on it" in refusal("datasets", "delete", "pulses", "--yes")
    run_pyroshock("models", "delete", "hann@1", "--yes")
    assert rows("models") == [] and "no registered model 'hann'" in refusal("models", "hann@1")
    run_pyroshock("datasets", "delete", "pulses", "--yes")
    assert rows("datasets") == []
    run_pyroshock("db", "check")


def test_the_model_in_use_is_not_deleted_and_a_number_is_not_given_again(lab):
    run_pyroshock("dataset", "build", "pulses", "--from", "spring", "--quality", "none")
    run_pyroshock("train", "pulses", "--models", "hann", "--split", "configurations")
    run_pyroshock("promote", "hann", "1", "--force", "--reason", "the only one")
    assert "model in use" in refusal("models", "delete", "hann@1", "--yes")
    run_pyroshock("train", "pulses", "--models", "hann", "--split", "configurations", "--retrain")
    run_pyroshock("models", "delete", "hann@2", "--yes")
    run_pyroshock("train", "pulses", "--models", "hann", "--split", "configurations", "--retrain")
    assert [row["version"] for row in rows("models", "--all")] == [3, 1]
    assert "expected MODEL@VERSION" in refusal("models", "delete", "hann", "--yes")


def test_a_diagnosis_is_listed_shown_and_deleted_unless_it_was_adopted(lab):
    with opened(lab) as store:
        number = keep(store, verdict(campaign="spring"))
    assert [row["id"] for row in rows("diagnoses", "--campaign", "spring")] == [number]
    assert run_pyroshock("diagnoses", "show", str(number)).stdout.startswith("The model error is ")
    assert rows("diagnoses", "show", str(number))["campaign"] == "spring"
    run_pyroshock("diagnoses", "delete", str(number), "--yes")
    assert rows("diagnoses") == [] and "no diagnosis" in refusal(
        "diagnoses", "delete", str(number), "--yes"
    )


def test_a_job_is_deleted_when_it_has_ended(lab):
    with opened(lab) as store:
        ask(
            store,
            KINDS["plan"],
            "Plan",
            KINDS["plan"].read({"name": "x", "method": "lhs", "runs": 4, "repetitions": 1}),
        )
    assert rows("jobs", "show", "1")["state"] == "waiting"
    assert "it is waiting; stop it first" in refusal("jobs", "delete", "1", "--yes")
    run_pyroshock("jobs", "stop", "1")
    run_pyroshock("jobs", "delete", "1", "--yes")
    assert rows("jobs") == []


def test_an_impact_is_deleted_with_its_recording_and_a_reason(lab):
    impact = rows("impacts")[0]["id"]
    assert "--reason is missing" in refusal("impacts", "delete", str(impact))
    words: tuple[str, ...] = (
        "impacts",
        "delete",
        str(impact),
        "--reason",
        "the plate had come loose",
    )
    assert "holds other impacts too" in refusal(*words)
    words += ("--all-of-recording",)
    assert "would delete" in run_pyroshock(*words, "--dry-run").stderr
    before = len(rows("impacts"))
    run_pyroshock(*words)
    assert 0 < len(rows("impacts")) < before
    assert rows("campaigns", "deleted")[0]["reason"] == "the plate had come loose"


def test_the_next_step_is_told_to_people_alone_with_the_store_that_was_named(lab, monkeypatch):
    words = ("dataset", "build", "pulses", "--from", "spring", "--quality", "none")
    assert run_pyroshock(*words).stderr.splitlines()[-1] == "next: pyroshock train pulses"
    assert "next:" not in run_pyroshock(*words, "--json").stderr
    named = run_pyroshock(*words, "--db", lab).stderr.splitlines()[-1]
    assert named == f"next: pyroshock train pulses --db {lab}"
    assert run_pyroshock("plan", "lhs", "x", "--runs", "4").stderr.splitlines()[-1] == (
        "next: pyroshock plan sheet x --out x.html"
    )
