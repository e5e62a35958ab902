"""MLflow's tables give what MLflow itself gives of them, and are read only where they are known."""

from __future__ import annotations

import math
import sqlite3
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Any

import pytest
from pyroshock.training.estimators.base import FitReport
from pyroshock.training.fitting.fitting import fit_task, task_of
from pyroshock.training.registry import mlflow_tables
from pyroshock.training.registry.connection import RegistryError
from pyroshock.training.registry.decisions import decide
from pyroshock.training.registry.mlflow_tables import TableReader
from pyroshock.training.registry.model_storage import storage_for
from pyroshock.training.registry.records import Decision, Version
from pyroshock.training.registry.registry import Registry
from support.stores.registries import context_in, fresh_registry, without_figures

#: Of a name that SQL would take for the end of a text.
ODD_NAME = 'd\'Été "α"; --'
REPORT = FitReport(
    {"force.noise": 0.0125, "force.kernel": "matern"}, {}, {"force.loss": [2.0, math.pi, -0.1]}
)


@dataclass(frozen=True)
class FilledRegistry:
    """A registry with versions of several splits, in use and deleted, whose reading changes none of
    it."""

    registry: Registry
    versions: tuple[Version, ...]


@pytest.fixture(scope="module")
def filled(tmp_path_factory) -> Iterator[FilledRegistry]:
    with pytest.MonkeyPatch.context() as patch:
        without_figures(patch)
        registry = fresh_registry(tmp_path_factory.mktemp("O'Brien's lab ü"))
        yield FilledRegistry(registry, _filled(registry))


def _filled(registry: Registry) -> tuple[Version, ...]:
    context = context_in(registry)
    dataset = replace(context.dataset, name=ODD_NAME)
    session = registry.open_session(dataset, 0)

    def register(model: str, split: str = "repetitions", **changes: object) -> Version:
        trained = fit_task(task_of(model, split, context), context)
        return registry.record(replace(trained, dataset=dataset, **changes), session)

    versions = (
        register("hann", fit_report=REPORT),
        register("hann", "configurations"),
        register("linear"),
        register("tree"),
    )
    registry.close_session(session, {}, {"repetitions": "{}", ODD_NAME: '{"é": 1}'})
    with registry.connection.client() as client:
        hann = client.get_model_version("hann", "1")
        for name in (ODD_NAME, "deleted"):
            client.create_registered_model(name)
            for _ in range(2):
                client.create_model_version(
                    name, hann.source, hann.run_id, tags={**hann.tags, "odd": ODD_NAME}
                )
        client.set_registered_model_alias(ODD_NAME, "champion", "1")
        client.delete_registered_model("deleted")
        client.delete_model_version(ODD_NAME, "2")
    registry.delete(versions[3])
    registry.set_champion(versions[2])
    for number, candidate in enumerate(versions[:2]):
        registry.decide(_decision(candidate, bool(number)), candidate)
    _leave_open(registry, versions[2])
    return versions


def _decision(candidate: Version, promoted: bool) -> Decision:
    return Decision(
        candidate.label,
        None,
        "hammer",
        promoted,
        True,
        f"the reason is {ODD_NAME}",
        "nothing",
        0,
        {"crps.candidate": 0.25},
        "somebody@ünsere-bank",
        datetime(2026, 11, 30, tzinfo=UTC),
    )


def _leave_open(registry: Registry, candidate: Version) -> None:
    """A decision that was cut short before its candidate was put in use."""
    with registry.connection.client() as client, pytest.MonkeyPatch.context() as patch:
        patch.setattr("pyroshock.training.registry.decisions.crown", _killed)
        reader, experiment = registry.connection.reader_of(client), registry.connection.experiment
        assert experiment is not None
        with pytest.raises(KeyboardInterrupt):
            decide(client, reader, experiment, _decision(candidate, True), candidate)


def _killed(*_: object) -> None:
    raise KeyboardInterrupt


def in_tables(registry: Registry) -> bool:
    with registry.connection.reading() as reader:
        return isinstance(reader, TableReader)


def listings(registry: Registry, versions: tuple[Version, ...]) -> dict[str, Any]:
    """What lists, pages and the twin ask of a registry."""
    present = versions[:3]
    return {
        "versions": registry.versions(),
        "recorded": registry.recorded(),
        "decisions": registry.decisions(),
        "champions": [registry.champion(name) for name in ("hammer", "gun")],
        "floors": registry.floors(versions[0].dataset.hash, 0),
        "settings": [registry.fit_settings(version) for version in present],
        "histories": [registry.fit_histories(version) for version in present],
        "searches": [registry.searches(version) for version in present],
        "held out": [registry.held_out(version).keys.tolist() for version in present],
        "models": [registry.load(version).about for version in present],
        "damages": [registry.damage(version) for version in present],
    }


def test_installed_mlflow_makes_the_tables_that_are_known(tmp_path):
    assert in_tables(fresh_registry(tmp_path))


def test_tables_give_the_listings_that_mlflow_gives(filled, monkeypatch):
    assert in_tables(filled.registry)
    from_tables = listings(filled.registry, filled.versions)
    monkeypatch.setattr(mlflow_tables, "REVISION", "of another MLflow")
    assert not in_tables(filled.registry)
    assert listings(filled.registry, filled.versions) == from_tables
    labels = {version.label for version in from_tables["versions"]}
    assert labels == {"hann@1", "linear@1", f"{ODD_NAME}@1"}
    assert from_tables["champions"][0].label == "hann@1"
    assert [decision.promoted for decision in from_tables["decisions"]] == [True, False]
    assert from_tables["floors"] == {"repetitions": "{}", ODD_NAME: '{"é": 1}'}
    assert from_tables["histories"][0]["force.loss"] == [(0, 2.0), (1, math.pi), (2, -0.1)]


def records(registry: Registry, versions: tuple[Version, ...]) -> dict[str, Any]:
    """What a reader gives of the same registry."""
    runs = [version.run_id for version in versions]
    with registry.connection.reading() as reader:
        return {
            "versions": reader.versions(),
            "aliases": reader.aliases(),
            "runs": [
                reader.runs_with(tag, value)
                for tag, value in (
                    ("pyroshock.decision", None),
                    ("pyroshock.task", None),
                    ("pyroshock.task", versions[0].task_key),
                    ("pyroshock.none", None),
                )
            ],
            "single runs": [reader.find_run(run) for run in runs],
            "histories": reader.histories(runs[0], ["fit.force.loss", "seconds", "none"]),
            "version": reader.find_version_location(ODD_NAME, 1),
            "model": reader.find_model_location(versions[1].model_id),
        }


def test_tables_give_the_records_that_mlflow_gives(filled, monkeypatch):
    from_tables = records(filled.registry, filled.versions)
    monkeypatch.setattr(mlflow_tables, "REVISION", "of another MLflow")
    assert records(filled.registry, filled.versions) == from_tables
    assert [len(runs) for runs in from_tables["runs"]] == [3, 3, 1, 0]
    assert from_tables["version"].startswith("file:")


def test_what_is_deleted_is_not_there_for_either(filled, monkeypatch):
    tree = filled.versions[3]
    for revision in (mlflow_tables.REVISION, "of another MLflow"):
        monkeypatch.setattr(mlflow_tables, "REVISION", revision)
        with pytest.raises(RegistryError, match="tree"):
            filled.registry.load(tree)


def test_registry_that_is_not_made_yet_has_nothing(tmp_path):
    registry = Registry(storage_for(f"sqlite:///{tmp_path / 'lab.db'}", {}))
    with mlflow_tables.known_tables(registry.place, "pyroshock") as reader:
        assert reader is None
    assert (registry.versions(), registry.decisions(), registry.floors("", 0)) == ([], [], {})
    assert list(tmp_path.iterdir()) == []


def test_tables_are_made_by_mlflow_where_there_are_none(tmp_path):
    registry = Registry(storage_for(f"sqlite:///{tmp_path / 'lab.db'}", {}))
    registry.place.database.touch()
    assert not in_tables(registry)
    assert in_tables(registry) and registry.versions() == []


def test_models_of_another_workspace_are_told_by_mlflow(tmp_path):
    registry = fresh_registry(tmp_path)
    with closing(sqlite3.connect(registry.place.database)) as connection, connection:
        connection.execute("INSERT INTO registered_models (name, workspace) VALUES ('a', 'other')")
    with pytest.raises(RegistryError, match="workspace"):
        registry.versions()


def test_tracking_server_is_asked_through_mlflow(tmp_path):
    place = storage_for(
        f"sqlite:///{tmp_path / 'lab.db'}", {"MLFLOW_TRACKING_URI": "http://127.0.0.1:9"}
    )
    with mlflow_tables.known_tables(place, "pyroshock") as reader:
        assert reader is None


def test_file_that_is_no_database_is_refused(tmp_path):
    registry = Registry(storage_for(f"sqlite:///{tmp_path / 'lab.db'}", {}))
    registry.place.database.write_bytes(b"no database" * 1000)
    with pytest.raises(RegistryError, match="cannot be read: file is not a database"):
        registry.versions()


def test_locked_file_is_read_when_the_lock_is_given_back(tmp_path, monkeypatch):
    """The wait for one lock is shorter here than the lock is held: the reading begins again."""
    monkeypatch.setattr(mlflow_tables, "_BUSY_S", 0.01)
    registry = fresh_registry(tmp_path)
    holds = threading.Event()

    def hold() -> None:
        database = sqlite3.connect(registry.place.database, isolation_level=None)
        with closing(database) as connection:
            connection.execute("BEGIN EXCLUSIVE")
            holds.set()
            time.sleep(0.5)
            connection.execute("ROLLBACK")

    thread = threading.Thread(target=hold)
    thread.start()
    assert holds.wait(30)
    assert registry.versions() == [] and not thread.is_alive()
    thread.join()
