"""Stores that tests of keeping damage, copy and carry (`care_stores` says what is in them)."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def care_source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the store `lab.db`, and of the campaign folders that it was filled from; tests only read it."""
    from support.stores.care_stores import fill

    folder = tmp_path_factory.mktemp("care")
    fill(folder)
    return folder


@pytest.fixture
def care_copy(care_source: Path, tmp_path: Path) -> str:
    """The address of an SQLite copy that a test may change."""
    shutil.copyfile(care_source / "lab.db", tmp_path / "lab.db")
    return f"sqlite:///{tmp_path / 'lab.db'}"


@pytest.fixture(params=["sqlite", "postgresql"])
def care_store(request: pytest.FixtureRequest, care_source: Path) -> Iterator[str]:
    """The same on either engine in turn."""
    if request.param == "sqlite":
        yield request.getfixturevalue("care_copy")
        return
    with request.getfixturevalue("postgres_copy")(care_source / "lab.db") as url:
        yield url


@pytest.fixture
def postgres_database(postgres_url: str) -> Iterator[str]:
    """An empty PostgreSQL database."""
    from support.stores.databases import fresh_database

    with fresh_database(postgres_url) as url:
        yield url
