"""Pulses cut anew: previewed without a trace, stored as previewed, and back to an earlier version
without a new row."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.ingest.extraction.settings import ExtractionSettings
from pyroshock.ingest.load import ingest_folder
from pyroshock.ingest.storing.reextraction import preview_impacts, reextract, reextract_recording
from pyroshock.parallel.executor import ExecutorConfig
from pyroshock.schema.impacts import Pulse
from pyroshock.schema.recordings import RecordedChannel, Recording, SeriesChunk
from pyroshock.schema.series import as_floats
from pyroshock.schema.session import Writer, count_rows, open_store
from sqlalchemy import delete, func, select
from support.records.campaigns import hammer_campaign
from support.stores.stores import content

OTHER = ExtractionSettings(segmentation="mask", threshold=0.05, smoothing=0.9)
#: So high a share of the largest that the smaller hit of two is none.
BLIND = ExtractionSettings(event_share=0.999)
FIGURES = (
    *(
        "start_s",
        "contact_time_s",
        "compression_time_s",
        "peak_force_n",
        "spline_peak_force_n",
        "impulse_n_s",
    ),
    *(
        "compression_impulse_n_s",
        "width_half_s",
        "width_tenth_s",
        "samples_in_contact",
        "spline_nrmse",
    ),
    *("segmentation_difference", "fine_period_s"),
)


@pytest.fixture
def store(sqlite_url, tmp_path):
    with open_store(sqlite_url, Writer("test", "0"), create=True) as store:
        ingest_folder(store, hammer_campaign(tmp_path / "c"), jobs=1)
        yield store


def recordings(store):
    with store.reading() as session:
        return session.scalars(select(Recording.id).order_by(Recording.id)).all()


def in_use(store):
    """Settings of the pulses in use, by impact."""
    with store.reading() as session:
        rows = session.scalars(select(Pulse).where(Pulse.current).order_by(Pulse.impact_id))
        return {row.impact_id: (row.id, row.settings.settings["threshold"]) for row in rows}


def test_preview_changes_no_row_and_stored_settings_preview_the_stored_pulse(store):
    """An untouched setting shows what is there: the preview is the extraction itself, not a
    likeness."""
    before, used = count_rows(store), in_use(store)
    preview = preview_impacts(store, recordings(store)[0], OTHER)
    assert (len(preview.pulses), preview.mismatch) == (2, None)
    assert (count_rows(store), in_use(store)) == (before, used)
    preview = preview_impacts(store, recordings(store)[0], ExtractionSettings())
    with store.reading() as session:
        row = session.scalars(select(Pulse).where(Pulse.impact_id == preview.impacts[0])).one()
        np.testing.assert_array_equal(
            as_floats(row.fine_force_n, "pulse"), preview.pulses[0].fine_force_n
        )


def test_what_is_stored_is_what_was_previewed(store):
    recording = recordings(store)[0]
    found = preview_impacts(store, recording, OTHER)
    report = reextract_recording(store, recording, OTHER)
    assert (report.campaign, report.added, report.reused, report.skipped) == ("hammer", 2, 0, [])
    with store.reading() as session:
        for impact, pulse in zip(found.impacts, found.pulses, strict=True):
            row = session.scalars(
                select(Pulse).where(Pulse.impact_id == impact, Pulse.current)
            ).one()
            assert {name: getattr(row, name) for name in FIGURES} == {
                name: getattr(pulse, name) for name in FIGURES
            }
            np.testing.assert_array_equal(as_floats(row.fine_force_n, "pulse"), pulse.fine_force_n)
            np.testing.assert_array_equal(row.force_points_n, pulse.force_points_n)
            assert found.pulse_of(impact) is pulse


def test_same_settings_again_put_the_old_version_back_in_use(store):
    recording, before = recordings(store)[0], in_use(store)
    reextract_recording(store, recording, OTHER)
    rows = count_rows(store)
    assert {threshold for _, threshold in in_use(store).values()} == {
        0.005,
        0.05,
    }  # another recording's are left alone
    report = reextract_recording(store, recording, ExtractionSettings())
    assert (report.added, report.reused) == (0, 2)
    assert (in_use(store), count_rows(store)) == (before, rows)


def test_campaign_and_its_recordings_give_the_same(store, tmp_path):
    other = f"sqlite:///{tmp_path / 'other.db'}"
    with open_store(other, Writer("test", "0"), create=True) as twin:
        ingest_folder(twin, hammer_campaign(tmp_path / "again"), jobs=1)
        report = reextract(twin, "hammer", OTHER)
        for recording in recordings(store):
            reextract_recording(store, recording, OTHER)
        assert report.added == 4
        assert in_use(twin) == in_use(store)


def test_recording_with_another_number_of_hits_is_left_as_it_was(store):
    recording, before = recordings(store)[0], count_rows(store)
    found = preview_impacts(store, recording, BLIND)
    assert found.mismatch == "1 impacts found with these settings, 2 stored"
    assert found.pulse_of(found.impacts[0]) is None
    report = reextract_recording(store, recording, BLIND)
    assert report.skipped == [{"recording": "recordings/test-01.npz", "reason": found.mismatch}]
    assert count_rows(store) == before


def test_one_pulse_is_in_use_per_impact(store):
    for settings in (OTHER, ExtractionSettings(), OTHER, ExtractionSettings(threshold=0.1)):
        reextract(store, "hammer", settings)
    with store.reading() as session:
        used = session.execute(
            select(Pulse.impact_id, func.count()).where(Pulse.current).group_by(Pulse.impact_id)
        )
        assert set(dict(used.all()).values()) == {1}
        assert session.scalar(select(func.count()).select_from(Pulse)) == 4 * 3


def test_recording_that_is_unknown_set_aside_or_without_an_impact_is_named(store):
    for call in (preview_impacts, reextract_recording):
        with pytest.raises(LookupError, match="no recording 99"):
            call(store, 99, OTHER)
    own = {"campaign_id": 1, "sha256": "0" * 64, "size_bytes": 1, "format": "mat"}
    for path, more, message in (
        ("bad.mat", {"status": "set aside", "reason": "truncated"}, "was set aside.*truncated"),
        ("idle.mat", {"status": "stored"}, "has no impact"),
    ):
        with store.writing() as session:
            session.add(Recording(path=path, **own, **more))
        with pytest.raises(LookupError, match=rf"'{path}' of campaign 'hammer' {message}"):
            preview_impacts(store, recordings(store)[-1], OTHER)


def test_two_processes_cut_what_one_cuts(store, tmp_path):
    other = f"sqlite:///{tmp_path / 'other.db'}"
    with open_store(other, Writer("test", "0"), create=True) as second:
        ingest_folder(second, tmp_path / "c", jobs=1)
        beside = reextract(second, "hammer", OTHER, executor=ExecutorConfig(jobs=2))
    alone = reextract(store, "hammer", OTHER)
    assert alone.added > 0
    assert beside.as_json() == alone.as_json()
    assert content(other) == content(str(store.engine.url))


def test_recording_with_damaged_samples_is_named_and_the_rest_cut(store):
    first = recordings(store)[0]
    with store.writing() as session:
        channel = session.scalars(
            select(RecordedChannel).filter_by(recording_id=first, quantity="force")
        ).one()
        session.execute(delete(SeriesChunk).where(SeriesChunk.channel_id == channel.id))
    report = reextract(store, "hammer", OTHER)
    assert [item["recording"] for item in report.skipped] == ["recordings/test-01.npz"]
    assert "chunk 0" in report.skipped[0]["reason"]
    assert report.added == 2 * (len(recordings(store)) - 1)
