"""A clock that is set back changes no content, and what was made last stays what is newest."""

from __future__ import annotations

import json
from datetime import UTC, datetime, timedelta

import pytest
import time_machine
from pyroshock.app.demo.demo import ingest_examples
from pyroshock.app.operations.diagnose.diagnosing import keep
from pyroshock.app.operations.diagnose.stored import list_diagnoses
from pyroshock.app.operations.train.comparing import versions_named
from pyroshock.ingest.extraction.settings import ExtractionSettings
from pyroshock.ingest.load import ingest_folder
from pyroshock.training.fitting.session import Progress, train
from pyroshock.training.models.analytic import Analytic
from pyroshock.training.registry.listing import chosen, in_order, newest
from pyroshock.training.registry.promotion import promote
from support.records import verdicts
from support.records.campaigns import hammer_campaign
from support.stores.hammer_stores import full_campaign
from support.stores.registries import context_in, fresh_registry, without_figures
from support.stores.stores import content, ingested, opened, pyroshock, run_pyroshock

NOW = datetime(2030, 6, 1, 12, 0, tzinfo=UTC)
SPLITS = ["repetitions"]


@pytest.fixture
def clock():
    """A clock that ticks, and can be set; processes that are started have the machine's own."""
    with time_machine.travel(NOW) as traveller:
        yield traveller


@pytest.fixture
def back(clock):
    """Sets the clock back by a day, each time it is called with anything."""
    return lambda *_: clock.shift(timedelta(days=-1))


def test_ingest_is_the_same_while_the_clock_goes_back(tmp_path, back, sqlite_url):
    folder = hammer_campaign(tmp_path / "c", recordings=3)
    usual = f"sqlite:///{tmp_path / 'usual.db'}"
    ingested(usual, folder)
    with opened(sqlite_url, create=True) as store:
        for _ in range(2):
            ingest_folder(store, folder, ExtractionSettings(), jobs=1, progress=back)
            back()
    assert content(sqlite_url) == content(usual)


def test_pulses_cut_last_are_in_use(tmp_path, back, sqlite_url):
    ingested(sqlite_url, hammer_campaign(tmp_path / "c"))
    first = pyroshock("impacts", "--json", "--db", sqlite_url).stdout
    for words, differs in ((("--threshold", "0.2"), True), ((), False)):
        back()
        run_pyroshock("extract", "hammer", *words, "--db", sqlite_url)
        assert (pyroshock("impacts", "--json", "--db", sqlite_url).stdout != first) == differs


def test_datasets_are_listed_as_they_were_made(tmp_path, back, sqlite_url):
    ingested(sqlite_url, full_campaign(tmp_path / "c"))
    run_pyroshock("dataset", "build", "b", "--from", "spring", "--db", sqlite_url)
    back()
    ingested(sqlite_url, full_campaign(tmp_path / "d", name="autumn", seed=2))
    run_pyroshock("dataset", "build", "a", "--from", "autumn", "--db", sqlite_url)
    rows = json.loads(run_pyroshock("dataset", "list", "--json", "--db", sqlite_url).stdout)
    assert [row["name"] for row in rows] == ["b", "a"]


@pytest.fixture
def registry(tmp_path, monkeypatch):
    without_figures(monkeypatch)
    return fresh_registry(tmp_path)


@pytest.mark.slow
def test_model_registered_last_is_the_newest(registry, back):
    context = context_in(registry)
    train(registry, context, ["hertz", "hann"], SPLITS, progress=Progress(step=back))
    train(registry, context, ["hertz"], SPLITS, retrain=True)
    versions = registry.versions()
    assert [version.label for version in versions] == ["hertz@2", "hann@1", "hertz@1"]
    assert (
        versions[0].registered_at < versions[2].registered_at
        and in_order(reversed(versions)) == versions
    )
    assert chosen(versions, "hertz").label == "hertz@2"
    assert [version.label for version in newest(versions)] == ["hertz@2", "hann@1"]
    assert [v.label for v in train(registry, context, ["hertz"], SPLITS).versions] == ["hertz@2"]


@pytest.mark.slow
def test_comparison_takes_the_dataset_trained_on_last(registry, back):
    for name in ("spring", "autumn"):
        train(registry, context_in(registry, name=name), ["hertz", "hann"], SPLITS)
        back()
    found = versions_named(registry.versions(), (), None, "repetitions")
    assert {version.dataset.name for version in found} == {"autumn"}


@pytest.mark.slow
def test_seconds_of_a_training_are_by_no_clock_that_is_set(registry, back, monkeypatch):
    fit = Analytic.fit
    monkeypatch.setattr(Analytic, "fit", lambda *given: (back(), fit(*given))[1])
    (version,) = train(registry, context_in(registry), ["hann"], SPLITS).versions
    assert 0 <= version.cost.seconds < 60


@pytest.mark.slow
def test_model_promoted_last_is_in_use(registry, back):
    context = context_in(registry)
    train(registry, context, ["hann", "hertz", "linear"], SPLITS)
    for name in ("hann", "hertz", "linear"):
        promote(registry, name, 1, lambda _: context.table, forced=True, reason=f"now {name}")
        back()
    with (
        registry.connection.client() as client
    ):  # as a kill would leave it, before the alias was taken from the other
        client.set_registered_model_alias("hann", "champion-hammer", "1")
    assert registry.champion("hammer").label == "linear@1"
    decisions = registry.decisions()
    assert [decision.candidate for decision in decisions] == ["linear@1", "hertz@1", "hann@1"]
    assert decisions[0].when < decisions[2].when


@pytest.mark.slow
def test_diagnosis_made_last_is_the_newest(back, sqlite_url):
    with opened(sqlite_url, create=True) as store:
        ingest_examples(store)
        keys = []
        for _ in range(2):
            keys.append(keep(store, verdicts.verdict(campaign="first-shots")))
            back()
        with store.reading() as session:
            rows = list_diagnoses(session)
            assert [row["id"] for row in rows] == keys[::-1] and rows[0]["diagnosed_at"] < rows[1][
                "diagnosed_at"
            ]
