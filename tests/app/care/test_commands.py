"""`pyroshock db` as scripts and people meet it, and what a damaged store still serves."""

from __future__ import annotations

import json
import shutil
from types import SimpleNamespace

import pytest
from pyroshock.app.operations.store.check import damaged_models
from support.processes.web_client import window
from support.stores.care_stores import GUN, HAMMER, execute, flip
from support.stores.hammer_stores import url_of
from support.stores.stores import opened
from support.stores.stores import run_pyroshock as run

CHUNK = "channel_id = 1 AND number = 1"
SAID = "test-01.npz, force: channel 1: chunk 1 is damaged"


@pytest.fixture
def damaged(care_copy: str) -> str:
    """A store with one byte of one chunk changed, in the first recording's force."""
    flip(care_copy, "series_chunks", "frame", CHUNK, 40)
    return care_copy


def test_check_tells_scripts_and_people(care_copy):
    sound = run("db", "check", "--db", care_copy, "--json")
    assert (
        json.loads(sound.stdout) == {"sound": True, "findings": []} and "is sound" in sound.stderr
    )
    flip(care_copy, "series_chunks", "frame", CHUNK, 40)
    row, finding = json.loads(run("db", "check", "--db", care_copy, "--json", code=1).stdout)[
        "findings"
    ]
    assert (row["check"], row["table"], row["row"], row["chunk"]) == (
        "rows",
        "series_chunks",
        "1/1",
        1,
    )
    assert "--repair FOLDER" in row["advice"]
    place = {key: finding[key] for key in ("check", "campaign", "recording", "channel", "chunk")}
    assert place == {
        "check": "series", "campaign": HAMMER, "recording": "recordings/test-01.npz",
        "channel": "force", "chunk": 1,
    }  # fmt: skip
    assert "--repair FOLDER" in finding["advice"]
    _, line = run("db", "check", "--db", care_copy, code=1).stdout.splitlines()
    assert line.startswith(
        "series: campaign spring, recording recordings/test-01.npz, channel force, chunk 1: "
    )
    assert run("db", "check", "--fast", "--db", care_copy).stdout == ""
    assert run("db", "check", "--campaign", GUN, "--db", care_copy).stdout == ""


@pytest.mark.slow
def test_check_of_nothing_and_copy_of_an_older_store_are_refused(care_copy, tmp_path):
    assert "no store at" in run("db", "check", "--db", url_of(tmp_path / "none.db"), code=2).stderr
    assert "known: " in run("db", "check", "--campaign", "winter", "--db", care_copy, code=2).stderr
    execute(care_copy, "UPDATE alembic_version SET version_num = '0003'")
    refused = run("db", "copy", care_copy, url_of(tmp_path / "new.db"), code=2)
    assert "older than 0013" in refused.stderr and not (tmp_path / "new.db").exists()


@pytest.mark.slow
def test_a_dataset_whose_pulses_were_changed_is_named(care_copy):
    execute(care_copy, "UPDATE pulses SET contact_time_s = contact_time_s * 1.0001 WHERE id = 12")
    pulse, dataset = run("db", "check", "--db", care_copy, code=1).stdout.splitlines()
    assert pulse.startswith(
        "rows: campaign spring, recording recordings/test-01.npz, table "
        "pulses, row 12, plan spring, "
    )
    assert "run 1, repetition 1: the row was altered" in pulse
    assert dataset.startswith("datasets: dataset small: ")


def test_a_registered_model_without_its_files_is_named():
    versions = [
        SimpleNamespace(
            label=f"{name}@1",
            name=name,
            run_id=name,
            split="repetitions",
            dataset=SimpleNamespace(name="small"),
        )
        for name in ("tree", "linear")
    ]
    wrong = {"linear@1": "linear@1: no model.json"}
    registry = SimpleNamespace(
        versions=lambda: versions, damage=lambda version: wrong.get(version.label)
    )
    (finding,) = damaged_models(registry)
    assert (finding.place, finding.message) == ({"model": "linear@1"}, "linear@1: no model.json")
    assert finding.advice.endswith("pyroshock train small --models linear --split repetitions")


def test_damaged_series_are_read_again_from_their_folder(damaged, care_source, tmp_path):
    execute(damaged, "DELETE FROM series_chunks WHERE channel_id = 4 AND number = 0")
    folder = shutil.copytree(care_source / HAMMER, tmp_path / HAMMER)
    result = run("db", "check", "--repair", folder, "--db", damaged)
    assert [line for line in result.stderr.splitlines() if "mended" in line] == [
        "mended: spring, recordings/test-01.npz: force",
        "mended: spring, recordings/test-02.mat: acceleration_1",
    ]


@pytest.mark.slow
def test_another_file_repairs_nothing(damaged, care_source, tmp_path):
    folder = shutil.copytree(care_source / HAMMER, tmp_path / HAMMER)
    shutil.copy(folder / "recordings/test-02.mat", folder / "recordings/test-01.npz")
    result = run("db", "check", "--repair", folder, "--db", damaged, code=1)
    assert (
        "test-01.npz: force: recordings/test-01.npz: the file has changed since it was ingested"
        in result.stderr
    )


def test_copies_and_archives_say_what_they_made(care_copy, tmp_path, monkeypatch):
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    (tmp_path / "lab-models.db").touch()
    target = url_of(tmp_path / "new.db")
    result = run("db", "copy", care_copy, target, "--json")
    tables = {table["name"]: table["rows"] for table in json.loads(result.stdout)}
    assert (tables["impacts"], tables["series_chunks"]) == (11, 13)
    assert (
        f"The models stay in sqlite:///{tmp_path}/lab-models.db. Set MLFLOW_TRACKING_URI"
        in result.stderr
    )
    assert "holds a store already" in run("db", "copy", care_copy, target, code=2).stderr
    run("db", "export", HAMMER, "--out", tmp_path / "s.pyroshock", "--db", care_copy)
    there = url_of(tmp_path / "there.db")
    report = json.loads(
        run("db", "import", tmp_path / "s.pyroshock", "--db", there, "--json").stdout
    )
    assert (report["campaigns"], report["added"]["impacts"], report["left_behind"]) == (
        [HAMMER],
        10,
        [],
    )
    again = run("db", "import", tmp_path / "s.pyroshock", "--db", there)
    assert again.stderr == "spring: all of it was there\n"
    run("db", "check", "--db", there)
    left = json.loads(run("db", "import", tmp_path / "lab.db", "--db", there, "--json").stdout)[
        "left_behind"
    ]
    assert left == ["3 rows of audit_rows", "1 rows of dataset_snapshots", "1 rows of jobs",
                    "10 rows of snapshot_pulses",
                    "1 rows of tombstones", "1 rows of twin_configurations"]  # fmt: skip


def test_damage_keeps_no_page_from_being_shown(damaged):
    execute(
        damaged, "UPDATE pulses SET fine_force_n = :nothing WHERE id IN (2, 13)", nothing=b"x" * 40
    )
    with window(damaged) as (client, _):
        broken, other, whole = (client.get(f"/impacts/{key}") for key in (1, 6, 2))
        compared = client.get("/compare?factor=tip_material&campaign=*&rejected=true")
        zoomed = client.get("/api/channels/1?start_s=0&stop_s=0.01"), client.get("/api/channels/1")
    assert broken.status_code == 200 and SAID in broken.text and "pyroshock db check" in broken.text
    assert 'data-figure="channels-data"' in broken.text and 'id="damaged-force"' in broken.text
    assert 'id="damaged-acceleration' not in broken.text
    assert other.status_code == 200 and "is damaged" not in other.text
    assert whole.status_code == 200 and "is damaged" in whole.text
    assert (
        compared.status_code == 200
        and 'id="damaged"' in compared.text
        and "damaged (pyroshock db check says more): 2." in compared.text
    )
    assert [answer.status_code for answer in zoomed] == [200, 422]  # what was not touched is served
    assert SAID in zoomed[1].json()["detail"]


def test_damage_is_named_by_exports_and_left_out_on_request(damaged, tmp_path):
    out = tmp_path / "series.csv"
    refused = run("export", "series", "--out", out, "--db", damaged, code=2)
    assert (
        "recording recordings/test-01.npz, channel force: channel 1: chunk 1 is damaged"
        in refused.stderr
    )
    assert not out.exists()
    told = run("export", "series", "--skip-damaged", "--out", out, "--db", damaged)
    assert (
        "left out: campaign spring, recording recordings/test-01.npz, channel force" in told.stderr
    )
    lines = out.read_text().splitlines()
    with opened(damaged) as store, store.reading() as session:
        total = (
            session.connection()
            .exec_driver_sql("SELECT sum(samples) FROM channels WHERE id <> 1")
            .scalar_one()
        )
    assert len(lines) == 1 + total
    run("impacts", "--db", damaged)
    run("export", "pulses", "--out", tmp_path / "pulses.csv", "--db", damaged)
    run(
        "export",
        "series",
        "--recording",
        "recordings/test-02.mat",
        "--out",
        tmp_path / "x.csv",
        "--db",
        damaged,
    )


@pytest.mark.slow
def test_a_changed_sample_without_a_checksum_is_found_by_its_hash(care_copy, tmp_path):
    """A store that was filled before frames had one: a slice is read, the whole is not taken for
    what was recorded."""
    from pyroshock.schema.series import decode, encode
    from pyroshock.schema.tables import metadata

    with opened(care_copy) as store, store.reading() as session:
        table = metadata.tables["series_chunks"]
        frame = (
            session.execute(table.select().where(table.c.channel_id == 4, table.c.number == 0))
            .one()
            .frame
        )
    samples = decode(frame, "<f4")
    samples[100] = 7.5
    bare = encode(samples)[:-4]
    execute(
        care_copy,
        "UPDATE series_chunks SET frame = :bare WHERE channel_id = 4 AND number = 0",
        bare=bare,
    )
    _, line = run("db", "check", "--db", care_copy, code=1).stdout.splitlines()
    assert (
        "recording recordings/test-02.mat, channel acceleration_1: its samples have the SHA-256"
        in line
    )
    refused = run("export", "series", "--recording", "recordings/test-02.mat", "--out",
    tmp_path / "x.csv", "--db",
                  care_copy, code=2)  # fmt: skip
    assert "its samples have the SHA-256" in refused.stderr
