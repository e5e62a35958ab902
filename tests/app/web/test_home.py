"""The first page: what was recorded, what needs attention with a link to where one acts, what
runs."""

from __future__ import annotations

import datetime as dt
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest
from pyroshock.app.common.model_registry import registry_at
from pyroshock.app.jobs.queue import ask
from pyroshock.app.operations.plan.planning import make_plan
from pyroshock.app.pages.home_figures import gaps_plot, model_plot, plans_plot, recordings_plot
from pyroshock.app.pages.overview import list_attention, list_recent_campaigns, list_running
from pyroshock.dataset.catalog import list_snapshots
from pyroshock.schema.campaigns import Plan, PlannedRun
from pyroshock.schema.diagnoses import Diagnosis
from pyroshock.schema.jobs import DONE, FAILED, Job
from pyroshock.schema.recordings import SET_ASIDE, QualityFinding, Recording
from sqlalchemy import func, select, update
from support.checks.well_formed import Page
from support.processes.odd_jobs import claimed
from support.processes.web_client import sqlite, window
from support.stores.planned_runs import find_fault, record_run
from support.stores.web_stores import DATASET, FACTORS, GUN, HAMMER, PLAN, Lab

pytestmark = pytest.mark.timeout(600)


def sentences(lab: Lab, versions: Any = (), now: dt.datetime | None = None) -> dict[str, str]:
    with lab.store.reading() as session:
        return {item.sentence: item.address for item in list_attention(session, versions, now)}


def test_the_campaigns_stored_last_come_with_counts_and_quality(filled: Lab) -> None:
    with filled.store.reading() as session:
        rows = {row["campaign"]: row for row in list_recent_campaigns(session)}
    assert (rows[HAMMER]["impacts"], rows[GUN]["shots"], rows[GUN]["quality"]) == (
        20,
        5,
        "no recordings",
    )


def test_rejected_and_set_aside_recordings_need_attention(filled: Lab) -> None:
    assert not any(HAMMER in sentence for sentence in sentences(filled))
    with filled.store.writing() as session:
        first, second = session.scalars(select(Recording).limit(2)).all()
        second.status, second.reason = SET_ASIDE, "cut off"
        session.add(
            QualityFinding(
                recording_id=first.id,
                check="clipping",
                severity="reject",
                message="clipped",
                evidence={},
            )
        )
    addresses = sentences(filled)
    sentence = (
        f"{HAMMER}: 1 recording could not be read and was set aside; 1 recording "
        f"was rejected by the quality checks."
    )
    assert addresses[sentence] == f"/campaigns/{HAMMER}#quality"
    page = filled.client.get(f"/campaigns/{HAMMER}").text
    assert (
        "2 of 3 recordings are accepted, 1 is rejected; 1 could not be read and was set aside."
        in page
    )
    assert "The record is cut off at its extreme" in page and "repeat the run" in page
    assert "1 rejected, 1 set aside" in filled.client.get("/campaigns").text


def test_a_plan_that_is_half_done_names_its_runs(filled: Lab) -> None:
    make_plan(filled.store, "factorial", "half", kind="hammer", factors=FACTORS, seed=2)
    record_run(filled.store, "half", 1, range(1, 11))
    addresses = sentences(filled)
    assert addresses["Plan half: 1 of 4 runs are done."] == "/plans/half/sheet"
    record_run(filled.store, "half", 2, range(1, 11))
    find_fault(filled.store, "half", 2, 7)
    sentence = "Plan half: 1 of 4 runs are done; 1 run has rejected repetitions to record again."
    assert sentences(filled)[sentence] == "/plans/half/sheet"
    assert not any(PLAN in sentence for sentence in addresses)


def test_a_model_in_use_that_is_older_than_its_data_is_named(filled: Lab) -> None:
    with filled.store.reading() as session:
        digest = next(row["hash"] for row in list_snapshots(session) if row["name"] == DATASET)
    dataset = SimpleNamespace(hash=digest)
    model = SimpleNamespace(
        label="tree@1", name="tree", version=1, champion_of="hammer", dataset=dataset
    )
    (sentence,) = [words for words in sentences(filled, [model]) if "tree@1" in words]
    assert "has not learned from 1 pulse that came after dataset pulses was frozen" in sentence
    assert not any(
        "tree@1" in words for words in sentences(filled, [SimpleNamespace(champion_of=None)])
    )


def test_a_drift_of_the_newest_diagnosis_is_told(filled: Lab) -> None:
    def drifting(*words: str) -> dict[str, str]:
        with filled.store.writing() as session:
            report = session.scalars(select(Diagnosis.report)).first()
            changed = {**report, "where": {**report["where"], "drift": list(words)}}
            session.execute(update(Diagnosis).values(report=changed))
        return {
            words: address
            for words, address in sentences(filled).items()
            if "changes while" in words
        }

    sentence = f"{GUN} changes while the campaign goes on: the force falls by 4 %."
    assert drifting("the force falls by 4 %", "and more") == {sentence: "/diagnoses/1"}
    assert drifting() == {}


def test_a_failed_job_stays_until_the_same_succeeds_or_a_week_is_over(filled: Lab) -> None:
    now = dt.datetime.now(dt.UTC)

    def add(state: str, error: str | None) -> None:
        with filled.store.writing() as session:
            ended = {"ended_at": now, "asked_at": now, "address": "/", "error": error}
            session.add(
                Job(kind="ingest", label="Ingest of monday", arguments={}, state=state, **ended)
            )

    add(FAILED, "runs.csv: 1 fault\n  row 2")
    assert "“Ingest of monday” failed: runs.csv: 1 fault" in sentences(filled)
    assert not any("monday" in words for words in sentences(filled, now=now + dt.timedelta(days=8)))
    add(DONE, None)
    assert not any("monday" in words for words in sentences(filled))


def test_running_and_waiting_jobs_are_shown_with_their_progress(tmp_path) -> None:
    from pyroshock.app.jobs.known_kinds import KINDS
    from pyroshock.app.operations.ingest.extract import Extraction

    with window(sqlite(tmp_path), works=False) as (client, store):
        for name in ("spring", "autumn"):
            asked = Extraction(campaign=name)
            ask(store, KINDS["extract"], f"Extraction of {name}", asked)
        claimed(store)
        with store.writing() as session:
            session.execute(update(Job).where(Job.id == 1).values(done=3, total=4))
        with store.reading() as session:
            assert [job.label for job in list_running(session)] == [
                "Extraction of spring",
                "Extraction of autumn",
            ]
        page = client.get("/").text
        assert "3 of 4" in page and "waits" in page and '<progress max="4" value="3"' in page


def test_a_registry_that_cannot_be_read_is_told_and_hides_nothing(
    filled: Lab, monkeypatch: Any
) -> None:
    def broken(_: str) -> None:
        raise ValueError("the registry is of another version")

    monkeypatch.setattr("pyroshock.app.pages.home.registry_at", broken)
    page = filled.client.get("/")
    assert (
        page.status_code == 200
        and "the registry is of another version" in page.text
        and HAMMER in page.text
    )


def bars(plot: Any) -> dict[str, list[float]]:
    """The lengths of the bars of each entry of the legend."""
    return {
        own.name: (own.end - (0.0 if own.base is None else own.base)).tolist()
        for own in plot.series
    }


def test_the_pictures_show_what_is_stored(filled: Lab) -> None:
    """Recordings, runs and the error of a diagnosis, counted by other queries."""
    with filled.store.reading() as session:
        recordings = session.scalar(select(func.count()).select_from(Recording))
        runs = session.scalar(
            select(func.count())
            .select_from(PlannedRun)
            .join(Plan, PlannedRun.plan_id == Plan.id)
            .where(Plan.name == PLAN)
        )
        report = session.scalars(
            select(Diagnosis.report).order_by(Diagnosis.id.desc()).limit(1)
        ).one()
        by_day, plans, gaps = (plot(session) for plot in (recordings_plot, plans_plot, gaps_plot))
    assert sum(sum(counts) for counts in bars(by_day).values()) == recordings > 0
    place = plans.y.categories.index(PLAN)
    assert sum(counts[place] for counts in bars(plans).values()) == runs > 0
    tolerance = report["gap"]["tolerance"]
    assert gaps.y.categories[0].startswith(GUN)
    assert bars(gaps)["without effects"][0] == pytest.approx(report["gap"]["before"] / tolerance)
    assert bars(gaps)["with the effects found"][0] == pytest.approx(
        report["shrinkage"][0]["after"] / tolerance
    )
    page = Page(filled.client.get("/").text)
    ids = {attributes.get("id") for _, attributes in page.elements}
    assert {"recordings-by-day", "models-in-use", "errors-by-campaign", "runs-by-plan"} <= ids


def test_the_picture_of_models_shows_versions_of_the_same_pulses_alone(filled: Lab) -> None:
    registry = registry_at(filled.db)
    assert registry is not None
    linear, tree = (
        next(version for version in registry.versions() if version.name == name)
        for name in ("linear", "tree")
    )
    assert model_plot([linear, tree]) is None
    other_dataset = replace(linear.dataset, hash="0" * 64)
    versions = [
        replace(linear, version=2, champion_of="hammer"),
        replace(linear, version=1),
        replace(linear, version=3, dataset=other_dataset),
        tree,
    ]
    plot: Any = model_plot(versions)
    assert plot.y.categories == ("linear@1", "linear@2, hammer")
    in_use = next(own for own in plot.series if own.name == "in use")
    error = linear.metrics["force_nrmse"]
    assert (in_use.y.tolist(), in_use.x.tolist()) == ([1.0], [pytest.approx(100 * error.mean)])
    assert in_use.x_low.tolist() == [pytest.approx(100 * error.low)]


def test_pictures_of_a_store_without_them_say_so(empty: Lab) -> None:
    with empty.store.reading() as session:
        assert [plot(session) for plot in (recordings_plot, plans_plot, gaps_plot)] == [None] * 3
    assert model_plot([]) is None
