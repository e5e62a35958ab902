"""What a page shows of a segmentation: the record, the contact, the threshold, every version of the pulse."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.app.impacts.curves import pulse_view
from pyroshock.ingest.load import ingest_folder
from pyroshock.ingest.reextraction import preview_impacts, reextract_recording
from pyroshock.ingest.settings import ExtractionSettings
from pyroshock.schema.impacts import ExtractionSettingsRow as SettingsRow
from pyroshock.schema.impacts import Impact, Pulse
from pyroshock.schema.series import as_floats
from pyroshock.schema.session import Writer, open_store
from sqlalchemy import select
from support.records.campaigns import FS_HZ, blows, hammer_campaign, write_recording

OTHER = ExtractionSettings(threshold=0.2)
REST_N = -40.0


@pytest.fixture
def store(sqlite_url, tmp_path):
    """Two hits; the record rests at -40 N and shows compression as negative."""
    folder = hammer_campaign(tmp_path / "c", recordings=1)
    made = blows(1, 2)
    time_s = np.arange(round(0.3 * FS_HZ)) / FS_HZ
    force = REST_N + 0.1 * np.random.default_rng(0).standard_normal(time_s.size)
    for blow in made:
        phase = (time_s - blow.start_s) / blow.width_s
        inside = (phase > 0) & (phase < 1)
        force[inside] -= blow.peak_n * np.sin(np.pi * phase[inside]) ** 1.5
    write_recording(folder / "recordings/test-01.npz", {"force": force})
    with open_store(sqlite_url, Writer("test", "0"), create=True) as store:
        ingest_folder(store, folder, jobs=1)
        yield store


def view(store, impact=1, preview=None):
    with store.reading() as session:
        return pulse_view(session, impact, preview)


def test_record_is_upright_and_curves_of_the_stored_pulse_lie_on_it(store):
    found, (blow, _) = view(store), blows(1, 2)
    (version,) = found.versions
    assert (found.sign, found.channels, found.recording) == (-1, ("force",), "recordings/test-01.npz")
    assert found.force_n.max() == pytest.approx(blow.peak_n - REST_N, rel=0.01)
    assert found.time_s[0] < version.start_s < version.stop_s < found.time_s[-1]
    assert version.start_s == pytest.approx(blow.start_s, abs=0.05e-3)
    assert version.stop_s == pytest.approx(blow.start_s + blow.width_s, abs=0.05e-3)
    # half a contact on either side, and no other hit in sight
    assert found.time_s[-1] - found.time_s[0] == pytest.approx(2 * (version.stop_s - version.start_s), rel=0.1)
    found = view(store)
    (version,) = found.versions
    inside = (found.time_s >= version.start_s) & (found.time_s <= version.stop_s)
    spline = np.interp(found.time_s[inside], version.time_s, version.force_n)
    np.testing.assert_allclose(spline, found.force_n[inside], atol=5.0)
    assert version.rest_n == pytest.approx(-REST_N, abs=0.1)
    with store.reading() as session:
        row = session.get_one(Pulse, version.key)
        np.testing.assert_allclose(version.force_n - version.rest_n, as_floats(row.fine_force_n, "pulse"), atol=1e-9)
        np.testing.assert_allclose(version.points_n - version.rest_n, row.force_points_n, atol=1e-9)
        assert version.figures["impulse_n_s"] == row.impulse_n_s
        assert (version.in_use, version.settings["threshold"]) == (True, 0.005)
    with store.writing() as session:
        row = session.scalars(select(SettingsRow)).one()
        row.settings = {**row.settings, "cleverness": 11}
    assert view(store).versions[0].threshold_n is None


def test_contact_ends_where_the_record_passes_the_threshold(store):
    reextract_recording(store, 1, OTHER)
    found = view(store)
    for version in found.versions:
        assert version.threshold_n is not None
        at = np.round((found.time_s - version.start_s) * FS_HZ).astype(int)
        last = round((version.stop_s - version.start_s) * FS_HZ)
        force = dict(zip(at.tolist(), found.force_n, strict=True))
        assert force[0] <= version.threshold_n < force[1]
        assert force[last] <= version.threshold_n < force[last - 1]
    loose, tight = found.versions
    share = (tight.threshold_n - tight.rest_n) / tight.figures["peak_force_n"]
    assert share == pytest.approx(0.2, rel=1e-6)
    assert (loose.in_use, tight.in_use) == (False, True)
    assert loose.start_s < tight.start_s < tight.stop_s < loose.stop_s


def test_preview_is_drawn_as_it_would_be_stored_and_an_impact_without_record_is_named(store):
    cut = preview_impacts(store, 1, OTHER)
    shown = view(store, 1, (cut.pulse_of(1), OTHER))
    assert len(shown.versions) == 1
    reextract_recording(store, 1, OTHER)
    stored = view(store).versions[1]
    preview = shown.preview
    assert (preview.key, preview.in_use) == (None, False)
    assert (preview.settings, preview.figures) == (stored.settings, stored.figures)
    assert (preview.rest_n, preview.threshold_n) == (stored.rest_n, stored.threshold_n)
    for name in ("time_s", "force_n", "points_time_s", "points_n"):
        np.testing.assert_array_equal(getattr(preview, name), getattr(stored, name))
    with store.writing() as session:
        other = session.get_one(Impact, 1)
        session.add(Impact(campaign_id=1, run=9, repetition=1, configuration_id=other.configuration_id))
    with pytest.raises(LookupError, match="impact 3 has no pulse"):
        view(store, 3)
    with pytest.raises(LookupError, match="no impact 99"):
        view(store, 99)
