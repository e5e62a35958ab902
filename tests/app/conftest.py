"""A folder of the test's own, without a registry or a store of anybody's, and plates that need no
solution."""

from __future__ import annotations

from pathlib import Path

import pytest
from pyroshock.app.common import progress
from pyroshock.app.demo.demo import ingest_examples
from pyroshock.app.twins import building
from support.records.campaigns import gun_campaign
from support.records.twin_parts import unsolved
from support.stores.stores import ingested, opened


@pytest.fixture(autouse=True)
def _quick_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """Work that a busy machine does slowly is quick all the same: a log has no line of its
    progress."""
    monkeypatch.setattr(progress, "SILENT_S", 120.0)


@pytest.fixture(scope="session")
def spring_lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a store `lab.db` with the gun campaign "spring", and of the campaign's folder;
    tests copy it."""
    place = tmp_path_factory.mktemp("spring")
    ingested(f"sqlite:///{place / 'lab.db'}", gun_campaign(place / "folder", name="spring"))
    return place


@pytest.fixture(scope="session")
def examples_db(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store of the examples that ship with the software; tests copy it."""
    file = tmp_path_factory.mktemp("examples") / "lab.db"
    with opened(f"sqlite:///{file}", create=True) as store:
        ingest_examples(store)
    return file


@pytest.fixture
def quick_twins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """That folder, the current one; twins are built at once."""
    monkeypatch.chdir(tmp_path)
    for name in ("MLFLOW_TRACKING_URI", "PYROSHOCK_DB"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(building, "solved", unsolved)
    return tmp_path
