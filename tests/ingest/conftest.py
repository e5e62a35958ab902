"""A store that is in use, the check that a refused campaign leaves no trace in it, and a recording
of each recipe."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from pyroshock.schema.session import Store, Writer, open_store
from support.records.campaigns import gun_campaign, hammer_campaign
from support.records.recipes import (
    RECIPES,
    Sample,
    Truth,
    base_truth,
    write_ide,
    write_lvm,
    write_mat73,
    write_tdms,
    write_uff,
)
from support.stores.stores import counts, ingest, ingested

Refused = Callable[..., str]


@pytest.fixture(scope="session")
def store_in_use(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An SQLite store with two campaigns, to be copied."""
    folder = tmp_path_factory.mktemp("in-use")
    path = folder / "used.db"
    ingested(
        f"sqlite:///{path}",
        hammer_campaign(folder / "h", 1, 1, "earlier"),
        gun_campaign(folder / "g", 1, "shots"),
    )
    return path


@pytest.fixture
def store(sqlite_url: str) -> Iterator[Store]:
    """A new store in a file."""
    with open_store(sqlite_url, Writer("test", "0"), create=True) as store:
        yield store


@pytest.fixture
def any_store(tables_url: str) -> Iterator[Store]:
    """A new store of either kind."""
    with open_store(tables_url, Writer("test", "0"), create=True) as store:
        yield store


@pytest.fixture
def used_url(store_in_use: Path, tmp_path: Path) -> str:
    """A store that holds other campaigns already."""
    return f"sqlite:///{shutil.copy(store_in_use, tmp_path / 'used.db')}"


@pytest.fixture(scope="session")
def hammer_in_a_store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of `hammer.db` and of the good hammer campaign in it, to be copied."""
    folder = tmp_path_factory.mktemp("hammer")
    ingested(f"sqlite:///{folder / 'hammer.db'}", hammer_campaign(folder / "campaign"))
    return folder


@pytest.fixture
def stored_hammer(hammer_in_a_store: Path, tmp_path: Path, sqlite_url: str) -> tuple[str, Path]:
    """A store of the good hammer campaign alone, and its folder: ingested once, then copied."""
    shutil.copyfile(hammer_in_a_store / "hammer.db", sqlite_url.removeprefix("sqlite:///"))
    return sqlite_url, shutil.copytree(hammer_in_a_store / "campaign", tmp_path / "campaign")


@pytest.fixture
def hammer_folder(tmp_path: Path) -> Path:
    """A good hammer campaign: two recordings, two hits and two rows each."""
    return hammer_campaign(tmp_path / "campaign")


@pytest.fixture
def gun_folder(tmp_path: Path) -> Path:
    """A good gun campaign: three shots, velocities in the table."""
    return gun_campaign(tmp_path / "campaign")


@pytest.fixture
def refused(used_url: str, sqlite_url: str) -> Refused:
    """`refused(folder, *words)`: the ingest says why on one line that holds the words, exits with 2
    and stores nothing, neither in a store in use nor in a new one. Returns the line."""

    def check(folder: Path, *words: str) -> str:
        before, seeded = counts(used_url), counts(sqlite_url)
        result = ingest(used_url, folder)
        lines = result.stderr.splitlines()
        assert (result.exit_code, result.stdout, len(lines)) == (2, "", 1), result.output
        for word in words:
            assert word in lines[0]
        assert counts(used_url) == before
        assert ingest(sqlite_url, folder).exit_code == 2
        assert counts(sqlite_url) == seeded
        return lines[0]

    return check


@pytest.fixture(scope="session", params=RECIPES)
def sample(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Sample:
    """One recording of each recipe; treat it as read-only."""
    suffix, write = RECIPES[request.param]
    path = tmp_path_factory.mktemp("recordings") / f"{request.param}{suffix}"
    return Sample(path, write(path, base_truth()))


@pytest.fixture(scope="session")
def make_recording() -> Callable[..., Truth]:
    """`make_recording("tdms", path, parts=3)` writes one recipe and returns what its format holds
    of the truth."""
    writers = {
        "mat73": write_mat73,
        "tdms": write_tdms,
        "lvm": write_lvm,
        "uff": write_uff,
        "ide": write_ide,
    }

    def make(recipe: str, path: Path, **options: Any) -> Truth:
        return writers[recipe](path, base_truth(), **options)

    return make
