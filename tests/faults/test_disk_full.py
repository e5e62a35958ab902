"""A full disk ends a command with one line that says where, and leaves nothing half; with room, a
repeat completes."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import Result
from pyroshock.app.common.errors import words_of
from pyroshock.training.fitting.session import train
from pyroshock.training.registry.connection import RegistryError
from pyroshock.training.registry.intact_models import damages
from support.processes.small_disks import SmallDisk, small_disk
from support.records.campaigns import hammer_campaign
from support.stores.databases import _execute
from support.stores.many_databases import OnServer, on_server
from support.stores.postgres_server import _account
from support.stores.registries import context_in, fresh_registry, without_figures
from support.stores.stores import (
    assert_whole,
    content,
    ingest,
    ingested,
    opened,
    pyroshock,
    run_pyroshock,
)

HITS = 2


@pytest.fixture
def disk(tmp_path) -> Iterator[SmallDisk]:
    with small_disk(tmp_path / "small", "1m") as found:
        yield found


@pytest.fixture(scope="module")
def campaign(tmp_path_factory) -> Path:
    """About a megabyte of series: noise that packs badly."""
    return hammer_campaign(tmp_path_factory.mktemp("campaign") / "c", recordings=12, hits=HITS)


@pytest.fixture(scope="module")
def full_store(tmp_path_factory, campaign) -> str:
    url = f"sqlite:///{tmp_path_factory.mktemp('store') / 'lab.db'}"
    ingested(url, campaign)
    assert (
        pyroshock("plan", "lhs", "autumn", "--kind", "hammer", "--runs", "6", "--db", url).exit_code
        == 0
    )
    return url


def refused(result: Result, *words: str) -> None:
    assert result.exit_code == 2, (result.exit_code, result.output, result.stderr)
    assert result.stderr.count("\n") == 1, result.stderr
    for word in (*words, "make room"):
        assert word in result.stderr


def test_ingest_into_a_full_disk_is_completed_with_room(disk, campaign, full_store):
    url = f"sqlite:///{disk.folder / 'lab.db'}"
    refused(ingest(url, campaign), "lab.db", "full")
    disk.make_room()
    assert_whole(url, HITS)
    ingested(url, campaign)
    assert content(url)["pulses"] == content(full_store)["pulses"]


@pytest.mark.slow
def test_what_was_stored_is_read_on_a_full_disk(disk, campaign):
    url = f"sqlite:///{disk.folder / 'lab.db'}"
    ingest(url, campaign)
    disk.fill()
    assert pyroshock("impacts", "--db", url).exit_code == 0


OUTPUTS = {
    "series.csv": "export series --out",
    "impacts.json": "impacts --json",
    "impact.png": "show 1 --plot",
}
OUTPUTS |= dict.fromkeys(("pulses.csv", "pulses.parquet"), "export pulses --out")
OUTPUTS |= dict.fromkeys(("report.html", "report.pdf"), "report hammer --out")
OUTPUTS |= dict.fromkeys(("sheet.html", "sheet.csv", "sheet.xlsx"), "plan sheet autumn --out")
QUICK = ("series.csv", "impacts.json", "sheet.html")


@pytest.mark.parametrize(
    "name",
    [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in OUTPUTS],
)
def test_output_is_whole_or_as_it_was(disk, full_store, name):
    out = disk.folder / name
    out.write_text("of yesterday", encoding="utf-8")
    disk.fill()
    refused(pyroshock(*OUTPUTS[name].split(), out, "--db", full_store), name)
    assert out.read_text(encoding="utf-8") == "of yesterday"
    assert {file.name for file in disk.folder.iterdir()} == {name, "filler"}


NEW_PLACES = {
    "copy.db": "db copy {store} sqlite:///{out}",
    "hammer.pyroshock": "db export hammer --out {out} --db {store}",
    "simulated": "simulate autumn --out {out} --db {store}",
}


@pytest.mark.slow
@pytest.mark.parametrize("name", NEW_PLACES)
def test_new_place_is_whole_or_made_with_room(disk, full_store, name, coarse_plates):
    out = disk.folder / name
    words = NEW_PLACES[name].format(store=full_store, out=out).split()
    disk.fill(leave_kb=300)
    refused(pyroshock(*words), name)
    disk.make_room()
    run_pyroshock(*words)
    if name == "copy.db":
        assert content(f"sqlite:///{out}") == content(full_store)


@pytest.mark.slow
def test_training_on_a_full_disk_is_completed_with_room(disk, monkeypatch):
    without_figures(monkeypatch)
    registry = fresh_registry(disk.folder)
    context = context_in(registry)
    disk.fill(leave_kb=400)
    with pytest.raises((OSError, RegistryError)) as refusal:
        train(registry, context, ["hann", "hertz", "linear"], ["repetitions"])
    assert "make room" in words_of(refusal.value) and "lab-models" in words_of(refusal.value)
    disk.make_room()
    assert damages(registry, registry.versions()) == {}
    session = train(registry, context, ["hann", "hertz", "linear"], ["repetitions"])
    assert [version.label for version in session.versions] == ["hann@1", "hertz@1", "linear@1"]


@pytest.mark.slow
def test_server_without_room_is_told_and_completed_with_room(
    postgres_url, tmp_path, campaign, full_store
):
    with small_disk(tmp_path / "small", "12m") as disk, on_server(postgres_url) as databases:
        url = on_disk(databases, disk)
        disk.fill(leave_kb=500)
        refused(ingest(url, campaign), "No space left on device")
        disk.make_room()
        assert_whole(url, HITS)
        ingested(url, campaign)
        assert content(url)["pulses"] == content(full_store)["pulses"]
        databases.drop()
        _execute(databases.server, "DROP TABLESPACE small")


def on_disk(databases: OnServer, disk: SmallDisk) -> str:
    """A database whose tables lie on the small disk; skips where the server cannot get there."""
    for folder in (disk.folder, *disk.folder.parents[:-1]):
        folder.chmod(folder.stat().st_mode | 0o011)
    room = disk.folder / "tables"
    room.mkdir()
    import psycopg

    account = _account()
    if account is not None:
        shutil.chown(room, account)
    try:
        _execute(databases.server, f"CREATE TABLESPACE small LOCATION '{room}'")
    except psycopg.Error as error:
        pytest.skip(f"the server cannot use a disk of the test's: {error}")
    url = databases.empty("TABLESPACE small")
    with opened(url, create=True):
        pass
    return url
