"""MLflow on PostgreSQL, as the machines of a laboratory share it."""

from __future__ import annotations

import threading
import uuid
from collections.abc import Iterator
from pathlib import Path

import pytest
from pyroshock.schema.session import make_engine
from pyroshock.training.fitting.fitting import fit_task, task_of
from pyroshock.training.registry.locks import exclusive_lock
from pyroshock.training.registry.model_storage import ModelStorage, storage_for
from pyroshock.training.registry.promotion import promote
from pyroshock.training.registry.registry import Registry
from sqlalchemy import make_url, text
from support.processes.crowd import MODELS, complaints, together
from support.stores.databases import _execute
from support.stores.registries import context_in, without_figures, without_judging_the_first
from support.stores.stores import opened


@pytest.fixture(scope="module")
def shared(postgres_url: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModelStorage]:
    """A place that nobody has used yet."""
    server, name = make_url(postgres_url), f"models_{uuid.uuid4().hex}"
    _execute(server, f'CREATE DATABASE "{name}"')
    uri = server.set(database=name).render_as_string(hide_password=False)
    files = str(tmp_path_factory.mktemp("share"))
    yield storage_for("sqlite:///lab.db", {"MLFLOW_TRACKING_URI": uri, "PYROSHOCK_MODELS": files})
    _execute(server, f'DROP DATABASE "{name}" WITH (FORCE)')


@pytest.mark.slow
def test_tables_made_by_all_at_once(shared: ModelStorage, tmp_path: Path) -> None:
    with opened(f"sqlite:///{tmp_path / 'lab.db'}", create=True):
        pass
    environment = {
        "MLFLOW_TRACKING_URI": shared.tracking_uri,
        "PYROSHOCK_MODELS": str(shared.folder),
    }
    commands = [[("models", "--db", f"sqlite:///{tmp_path / 'lab.db'}")]] * 4
    said = together(tmp_path / "said", commands, modules=MODELS, environment=environment)
    assert complaints(said) == []


def test_what_one_registers_another_reads_and_promotes(
    shared: ModelStorage, tmp_path: Path, monkeypatch
) -> None:
    """Two machines differ in their current folder, and in nothing of the place."""
    without_figures(monkeypatch)
    without_judging_the_first(monkeypatch)
    one, other = Registry(shared), Registry(shared)
    context = context_in(one)
    version = one.record(fit_task(task_of("hann", "repetitions", context), context))
    monkeypatch.chdir(tmp_path)
    assert other.versions() == [version]
    assert other.load(version).model.kind == "analytic"
    assert len(other.held_out(version).keys)
    decision = promote(
        other, "hann", version.version, lambda _: context.table, forced=True, reason="a start"
    )
    assert (one.champion("hammer").label, one.decisions()) == (version.label, [decision])
    assert list(tmp_path.iterdir()) == []


def test_turn_is_had_by_one(shared: ModelStorage) -> None:
    order, waits = [], threading.Event()

    def second() -> None:
        with exclusive_lock(shared, "training", waits.set):
            order.append("second")

    thread = threading.Thread(target=second)
    with exclusive_lock(shared, "training"), exclusive_lock(shared, "registering"):
        thread.start()
        assert waits.wait(30)
        order.append("first")
    thread.join(30)
    assert order == ["first", "second"]


def test_turn_ends_with_its_connection(shared: ModelStorage) -> None:
    """As when its process is killed, or its machine is switched off."""
    with exclusive_lock(shared, "training"):
        engine = make_engine(shared.tracking_uri)
        with engine.connect() as connection:
            held = (
                "SELECT pg_terminate_backend(pid, 5000) FROM pg_locks JOIN "
                "pg_database d ON d.oid = database "
            )
            held += "WHERE locktype = 'advisory' AND d.datname = current_database()"
            assert connection.scalars(text(held)).all() == [True]
        engine.dispose()
        with exclusive_lock(shared, "training", lambda: pytest.fail("it waits for a dead process")):
            pass


@pytest.mark.parametrize(
    ("given", "folder", "files"),
    [
        ("/srv/models", "/srv/models", "file:///srv/models"),
        ("file:///srv/our%20models", "/srv/our models", "file:///srv/our%20models"),
        ("s3://lab/models", "pyroshock-models", "s3://lab/models"),
    ],
)
def test_files_of_models_go_where_they_are_told(given: str, folder: str, files: str) -> None:
    environment = {
        "MLFLOW_TRACKING_URI": "postgresql+psycopg://lab@host/mlflow",
        "PYROSHOCK_MODELS": given,
    }
    place = storage_for("sqlite:///lab.db", environment)
    assert (place.folder, place.artifact_uri) == (Path.cwd() / folder, files)
