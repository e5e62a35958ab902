"""What a screen shows of a stored channel and of a segmentation: every peak, the contact, every
version of a pulse."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pyroshock.app.operations.impacts.curves import pulse_view
from pyroshock.app.operations.impacts.impact import list_signals
from pyroshock.app.operations.impacts.signals import (
    FEWEST_POINTS,
    bucket_length,
    channel_window,
    envelope,
)
from pyroshock.ingest.extraction.settings import ExtractionSettings
from pyroshock.ingest.load import ingest_folder
from pyroshock.ingest.storing import stored_channels as stored
from pyroshock.ingest.storing.reextraction import preview_impacts, reextract_recording
from pyroshock.schema.impacts import ExtractionSettingsRow as SettingsRow
from pyroshock.schema.impacts import Impact, Pulse
from pyroshock.schema.series import as_floats, read_slice
from pyroshock.schema.session import Writer, open_store
from pyroshock.signals.channel import Sensor
from sqlalchemy import select
from support.records.campaigns import FS_HZ, blows, hammer_campaign, write_recording
from support.stores.recorded import add_recording

# --- windows of a stored channel: exact where they are short, with every peak where they are long
# -------------------
RATE, START_S, SAMPLES = 100_000.0, -0.25, 300_000
G = 9.80665


@pytest.fixture(scope="module")
def recorded():
    noise = np.random.default_rng(1).normal(size=SAMPLES).astype(np.float32)
    noise[123_456], noise[123_457] = 500.0, -700.0
    return noise


@pytest.fixture(scope="module")
def store(tmp_path_factory, recorded):
    url = f"sqlite:///{tmp_path_factory.mktemp('signals') / 'lab.db'}"
    with open_store(url, Writer("test", "0"), create=True) as store:
        sensors = {
            Sensor("force", "force", "kN"): recorded,
            Sensor(
                "shock",
                "acceleration",
                "g",
                sensitivity=-0.01,
                offset_v=0.5,
                position="plate",
                axis="z",
            ): recorded,
        }
        store.keys = dict(  # type: ignore[attr-defined]  # for the tests
            zip(
                ("recording", "channels"), add_recording(store, sensors, RATE, START_S), strict=True
            )
        )
        yield store


def window(store, channel="force", *arguments, **named):
    with store.reading() as session:
        return channel_window(session, store.keys["channels"][channel], *arguments, **named)


def test_full_view_keeps_the_peaks_and_a_short_window_every_sample(store, recorded):
    impact_view = window(store, points=500)
    assert (
        impact_view.decimated
        and impact_view.time_s.size <= 500
        and impact_view.values.max() == 1e3 * float(recorded.max())
    )
    assert impact_view.values.min() == 1e3 * float(recorded.min())
    assert impact_view.time_s[impact_view.values.argmax()] == pytest.approx(
        START_S + 123_456 / RATE
    )
    assert (impact_view.time_s[0], impact_view.samples_in_record) == (START_S, SAMPLES)
    assert impact_view.time_s[-1] == pytest.approx(START_S + (SAMPLES - 1) / RATE)
    first, last = 123_400, 123_499
    impact_view = window(store, "force", START_S + first / RATE, START_S + last / RATE, 100)
    assert not impact_view.decimated
    assert window(
        store, "force", START_S + 1 / RATE, START_S + 101 / RATE, 100
    ).decimated  # one sample more
    assert (impact_view.first, impact_view.stop) == (first, last + 1)
    np.testing.assert_array_equal(
        impact_view.values, 1e3 * recorded[first : last + 1].astype(np.float64)
    )
    np.testing.assert_allclose(
        impact_view.time_s, START_S + np.arange(first, last + 1) / RATE, rtol=0, atol=1e-12
    )


def test_laboratory_unit_undoes_the_conversion_and_channels_have_keys(store, recorded):
    si = window(store, "shock", START_S, START_S + 50 / RATE)
    lab = window(store, "shock", START_S, START_S + 50 / RATE, laboratory_unit=True)
    assert (si.unit, lab.unit, lab.quantity) == ("m/s2", "g", "acceleration")
    np.testing.assert_allclose(
        lab.values, (recorded[:51].astype(np.float64) - 0.5) / -0.01, rtol=1e-12
    )
    np.testing.assert_allclose(si.values, lab.values * G, rtol=1e-9)
    lab = window(store, "force", START_S, START_S + 50 / RATE, laboratory_unit=True)
    np.testing.assert_array_equal(lab.values, recorded[:51])
    with store.reading() as session:
        force, shock = list_signals(session, store.keys["recording"])
    assert (force["key"], force["channel"], force["unit"], force["si_unit"]) == (
        store.keys["channels"]["force"], "force", "kN", "N",
    )  # fmt: skip
    assert (shock["position"], shock["axis"], shock["samples"], shock["start_s"]) == (
        "plate",
        "z",
        SAMPLES,
        START_S,
    )
    assert shock["stop_s"] == pytest.approx(START_S + (SAMPLES - 1) / RATE)


@pytest.mark.parametrize(
    ("start_s", "stop_s", "samples"),
    [
        (-9.0, -8.0, 0),
        (50.0, 60.0, 0),
        (-9.0, START_S, 1),
        (None, START_S + 9 / RATE, 10),
        (2.0, None, 75_000),
    ],
)
def test_window_is_cut_to_the_record(store, start_s, stop_s, samples):
    impact_view = window(store, "force", start_s, stop_s, 100_000)
    assert (impact_view.stop - impact_view.first, impact_view.values.size) == (samples, samples)


def test_zoom_reads_the_chunks_of_its_window_only(store, monkeypatch):
    windows, read = [], read_slice

    def watched(connection, channel, layout, start, stop):
        windows.append((start, stop))
        return read(connection, channel, layout, start, stop)

    monkeypatch.setattr(stored, "read_slice", watched)
    window(store, "force", 0.0, 0.001, 500)
    assert windows == [(25_000, 25_101)]


def test_unknown_channel_window_that_is_none_and_too_few_points_are_refused(store):
    with store.reading() as session, pytest.raises(LookupError, match="no channel 999"):
        channel_window(session, 999)
    for ends in ((1.0, 0.0), (float("nan"), 1.0), (0.0, float("inf"))):
        with pytest.raises(ValueError, match="expected two numbers in rising order"):
            window(store, "force", *ends)
    with pytest.raises(ValueError, match="points is 2; expected 4 or more"):
        window(store, points=2)


# --- what a screen shows of a series: every peak, in order, in at most so many points
# -------------------------------
NUMBERS = st.one_of(
    arrays(np.float64, st.integers(1, 400), elements=st.floats(-1e6, 1e6)),
    arrays(np.int16, st.integers(1, 400)),
    arrays(np.float32, st.integers(1, 400), elements=st.sampled_from([0.0, 1.0, -1.0, 2.5])),
)
POINTS = st.integers(FEWEST_POINTS, 80)


@given(NUMBERS, POINTS)
@settings(max_examples=200)
def test_every_bucket_keeps_its_extremes_and_few_points_hold_both_ends(values, points):
    kept, length = envelope(values, points), bucket_length(values.size, points)
    assert (
        0 < kept.size <= points
        and (np.diff(kept) > 0).all()
        and (kept[0], kept[-1]) == (0, values.size - 1)
    )
    for start in range(0, values.size, length):
        in_window = kept[(kept >= start) & (kept < start + length)]
        bucket = values[start : start + length]
        assert values[in_window].min() == bucket.min() and values[in_window].max() == bucket.max()


@given(NUMBERS, st.integers(0, 200))
@settings(max_examples=50)
def test_what_fits_is_left_as_it_is(values, room):
    points = max(FEWEST_POINTS, values.size + room)
    np.testing.assert_array_equal(envelope(values, points), np.arange(values.size))


@given(st.integers(5, 5000), POINTS)
@settings(max_examples=100)
def test_a_single_spike_is_never_lost(samples, points):
    values, spike = np.zeros(samples), samples // 3
    values[spike] = 1.0
    assert spike in envelope(values, points)


def test_extremes_stand_in_order_of_time_around_gaps_and_too_few_points_are_refused():
    falling_first = np.array([0.0, -5, 1, 9, 0, 0, 8, 0, -7, 0, 0, 0])
    np.testing.assert_array_equal(envelope(falling_first, 6), [0, 1, 3, 6, 8, 11])
    values = np.zeros(1000)
    values[100:300], values[400], values[401] = np.nan, 3.0, -2.0
    kept = envelope(values, 50)
    assert (
        {400, 401} <= set(kept.tolist())
        and np.isnan(values[kept]).any()
        and envelope(np.zeros(0), 10).size == 0
    )
    for points in (-1, 0, 3):
        with pytest.raises(ValueError, match=f"points is {points}; expected 4 or more"):
            envelope(np.zeros(3), points)


# --- segmentations: the record, the contact, the threshold, every version of the pulse ---
OTHER = ExtractionSettings(threshold=0.2)
REST_N = -40.0


@pytest.fixture
def pulse_store(sqlite_url, tmp_path):
    """Two hits; the record rests at -40 N and shows compression as negative."""
    folder, made = hammer_campaign(tmp_path / "c", recordings=1), blows(1, 2)
    time_s = np.arange(round(0.3 * FS_HZ)) / FS_HZ
    force = REST_N + 0.1 * np.random.default_rng(0).standard_normal(time_s.size)
    for blow in made:
        phase = (time_s - blow.start_s) / blow.width_s
        inside = (phase > 0) & (phase < 1)
        force[inside] -= blow.peak_n * np.sin(np.pi * phase[inside]) ** 1.5
    write_recording(folder / "recordings/test-01.npz", {"force": force})
    with open_store(sqlite_url, Writer("test", "0"), create=True) as pulse_store:
        ingest_folder(pulse_store, folder, jobs=1)
        yield pulse_store


def view(pulse_store, impact=1, preview=None):
    with pulse_store.reading() as session:
        return pulse_view(session, impact, preview)


def test_record_is_upright_and_curves_of_the_stored_pulse_lie_on_it(pulse_store):
    impact_view, (blow, _) = view(pulse_store), blows(1, 2)
    (version,) = impact_view.versions
    assert (impact_view.sign, impact_view.channels, impact_view.recording) == (
        -1,
        ("force",),
        "recordings/test-01.npz",
    )
    assert impact_view.force_n.max() == pytest.approx(blow.peak_n - REST_N, rel=0.01)
    assert impact_view.time_s[0] < version.start_s < version.stop_s < impact_view.time_s[-1]
    assert version.start_s == pytest.approx(blow.start_s, abs=0.05e-3)
    assert version.stop_s == pytest.approx(blow.start_s + blow.width_s, abs=0.05e-3)
    # half a contact on either side, and no other hit in sight
    assert impact_view.time_s[-1] - impact_view.time_s[0] == pytest.approx(
        2 * (version.stop_s - version.start_s), rel=0.1
    )
    impact_view = view(pulse_store)
    (version,) = impact_view.versions
    inside = (impact_view.time_s >= version.start_s) & (impact_view.time_s <= version.stop_s)
    spline = np.interp(impact_view.time_s[inside], version.time_s, version.force_n)
    np.testing.assert_allclose(spline, impact_view.force_n[inside], atol=5.0)
    assert version.rest_n == pytest.approx(-REST_N, abs=0.1)
    with pulse_store.reading() as session:
        row = session.get_one(Pulse, version.key)
        np.testing.assert_allclose(
            version.force_n - version.rest_n, as_floats(row.fine_force_n, "pulse"), atol=1e-9
        )
        np.testing.assert_allclose(version.points_n - version.rest_n, row.force_points_n, atol=1e-9)
        assert version.figures["impulse_n_s"] == row.impulse_n_s
        assert (version.in_use, version.settings["threshold"]) == (True, 0.005)
    with pulse_store.writing() as session:
        row = session.scalars(select(SettingsRow)).one()
        row.settings = {**row.settings, "cleverness": 11}
    assert view(pulse_store).versions[0].threshold_n is None


def test_contact_ends_where_the_record_passes_the_threshold(pulse_store):
    reextract_recording(pulse_store, 1, OTHER)
    impact_view = view(pulse_store)
    for version in impact_view.versions:
        assert version.threshold_n is not None
        at = np.round((impact_view.time_s - version.start_s) * FS_HZ).astype(int)
        last = round((version.stop_s - version.start_s) * FS_HZ)
        force = dict(zip(at.tolist(), impact_view.force_n, strict=True))
        assert (
            force[0] <= version.threshold_n < force[1]
            and force[last] <= version.threshold_n < force[last - 1]
        )
    loose, tight = impact_view.versions
    share = (tight.threshold_n - tight.rest_n) / tight.figures["peak_force_n"]
    assert share == pytest.approx(0.2, rel=1e-6) and (loose.in_use, tight.in_use) == (False, True)
    assert loose.start_s < tight.start_s < tight.stop_s < loose.stop_s


def test_preview_is_drawn_as_it_would_be_stored_and_an_impact_without_record_is_named(pulse_store):
    shown = view(pulse_store, 1, (preview_impacts(pulse_store, 1, OTHER).pulse_of(1), OTHER))
    assert len(shown.versions) == 1
    reextract_recording(pulse_store, 1, OTHER)
    stored, preview = view(pulse_store).versions[1], shown.preview
    assert (preview.key, preview.in_use) == (None, False)
    assert (preview.settings, preview.figures) == (stored.settings, stored.figures)
    assert (preview.rest_n, preview.threshold_n) == (stored.rest_n, stored.threshold_n)
    for name in ("time_s", "force_n", "points_time_s", "points_n"):
        np.testing.assert_array_equal(getattr(preview, name), getattr(stored, name))
    with pulse_store.writing() as session:
        other = session.get_one(Impact, 1)
        session.add(
            Impact(campaign_id=1, run=9, repetition=1, configuration_id=other.configuration_id)
        )
    with pytest.raises(LookupError, match="impact 3 has no pulse"):
        view(pulse_store, 3)
    with pytest.raises(LookupError, match="no impact 99"):
        view(pulse_store, 99)
