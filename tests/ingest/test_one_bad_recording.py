"""One recording that cannot be processed costs itself alone, and what a store knows of a file is
told."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.app.operations.ingest.campaign_overview import campaign_overview
from pyroshock.ingest.extraction import recording
from pyroshock.ingest.load import ingest_folder
from support.records.campaigns import (
    FS_HZ,
    blows,
    force_record,
    hammer_campaign,
    recording_name,
    write_recording,
)

HAMMER_CHANNEL = '[channels.head]\nquantity = "acceleration"\nunit = "m/s2"\nposition = "hammer"\n'


def with_head(folder, lost, value=np.nan):
    """The campaign's recordings with an acceleration of the hammer, of which recording 1 lacks the
    samples `lost`."""
    card = folder / "campaign.toml"
    card.write_text(card.read_text() + "\n" + HAMMER_CHANNEL)
    for number in (1, 3):
        force = force_record(blows(number, 2), np.random.default_rng(number))
        head = (force / 0.32).astype(np.float32)
        if number == 1:
            head[lost] = value
        write_recording(folder / recording_name(number), {"force": force, "head": head})
    return folder


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_sample_that_is_no_number_beside_a_contact_sets_that_recording_aside(
    store, tmp_path, value
):
    contact = round(0.0503 * FS_HZ)
    folder = with_head(
        hammer_campaign(tmp_path / "c", recordings=3), slice(contact, contact + 3), value
    )
    (folder / recording_name(2)).unlink()
    rows = (folder / "runs.csv").read_text().splitlines()
    (folder / "runs.csv").write_text("\n".join(row for row in rows if recording_name(2) not in row))
    report = ingest_folder(store, folder, jobs=1)
    assert (report.recordings, report.impacts) == (1, 2)
    (aside,) = report.set_aside
    assert aside["recording"] == recording_name(1)
    assert f"channel 'head' has no number at sample {contact}" in aside["reason"]


def test_any_failure_of_one_recording_sets_that_one_aside(store, tmp_path, monkeypatch):
    really = recording.extract_recording

    def fails(folder, path, *arguments, **options):
        if path == recording_name(2):
            raise ZeroDivisionError("float division by zero")
        return really(folder, path, *arguments, **options)

    monkeypatch.setattr(recording, "extract_recording", fails)
    report = ingest_folder(store, hammer_campaign(tmp_path / "c", recordings=3), jobs=1)
    assert (report.recordings, report.impacts) == (2, 4)
    (aside,) = report.set_aside
    assert aside["recording"] == recording_name(2)
    assert "could not be processed (ZeroDivisionError: float division by zero)" in aside["reason"]


def test_a_full_disk_is_no_fault_of_a_recording(store, tmp_path, monkeypatch):
    def fails(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(recording, "extract_recording", fails)
    with pytest.raises(OSError, match="No space left"):
        ingest_folder(store, hammer_campaign(tmp_path / "c", recordings=1), jobs=1)


def test_the_same_file_under_another_campaign_s_name_is_told(store, tmp_path):
    for name in ("spring", "summer"):
        report = ingest_folder(
            store, hammer_campaign(tmp_path / name, recordings=1, name=name), jobs=1
        )
    findings = [f for f in report.findings if f["check"] == "same-recording"]
    assert [f["severity"] for f in findings] == ["warning"]
    assert f"stored as {recording_name(1)} of campaign spring" in findings[0]["message"]


def test_missing_facts_are_told_after_storing(store, tmp_path):
    folder = hammer_campaign(tmp_path / "c", recordings=2, name="bare")
    table = folder / "runs.csv"
    rows = [line.split(",") for line in table.read_text().splitlines()]
    drop = rows[0].index("tip_radius_mm")
    table.write_text("\n".join(",".join(row[:drop] + row[drop + 1 :]) for row in rows) + "\n")
    ingest_folder(store, folder, jobs=1)
    with store.reading() as session:
        assert "4 impacts have no tip_radius" in campaign_overview(session, "bare")["missing_facts"]
