"""Addresses of stores: what is stored is kept, at the very path that was written (field cases 33
and 39)."""

from __future__ import annotations

import sqlite3
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pyroshock as ps
import pytest
from click.testing import CliRunner
from pyroshock.app.doors.command_line.main import main
from pyroshock.schema.addresses import AddressError, parse_store_address
from pyroshock.training.registry.model_storage import storage_for
from support.records.campaigns import hammer_campaign


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name in ("PYROSHOCK_DB", "MLFLOW_TRACKING_URI"):
        monkeypatch.delenv(name, raising=False)
    return tmp_path


@pytest.mark.parametrize(
    "address",
    ["sqlite://", "sqlite:///", "sqlite:///:memory:", ":memory:",
     "sqlite:///file::memory:?cache=shared", "sqlite+pysqlite:///",
     "sqlite:///file:lab.db?mode=memory&uri=true", "sqlite:", "", " "],
)  # fmt: skip
def test_a_store_in_memory_is_refused_where_something_is_to_be_kept(
    address: str, folder: Path
) -> None:
    campaign = hammer_campaign(folder / "spring", recordings=1, hits=1, name="spring")
    for words in (["ingest", str(campaign)], ["init"], ["impacts"]):
        answer = CliRunner().invoke(main, [*words, "--db", address])
        assert answer.exit_code == 2, answer.output
        assert "would be kept" in answer.stderr and "sqlite:///FILE.db" in answer.stderr
    with pytest.raises(ps.StorageError, match="would be kept"):
        ps.open(address)


@pytest.mark.parametrize("address", ["sqlite://lab.db", "sqlite:lab.db", "sqlite:/lab.db"])
def test_too_few_slashes_are_told(address: str) -> None:
    with pytest.raises(AddressError, match=r"three slashes: sqlite:///lab\.db"):
        parse_store_address(address)


def test_options_behind_a_name_are_refused_with_the_address_without_them() -> None:
    with pytest.raises(AddressError, match=r"\?mode=ro'.*leave them out: sqlite:///lab.db$"):
        parse_store_address("sqlite:///lab.db?mode=ro")


@pytest.mark.parametrize(
    "name", ["a b#c%20e?x/lab.db", "lab?.db", "100%.db", "what?year=2026.db", "é ü.db", "a@b.db"]
)
def test_a_path_is_taken_sign_for_sign_by_command_and_library(name: str, folder: Path) -> None:
    place = folder / name
    place.parent.mkdir(exist_ok=True)
    for address in (f"sqlite:///{place}", str(place), f"sqlite:///{name}", name):
        place.unlink(missing_ok=True)
        answer = CliRunner().invoke(main, ["init", "--db", address])
        assert answer.exit_code == 0 and place.is_file(), answer.output
        files = sorted(str(file.relative_to(folder)) for file in folder.rglob("*.db"))
        assert files == [name]
        with ps.open(address, create=False) as store:
            assert len(store.impacts()) == 0
        assert storage_for(address, {}).database == place.with_name(f"{place.stem}-models.db")


def test_the_option_and_the_variable_take_the_path_of_a_file_as_the_library_does(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    campaign = hammer_campaign(folder / "spring", recordings=1, hits=1, name="spring")
    with ps.open("lab.db") as store:
        store.ingest(campaign, progress=False)
    listed = CliRunner().invoke(main, ["campaigns", "--db", "lab.db", "--json"])
    assert listed.exit_code == 0 and '"spring"' in listed.output
    monkeypatch.setenv("PYROSHOCK_DB", "./lab.db")
    assert CliRunner().invoke(main, ["campaigns", "--json"]).output == listed.output
    assert (
        CliRunner().invoke(main, ["db", "copy", "lab.db", str(folder / "copy.db")]).exit_code == 0
    )
    with sqlite3.connect(folder / "copy.db") as copy:
        assert copy.execute("SELECT name FROM campaigns").fetchall() == [("spring",)]
    copy.close()


@pytest.mark.parametrize(
    "address", ["mysql:lab", "postgresql:lab", "host=x dbname=lab", "user:word@host/lab"]
)
def test_what_is_no_path_is_no_path(address: str) -> None:
    with pytest.raises(AddressError, match="unreadable address"):
        parse_store_address(address)


@pytest.mark.parametrize(
    "path", ["C:\\lab\\shots.db", "C:/lab/shots.db", "/lab/shots.db", "../shots.db", "shots"]
)
def test_paths_of_every_system_are_paths(path: str) -> None:
    assert parse_store_address(path).database == path
    assert parse_store_address(f"sqlite:///{path}").database == path


def test_a_folder_is_no_store(folder: Path) -> None:
    with pytest.raises(ps.StorageError, match="is a folder; a store is a file"):
        ps.open(folder)


def test_three_first_ingests_at_once_leave_two_campaigns_once_each(folder: Path) -> None:
    for name in ("spring", "summer"):
        hammer_campaign(folder / name, recordings=1, hits=1, name=name)

    def ingest(name: str) -> int:
        with ps.open("lab.db") as store:
            store.ingest(folder / name, jobs=1, progress=False)
        return 0

    with ThreadPoolExecutor(3) as pool:
        assert list(pool.map(ingest, ("spring", "summer", "spring"))) == [0, 0, 0]
    with ps.open("lab.db") as store:
        assert (
            sorted(store.campaigns()["name"]) == ["spring", "summer"] and len(store.impacts()) == 2
        )
