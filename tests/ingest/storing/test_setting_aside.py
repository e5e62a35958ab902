"""A damaged recording is set aside with its reason, never half stored; a lost channel costs that
channel alone."""

from __future__ import annotations

import json

import numpy as np
import pytest
from pyroshock.dataset.rows import rows_of_campaigns
from pyroshock.dataset.selection import verdicts
from pyroshock.ingest.folder.column_names import resembled_channel
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.impacts import Impact
from pyroshock.schema.recordings import RecordedChannel, Recording
from sqlalchemy import select
from support.records.campaigns import (
    FS_HZ,
    blows,
    force_record,
    hammer_campaign,
    hammer_rows,
    recording_name,
    write_recording,
    write_runs,
)
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


def cut(path, share=0.6):
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * share)])


@pytest.fixture
def reported(sqlite_url, tmp_path):
    """`reported(recordings, **arrays)`: what is told of a campaign whose first recording holds
    these arrays."""

    def report(recordings=2, **arrays):
        folder = hammer_campaign(tmp_path / "c", recordings=recordings)
        write_recording(folder / recording_name(1), arrays)
        return ingest_report(sqlite_url, folder)[0]

    return report


def two_blows():
    return force_record(blows(1, 2), np.random.default_rng(0))


@pytest.mark.parametrize("number", [1, 2], ids=["npz", "mat"])
def test_truncated_recording_is_set_aside_and_the_others_stored(sqlite_url, tmp_path, number):
    folder = hammer_campaign(tmp_path / "c", recordings=3)
    cut(folder / recording_name(number))
    report, notes = ingest_report(sqlite_url, folder)
    assert (report["recordings"], report["impacts"]) == (2, 4)
    (aside,) = report["set_aside"]
    assert aside["recording"] == recording_name(number)
    assert recording_name(number).split("/")[1] in aside["reason"]
    assert recording_name(number) in notes
    with opened(sqlite_url) as store, store.reading() as session:
        row = session.scalars(select(Recording).where(Recording.status == "set aside")).one()
        assert row.reason == aside["reason"]
        assert (
            session.scalars(
                select(RecordedChannel).where(RecordedChannel.recording_id == row.id)
            ).all()
            == []
        )
        assert set(session.scalars(select(Impact.run))) == {1, 2, 3} - {number}
    assert_whole(sqlite_url, 2)


def test_set_aside_again_adds_no_row_and_a_mended_recording_takes_its_place(sqlite_url, tmp_path):
    folder = hammer_campaign(tmp_path / "c", recordings=3)
    good = (folder / recording_name(2)).read_bytes()
    cut(folder / recording_name(2))
    first, _ = ingest_report(sqlite_url, folder)
    before = counts(sqlite_url)
    second, _ = ingest_report(sqlite_url, folder)
    assert counts(sqlite_url) == before
    assert second == first
    (folder / recording_name(2)).write_bytes(good)
    report, _ = ingest_report(sqlite_url, folder)
    assert (report["recordings"], report["set_aside"]) == (3, [])
    whole = f"sqlite:///{tmp_path / 'whole.db'}"
    ingested(whole, folder)
    assert content(sqlite_url) == content(whole)


def test_campaign_with_nothing_usable_is_refused(refused, tmp_path):
    folder = hammer_campaign(tmp_path / "c", recordings=2)
    cut(folder / recording_name(1))
    cut(folder / recording_name(2))
    refused(folder, "no usable recording", recording_name(1))


def with_sample(value):
    """A number that no sensor gives: figures of it overflowed, with warnings of NumPy in place of a
    reason."""
    record = two_blows().astype(np.float64)
    record[7] = value
    return record


@pytest.mark.parametrize(
    ("arrays", "reasons"),
    [
        ({"strain": two_blows()}, ("'force'", "strain")),
        (
            {"force": force_record(blows(1, 1), np.random.default_rng(0))},
            ("1 impacts found for 2 rows",),
        ),
        ({"force": with_sample(1e200)}, ("'force' holds 1e+200 at sample 7; no sensor",)),
        ({"force": with_sample(-1e101)}, ("'force' holds -1e+101 at sample 7; no sensor",)),
    ],
    ids=["missing channel", "fewer hits than rows", "1e200", "-1e101"],
)
def test_recording_that_cannot_be_used_is_set_aside_with_its_reason(reported, arrays, reasons):
    report = reported(**arrays)
    (aside,) = report["set_aside"]
    assert (aside["recording"], report["impacts"]) == (recording_name(1), 2)
    assert all(reason in aside["reason"] for reason in reasons)


def test_more_hits_than_rows_keep_the_main_peaks(reported):
    made = blows(1, 2)
    weak = type(made[0])(0.6, made[0].peak_n * 0.2, made[0].width_s)
    record = force_record([*made, weak], np.random.default_rng(0))
    padded = np.pad(record, (0, max(0, round(0.8 * FS_HZ) - record.size))).astype(np.float32)
    report = reported(1, force=padded)
    assert (report["impacts"], report["set_aside"]) == (2, [])


def test_one_row_stands_for_all_hits_of_its_recording(sqlite_url, tmp_path):
    folder = hammer_campaign(tmp_path / "c", recordings=1, hits=10)
    write_runs(folder, hammer_rows(1, 10)[:1])
    report, _ = ingest_report(sqlite_url, folder)
    assert report["impacts"] == 10
    with opened(sqlite_url) as store, store.reading() as session:
        assert session.scalars(select(Impact.repetition).order_by(Impact.id)).all() == list(
            range(1, 11)
        )


def test_file_whose_unit_contradicts_the_campaign_is_set_aside(sqlite_url, tmp_path):
    import h5py

    folder = hammer_campaign(tmp_path / "c", recordings=2)
    rows = hammer_rows(2)
    for row in rows[:2]:
        row["recording"] = "recordings/wrong.h5"
    write_runs(folder, rows)
    with h5py.File(folder / "recordings" / "wrong.h5", "w") as file:
        data = file.create_dataset(
            "force", data=force_record(blows(1, 2), np.random.default_rng(0))
        )
        data.attrs["unit"] = "kN"
        file.attrs["fs"] = FS_HZ
    report, _ = ingest_report(sqlite_url, folder)
    assert "'kN' by the file, in 'N' by campaign.toml" in report["set_aside"][0]["reason"]


def test_silent_recording_keeps_its_impacts_without_pulse(sqlite_url, reported):
    report = reported(force=np.random.default_rng(0).normal(size=20000).astype(np.float32))
    assert (report["impacts"], report["set_aside"]) == (4, [])
    assert "no-contact" in {f["check"] for f in report["findings"]}
    listed = json.loads(pyroshock("impacts", "--db", sqlite_url, "--json").stdout)
    assert [(i["run"], i["peak_force_n"] is None, i["quality"]) for i in listed][:2] == [
        (1, True, "reject")
    ] * 2


def test_ingest_error_leaves_an_existing_campaign_alone(stored_hammer):
    url, folder = stored_hammer
    before = counts(url)
    (folder / "runs.csv").write_text("run,repetition\n")
    assert ingest(url, folder).exit_code == 2
    assert counts(url) == before


def test_reason_that_cannot_be_printed_is_stored(database_url, tmp_path):
    """A channel's name of half a kilobyte of noise stood in the reason, and PostgreSQL takes no
    NUL."""
    from nptdms import ChannelObject, TdmsWriter

    folder = hammer_campaign(tmp_path / "c", recordings=2)
    name = "recordings/odd.tdms"
    with TdmsWriter(folder / name) as writer:
        writer.write_segment(
            [ChannelObject("scope", "for\x00\x1bce", np.zeros(99), {"wf_increment": 1e-4})]
        )
    rows = hammer_rows(2)
    write_runs(folder, [{**row, "recording": name} if row["run"] == 1 else row for row in rows])
    report, notes = ingest_report(database_url, folder)
    assert "no channel 'force'; the file has: for\ufffd\ufffdce" in report["set_aside"][0]["reason"]
    assert "\x1b" not in notes


def test_number_beyond_double_precision_in_a_header_is_stored(sqlite_url, reported):
    """NumPy's longdouble has no Python float in it: the ingest ended in a traceback."""
    reported(1, force=two_blows(), humidity=np.longdouble("0.25"))
    with opened(sqlite_url) as store, store.reading() as session:
        assert session.scalars(select(RecordedChannel)).one().header["humidity"] == 0.25


def test_name_in_a_header_that_is_no_text_is_stored(sqlite_url, tmp_path):
    """h5py gives such a name as bytes, which JSON has not."""
    import h5py

    folder = hammer_campaign(tmp_path / "c", recordings=1)
    rows = hammer_rows(1)
    for row in rows:
        row["recording"] = "recordings/odd.h5"
    write_runs(folder, rows)
    with h5py.File(folder / "recordings" / "odd.h5", "w") as file:
        data = file.create_dataset(
            "force", data=force_record(blows(1, 2), np.random.default_rng(0))
        )
        h5py.h5a.create(
            data.id, b"\xff", h5py.h5t.NATIVE_INT32, h5py.h5s.create(h5py.h5s.SCALAR)
        ).write(np.array(3, np.int32))
        file.attrs["fs"] = FS_HZ
    report, _ = ingest_report(sqlite_url, folder)
    assert report["set_aside"] == []
    with opened(sqlite_url) as store, store.reading() as session:
        assert session.scalars(select(RecordedChannel)).one().header["\ufffd"] == 3


def campaign(tmp_path, **channels):
    """Three recordings of force and two accelerations; the second holds `channels` in their
    place."""
    made = plate_campaign(tmp_path / "plate")
    path = made.folder / "2.npz"
    record = force_record(blows(2, 2), np.random.default_rng(2))
    write_recording(path, {name: record * factor for name, factor in channels.items()})
    return made.folder, path.relative_to(made.folder).as_posix()


def warnings_of(report):
    return [finding for finding in report["findings"] if finding["check"] == "missing-channel"]


def test_absent_accelerometer_costs_that_channel(sqlite_url, tmp_path):
    folder, path = campaign(tmp_path, force=1.0, acceleration_2=0.5)
    report, notes = ingest_report(sqlite_url, folder)
    assert (report["recordings"], report["impacts"], report["set_aside"]) == (3, 6, [])
    (warning,) = warnings_of(report)
    assert (warning["recording"], warning["channel"], warning["severity"]) == (
        path,
        "acceleration_1",
        "warning",
    )
    assert "'acceleration_1'; the recording has: force, acceleration_2" in warning["message"]
    assert "missing-channel (1) of acceleration_1" in notes
    with opened(sqlite_url) as store, store.reading() as session:
        query = select(RecordedChannel.name).join(Recording).where(Recording.path == path)
        assert set(session.scalars(query)) == {"force", "acceleration_2"}
    assert_whole(sqlite_url, 2)
    assert pyroshock("db", "check", "--db", sqlite_url).exit_code == 0


def test_impacts_stay_usable_where_no_number_of_theirs_is_missing(sqlite_url, tmp_path):
    folder, path = campaign(tmp_path, force=1.0, acceleration_1=0.5)
    first, _ = ingest_report(sqlite_url, folder)
    before = counts(sqlite_url)
    assert ingest_report(sqlite_url, folder)[0] == first
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
        (
            {"acceleration_1": 1.0, "acceleration_2": 1.0},
            ("no channel 'force'", "the file has: acceleration_1"),
        ),
        ({"strain": 1.0}, ("no channel 'force'", "the file has: strain")),
        (
            {"force": 1.0, "Acceleration 1": 1.0, "acceleration_2": 1.0},
            ("'acceleration_1', but 'Acceleration 1'",),
        ),
        (
            {"force": 1.0, "aceleration_2": 1.0, "acceleration_1": 1.0},
            ("'acceleration_2', but 'aceleration_2'",),
        ),
    ],
)
def test_recording_without_force_or_with_another_spelling_is_set_aside(
    sqlite_url, tmp_path, channels, words
):
    folder, path = campaign(tmp_path, **channels)
    report, _ = ingest_report(sqlite_url, folder)
    (aside,) = report["set_aside"]
    assert aside["recording"] == path
    for word in words:
        assert word in aside["reason"]
    assert (report["recordings"], report["impacts"]) == (2, 4)


def test_channel_that_is_there_and_no_signal_is_not_missing(sqlite_url, tmp_path):
    """A column of words under the declared name is a damaged channel: the recording is set aside as
    before."""
    folder, path = campaign(tmp_path, force=1.0, acceleration_1=1.0)
    record = force_record(blows(2, 2), np.random.default_rng(2))
    words = np.full(record.size, "n/a")
    write_recording(
        folder / path, {"force": record, "acceleration_1": record, "acceleration_2": words}
    )
    report, _ = ingest_report(sqlite_url, folder)
    assert [rejected["recording"] for rejected in report["set_aside"]] == [path]
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
