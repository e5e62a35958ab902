"""How `runs.csv` names a recording: folders parted by / or \\, and several files that hold a
channel each."""

from __future__ import annotations

import hashlib
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.ingest.readers.recording_files import RecordingFiles, recording_path
from pyroshock.schema.recordings import RecordedChannel, Recording
from sqlalchemy import select
from support.records.campaigns import FS_HZ, hammer_campaign, hammer_rows, replace_in, write_runs
from support.records.plate_folders import plate_campaign
from support.stores.stores import (
    assert_whole,
    content,
    counts,
    ingest,
    ingest_report,
    ingested,
    opened,
    pyroshock,
)


def in_backslashes(rows):
    return [{**row, "recording": str(row["recording"]).replace("/", "\\")} for row in rows]


def test_path_of_windows_is_the_same_recording(sqlite_url, tmp_path):
    plain, windows = hammer_campaign(tmp_path / "c"), hammer_campaign(tmp_path / "w")
    ingested(sqlite_url, plain)
    before = content(sqlite_url)
    for folder in (plain, windows):
        write_runs(folder, in_backslashes(hammer_rows()))
    assert "nothing new" in ingested(sqlite_url, plain).stderr
    other = f"sqlite:///{tmp_path / 'other.db'}"
    ingested(other, windows)
    assert content(sqlite_url) == content(other) == before


def test_both_signs_part_folders(tmp_path):
    (tmp_path / "a" / "b").mkdir(parents=True)
    (tmp_path / "a" / "b" / "run.csv").touch()
    for text in ("a/b/run.csv", "a\\b\\run.csv", "a\\b/run.csv", ".\\a/b\\..\\b\\run.csv"):
        assert recording_path(tmp_path, text) == "a/b/run.csv"
    (tmp_path / "a;b.csv").touch()  # one file, whose name has a semicolon
    assert recording_path(tmp_path, "a;b.csv") == "a;b.csv"
    assert RecordingFiles(tmp_path, "a;b.csv").paths == (tmp_path / "a;b.csv",)


@pytest.mark.parametrize(
    "text",
    [
        "C:\\data\\run.csv",
        "c:run.csv",
        "\\run.csv",
        "/run.csv",
        "\\\\server\\share\\run.csv",
        "..\\run.csv",
        ".",
    ],
)
def test_path_outside_of_the_folder_is_refused(refused, hammer_folder, text):
    (hammer_folder.parent / "run.csv").touch()
    write_runs(hammer_folder, [{**row, "recording": text} for row in hammer_rows()])
    expected = (
        "a file of the campaign folder"
        if text == "."
        else "expected a file inside the campaign folder"
    )
    refused(hammer_folder, "row 2, column 'recording'", expected)


def split_campaign(tmp_path):
    """Three recordings of a force and two accelerations, each in three CSV files; the second
    acceleration has every other sample."""
    made = plate_campaign(tmp_path / "plate")
    steps = {"force": 1, "acceleration_1": 1, "acceleration_2": 2}
    for number, channels in made.written.items():
        (made.folder / f"{number}.npz").unlink()
        (made.folder / f"r{number}").mkdir()
        for name, step in steps.items():
            values = "\n".join(repr(float(value)) for value in channels[name][::step])
            text = f"# fs = {FS_HZ / step}\n{name}\n{values}\n"
            (made.folder / f"r{number}" / f"{name}.csv").write_text(text, encoding="utf-8")
    replace_in(
        made.folder / "runs.csv", ".npz", "/force.csv;r1/acceleration_1.csv; r1\\acceleration_2.csv"
    )
    table = made.folder / "runs.csv"
    lines = table.read_text(encoding="utf-8").splitlines()
    numbered = [
        line.replace("r1/", f"r{line[0]}/").replace("r1\\", f"r{line[0]}\\") for line in lines
    ]
    prefixed = [line.replace(f",{line[0]}/force", f",r{line[0]}/force") for line in numbered]
    table.write_text("\n".join(prefixed) + "\n", encoding="utf-8")
    return made


STORED = "r1/acceleration_1.csv;r1/acceleration_2.csv;r1/force.csv"


def test_files_of_one_recording_are_read_together(sqlite_url, tmp_path):
    made = split_campaign(tmp_path)
    report, _ = ingest_report(sqlite_url, made.folder)
    assert (report["recordings"], report["impacts"], report["set_aside"]) == (3, 6, [])
    with opened(sqlite_url) as store, store.reading() as session:
        row = session.scalars(select(Recording).where(Recording.path == STORED)).one()
        files = [made.folder / name for name in STORED.split(";")]
        hashes = "\n".join(hashlib.sha256(file.read_bytes()).hexdigest() for file in files)
        assert row.sha256 == hashlib.sha256(hashes.encode()).hexdigest()
        assert (row.format, row.size_bytes) == ("csv", sum(file.stat().st_size for file in files))
        channels = session.scalars(
            select(RecordedChannel).where(RecordedChannel.recording_id == row.id)
        ).all()
        assert {c.name: (c.sampling_rate_hz, c.samples) for c in channels} == {
            name: (FS_HZ / step, -(-made.written[1][name].size // step))
            for name, step in (("force", 1), ("acceleration_1", 1), ("acceleration_2", 2))
        }
    assert_whole(sqlite_url, 2)
    assert pyroshock("db", "check", "--db", sqlite_url).exit_code == 0


def test_impacts_are_those_of_one_file(sqlite_url, tmp_path):
    """The same samples in one file give the same peaks and times."""

    def figures(url):
        listed = json.loads(pyroshock("impacts", "--db", url, "--json").stdout)
        return [
            (row["run"], row["repetition"], row["peak_force_n"], row["contact_time_s"])
            for row in listed
        ]

    ingest_report(sqlite_url, split_campaign(tmp_path / "several").folder)
    other = f"sqlite:///{tmp_path / 'other.db'}"
    ingest_report(other, plate_campaign(tmp_path / "one").folder)
    assert figures(sqlite_url) == figures(other)


def test_ingest_again_in_another_order_adds_nothing_and_a_changed_file_is_noticed(
    sqlite_url, tmp_path
):
    made = split_campaign(tmp_path)
    ingest_report(sqlite_url, made.folder)
    before = counts(sqlite_url)
    replace_in(
        made.folder / "runs.csv",
        "r1/force.csv;r1/acceleration_1.csv; r1\\acceleration_2.csv",
        "r1/acceleration_2.csv;r1/force.csv;r1/acceleration_1.csv",
    )
    assert "nothing new" in ingested(sqlite_url, made.folder).stderr
    with (made.folder / "r1" / "acceleration_2.csv").open("a", encoding="utf-8") as file:
        file.write("0.5\n")
    result = ingest(sqlite_url, made.folder)
    assert (result.exit_code, f"{STORED}: the file has changed" in result.stderr) == (2, True)
    assert counts(sqlite_url) == before


def test_recording_that_names_a_file_less_lacks_its_channel(sqlite_url, tmp_path):
    made = split_campaign(tmp_path)
    replace_in(made.folder / "runs.csv", ";r1/acceleration_1.csv", "")
    report, _ = ingest_report(sqlite_url, made.folder)
    assert (report["recordings"], report["impacts"]) == (3, 6)
    (warning,) = [
        finding for finding in report["findings"] if finding["check"] == "missing-channel"
    ]
    assert (warning["recording"], warning["channel"]) == (
        "r1/acceleration_2.csv;r1/force.csv",
        "acceleration_1",
    )


def test_file_that_is_not_there_is_named(refused, tmp_path):
    made = split_campaign(tmp_path)
    (made.folder / "r1" / "acceleration_1.csv").unlink()
    refused(
        made.folder, "row 2, column 'recording'", "there is none called 'r1/acceleration_1.csv'"
    )


def test_damaged_file_or_channel_in_two_sets_the_recording_aside_until_it_is_mended(
    sqlite_url, tmp_path
):
    made = split_campaign(tmp_path)
    for name, bad, reason in (
        ("acceleration_1.csv", b"\0" * 50, "acceleration_1.csv"),
        (
            "acceleration_2.csv",
            (made.folder / "r1" / "force.csv").read_bytes(),
            "'force' is in acceleration_2.csv and in",
        ),
    ):
        path = made.folder / "r1" / name
        good = path.read_bytes()
        path.write_bytes(bad)
        (aside,) = ingest_report(sqlite_url, made.folder)[0]["set_aside"]
        assert aside["recording"] == STORED and reason in aside["reason"]
        path.write_bytes(good)
    report, _ = ingest_report(sqlite_url, made.folder)
    assert (report["recordings"], report["set_aside"]) == (3, [])


def test_damaged_series_is_repaired_from_several_files(sqlite_url, tmp_path):
    from pyroshock.ingest.storing.series_repair import repair_series
    from sqlalchemy import text

    made = split_campaign(tmp_path)
    ingest_report(sqlite_url, made.folder)
    with opened(sqlite_url) as store:
        with store.writing() as session:
            key = session.scalar(
                select(RecordedChannel.id)
                .join(Recording)
                .where(Recording.path == STORED, RecordedChannel.name == "force")
            )
            session.execute(
                text(f"UPDATE series_chunks SET frame = X'00' WHERE channel_id = {key}")
            )
        assert repair_series(store, made.folder).mended == [f"{STORED}: force"]
    assert_whole(sqlite_url, 2)


@pytest.mark.parametrize(
    ("text", "words"),
    [("a.csv;a.csv", "named twice"), ("a.csv;", "'' is none"), ("a.csv;../b.csv", "is none")],
)
def test_list_of_files_that_is_none(tmp_path, text, words):
    (tmp_path / "a.csv").touch()
    with pytest.raises(ValueError, match=words):
        recording_path(tmp_path, text)


@given(st.text(max_size=40))
def test_path_is_inside_or_refused(tmp_path_factory, text):
    folder = tmp_path_factory.getbasetemp() / "inside"
    folder.mkdir(exist_ok=True)
    (folder / "a.csv").touch()
    try:
        path = recording_path(folder, text)
    except ValueError:
        return
    assert all((folder / name).resolve().is_relative_to(folder) for name in path.split(";"))


def test_samples_of_joined_files_are_exact(tmp_path):
    made = split_campaign(tmp_path)
    with RecordingFiles(made.folder, STORED).open() as recording:
        assert np.array_equal(
            recording.read("force", 10, 20).astype(np.float32), made.written[1]["force"][10:20]
        )
