"""A backup of store and registry, made while others write, gives all of it back when the originals
are gone."""

from __future__ import annotations

import shutil
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from pyroshock.app.common.model_registry import registry_of
from pyroshock.app.operations.store.backup import back_up, restore
from pyroshock.schema.engine import StoreError
from pyroshock.schema.session import count_rows
from pyroshock.training.fitting.fitting import fit_task, task_of
from pyroshock.training.registry.registry import Registry
from support.records.campaigns import hammer_campaign
from support.stores.registries import context_in, fresh_registry, without_figures
from support.stores.stores import counts, ingested, opened, pyroshock, run_pyroshock


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A server's store keeps its models in the current folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    without_figures(monkeypatch)


@pytest.fixture(params=["sqlite", "postgresql"])
def places(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Callable[[str], str]]:
    """Addresses of empty places of one engine, by name."""
    from support.stores.databases import fresh_database

    if request.param == "sqlite":
        yield lambda name: f"sqlite:///{tmp_path / name}.db"
        return
    server = request.getfixturevalue("postgres_url")
    with ExitStack() as stack:
        yield lambda _: stack.enter_context(fresh_database(server))


def _registry(url: str, tmp_path: Path) -> Registry:
    place = registry_of(url).place
    assert place.database is not None
    made = fresh_registry(tmp_path, place.database.stem.removesuffix("-models"))
    assert made.place.database == place.database
    return made


def _train(registry: Registry, split: str = "repetitions") -> None:
    context = context_in(registry)
    registry.record(fit_task(task_of("linear", split, context), context))


def test_store_and_registry_are_back_when_the_originals_are_gone(
    places: Callable[[str], str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    url = places("lab")
    ingested(url, hammer_campaign(tmp_path / "spring", recordings=2, name="spring"))
    registry = _registry(url, tmp_path)
    _train(registry)
    stop, problems = threading.Event(), []

    def work() -> None:
        number = 0
        while not stop.is_set():
            number += 1
            folder = hammer_campaign(
                tmp_path / f"more-{number}", recordings=1, hits=1, name=f"more-{number}"
            )
            result = pyroshock("ingest", folder, "--db", url, "--jobs", "1")
            problems.extend([result.stderr] if result.exit_code else [])

    thread = threading.Thread(target=work)
    thread.start()
    try:
        with opened(url) as store:
            report = back_up(store, url, tmp_path / "backup")
    finally:
        stop.set()
        thread.join()
    assert problems == [] and report.has_registry and report.model_files > 3
    predicted = registry.load(registry.versions()[0]).model
    before = counts(url)
    if url.startswith("sqlite"):
        for name in ("lab.db", "lab.db-wal", "lab.db-shm"):
            (tmp_path / name).unlink(missing_ok=True)
    assert registry.place.database is not None
    registry.place.database.unlink()
    shutil.rmtree(registry.place.folder)

    # MLflow keeps connections to a file of its own process: elsewhere, as on another machine.
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    again = places("elsewhere/restored")
    run_pyroshock("db", "restore", tmp_path / "backup", "--db", again)
    restored = counts(again)
    assert restored["series_chunks"] > 0
    assert all(
        0 < restored[table] <= before[table]
        for table in ("campaigns", "recordings", "impacts", "series_chunks")
    )
    run_pyroshock("db", "check", "--db", again)
    back = registry_of(again)
    (version,) = back.versions()
    assert version.label == "linear@1" and back.damage(version) is None
    assert type(back.load(version).model) is type(predicted)
    _train(back, "configurations")
    assert len(back.versions()) == 2 and all(
        back.damage(record) is None for record in back.versions()
    )


def test_a_backup_that_was_altered_or_has_no_room_is_refused(tmp_path: Path) -> None:
    url, folder = f"sqlite:///{tmp_path / 'lab.db'}", tmp_path / "backup"
    ingested(url, hammer_campaign(tmp_path / "spring", recordings=1, hits=1, name="spring"))
    run_pyroshock("db", "backup", folder, "--db", url)
    with opened(url) as store:
        before = count_rows(store)
        with pytest.raises(StoreError, match="there already"):
            back_up(store, url, folder)
    with pytest.raises(StoreError, match="holds a store already"):
        restore(folder, url)
    changes: tuple[tuple[Callable[[Path], object], str], ...] = (
        (
            lambda path: path.write_bytes(path.read_bytes()[:-1] + b"x"),
            "store.db is not as it was written",
        ),
        (lambda path: path.with_name("further").write_bytes(b"x"), "further was not in it"),
        (Path.unlink, "store.db is missing"),
        (lambda path: path.with_name("backup.json").write_text("{}"), "is no backup"),
    )
    for change, words in changes:
        altered = shutil.copytree(folder, tmp_path / "altered")
        change(altered / "store.db")
        with pytest.raises(StoreError, match=words):
            restore(altered, f"sqlite:///{tmp_path / 'other.db'}")
        shutil.rmtree(altered)
        assert not (tmp_path / "other.db").exists()
    run_pyroshock("db", "restore", folder, "--db", f"sqlite:///{tmp_path / 'other.db'}")
    # The audit trail of the store that was made says who made it.
    written = {table: before[table] + 1 for table in ("provenance", "audit_rows")}
    assert counts(f"sqlite:///{tmp_path / 'other.db'}") == {**before, **written}


def test_a_registry_of_another_kind_has_its_own_backup(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    run_pyroshock("init", "--db", url)
    monkeypatch.setenv("MLFLOW_TRACKING_URI", "postgresql+psycopg://lab@server/models")
    assert "deploy/backup.sh" in pyroshock("db", "backup", tmp_path / "b", "--db", url).stderr
    assert not (tmp_path / "b").exists()
