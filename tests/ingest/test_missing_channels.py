"""A recording without one of its declared channels costs that channel, and not the recording."""

from __future__ import annotations

import json

import numpy as np
import pytest
from pyroshock.dataset.rows import rows_of_campaigns
from pyroshock.dataset.selection import verdicts
from pyroshock.ingest.column_names import resembled_channel
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.recordings import RecordedChannel, Recording
from sqlalchemy import select
from support.records.campaigns import blows, force_record, write_recording
from support.records.plate_folders import plate_campaign
from support.stores.stores import assert_whole, counts, opened, pyroshock


def campaign(tmp_path, **channels):
    """Three recordings of force and two accelerations; the second holds `channels` in their place."""
    made = plate_campaign(tmp_path / "plate")
    path = made.folder / "2.npz"
    record = force_record(blows(2, 2), np.random.default_rng(2))
    write_recording(path, {name: record * factor for name, factor in channels.items()})
    return made.folder, path.relative_to(made.folder).as_posix()


def report_of(url, folder):
    result = pyroshock("ingest", folder, "--db", url, "--jobs", "1", "--json")
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout), result.stderr


def warnings_of(report):
    return [finding for finding in report["findings"] if finding["check"] == "missing-channel"]


def test_absent_accelerometer_costs_that_channel(sqlite_url, tmp_path):
    folder, path = campaign(tmp_path, force=1.0, acceleration_2=0.5)
    report, notes = report_of(sqlite_url, folder)
    assert (report["recordings"], report["impacts"], report["set_aside"]) == (3, 6, [])
    (warning,) = warnings_of(report)
    assert (warning["recording"], warning["channel"], warning["severity"]) == (path, "acceleration_1", "warning")
    assert "'acceleration_1'; the recording has: force, acceleration_2" in warning["message"]
    assert "missing-channel (1) of acceleration_1" in notes
    with opened(sqlite_url) as store, store.reading() as session:
        query = select(RecordedChannel.name).join(Recording).where(Recording.path == path)
        assert set(session.scalars(query)) == {"force", "acceleration_2"}
    assert_whole(sqlite_url, 2)
    assert pyroshock("db", "check", "--db", sqlite_url).exit_code == 0


def test_impacts_stay_usable_where_no_number_of_theirs_is_missing(sqlite_url, tmp_path):
    folder, path = campaign(tmp_path, force=1.0, acceleration_1=0.5)
    first, _ = report_of(sqlite_url, folder)
    before = counts(sqlite_url)
    assert report_of(sqlite_url, folder)[0] == first
    assert counts(sqlite_url) == before
    with opened(sqlite_url) as store, store.reading() as session:
        keys = session.scalars(select(Campaign.id)).all()
        rows = rows_of_campaigns(session, keys, None)
        lacking = session.scalars(select(Recording.id).where(Recording.path == path)).one()
        bad = verdicts(session, keys, rows, "warning")
        assert not any("missing-channel" in text for text in bad.values())
        assert [row["run"] for row in rows if row["recording_id"] == lacking] == [2, 2]


@pytest.mark.parametrize(
    ("channels", "words"),
    [
        ({"acceleration_1": 1.0, "acceleration_2": 1.0}, ("no channel 'force'", "the file has: acceleration_1")),
        ({"strain": 1.0}, ("no channel 'force'", "the file has: strain")),
        ({"force": 1.0, "Acceleration 1": 1.0, "acceleration_2": 1.0}, ("'acceleration_1', but 'Acceleration 1'",)),
        ({"force": 1.0, "aceleration_2": 1.0, "acceleration_1": 1.0}, ("'acceleration_2', but 'aceleration_2'",)),
    ],
)
def test_recording_without_force_or_with_another_spelling_is_set_aside(sqlite_url, tmp_path, channels, words):
    folder, path = campaign(tmp_path, **channels)
    report, _ = report_of(sqlite_url, folder)
    (aside,) = report["set_aside"]
    assert aside["recording"] == path
    for word in words:
        assert word in aside["reason"]
    assert (report["recordings"], report["impacts"]) == (2, 4)


def test_channel_that_is_there_and_no_signal_is_not_missing(sqlite_url, tmp_path):
    """A column of words under the declared name is a damaged channel: the recording is set aside as before."""
    folder, path = campaign(tmp_path, force=1.0, acceleration_1=1.0)
    record = force_record(blows(2, 2), np.random.default_rng(2))
    words = np.full(record.size, "n/a")
    write_recording(folder / path, {"force": record, "acceleration_1": record, "acceleration_2": words})
    report, _ = report_of(sqlite_url, folder)
    assert [each["recording"] for each in report["set_aside"]] == [path]
    assert "'acceleration_2'" in report["set_aside"][0]["reason"]


def test_names_that_resemble_each_other():
    alike = [
        ("force", "Force"),
        ("force", "forse"),
        ("acc_1", "ACC 1"),
        ("acc_x", "acc_y"),
        ("pressure", "pressure_bar"),
    ]
    other = [("acc_1", "acc_01"), ("acc_2", "acc_3"), ("ax", "ay"), ("acceleration_1", "strain_1")]
    for channel, name in alike:
        assert resembled_channel(channel, ["trigger", name]) == name
    for channel, name in other:
        assert resembled_channel(channel, ["trigger", name]) is None
