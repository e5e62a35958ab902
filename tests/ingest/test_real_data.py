"""Measured records of others, ingested as a laboratory would: their published figures come out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pyroshock.ingest.extraction.pulses import extract_pulses
from pyroshock.ingest.extraction.settings import ExtractionSettings
from pyroshock.ingest.load import ingest_folder
from pyroshock.ingest.readers import open_recording
from pyroshock.schema.impacts import ChannelFigures, Impact, Pulse
from pyroshock.schema.recordings import QualityFinding, Recording
from pyroshock.signals.shock_figures import shock_figures
from sqlalchemy import select
from support.records.campaigns import write_folder

HEAD = '[campaign]\nname = "{name}"\nkind = "hammer"\ndate = "2026-01-01"\n'


def write(folder: Path, name: str, channels: str, recordings: dict[str, dict[str, object]]) -> Path:
    """A hammer campaign of .npz recordings, one row each."""
    rows = [
        "run,repetition,recording",
        *(f"{i},1,{file}.npz" for i, file in enumerate(recordings, 1)),
    ]
    files = {f"{file}.npz": arrays for file, arrays in recordings.items()}
    return write_folder(folder, HEAD.format(name=name) + channels, rows, files)


def pulses_of(store):
    with store.reading() as session:
        return list(session.scalars(select(Pulse).join(Impact).order_by(Impact.run)))


def doubts(store):
    """(recording, check) of every finding that is more than a note."""
    with store.reading() as session:
        query = select(Recording.path, QualityFinding.check).join(
            QualityFinding, QualityFinding.recording_id == Recording.id
        )
        return {
            tuple(row) for row in session.execute(query.where(QualityFinding.severity != "note"))
        }


def test_vrtac_hits_are_all_found_with_the_published_slope(store, real_data, tmp_path):
    records = np.load(real_data / "vrtac-impact-hammer" / "dewesoft_20000Hz.npz")
    recordings = {
        f"{key}_{i}": {
            "force": records[key][i, 0],
            "acceleration": records[key][i, 3],
            "fs": records["fs"],
        }
        for key in records.files
        if records[key].ndim == 3
        for i in range(3)
    }
    channels = (
        '[channels.force]\nquantity="force"\nunit="N"\n'
        '[channels.acceleration]\nquantity="acceleration"\nunit="m/s2"\n'
    )
    report = ingest_folder(store, write(tmp_path / "vrtac", "vrtac", channels, recordings))
    pulses = pulses_of(store)
    assert (report.impacts, len(pulses), report.set_aside) == (33, 33, [])
    peak, width = (
        np.log([getattr(p, name) for p in pulses]) for name in ("peak_force_n", "width_half_s")
    )
    slope, _ = np.polyfit(peak, width, 1)
    assert slope == pytest.approx(-0.157, abs=0.01)
    assert not {check for _, check in doubts(store)} & {"double-hit", "clipping", "saturation"}


def test_ladisk_hit_has_the_published_figures(real_data):
    from pyroshock.ingest.readers import open_recording

    with open_recording(real_data / "ladisk-imac-tutorial" / "acceleration.lvm") as recording:
        force = recording.read("Force (Trigger)")
        rate = recording.info("Force (Trigger)").sampling_rate_hz
    # the published width is where the force passes a tenth of the peak, on whole samples
    (pulse,) = extract_pulses(force, rate, ExtractionSettings(threshold=0.1))
    assert pulse.peak_force_n == pytest.approx(195.6, abs=0.5)
    assert pulse.contact_time_s == pytest.approx(220e-6, abs=1e-9)
    assert pulse.impulse_n_s == pytest.approx(0.0247, rel=0.01)
    (whole,) = extract_pulses(force, rate)
    assert whole.impulse_n_s == pytest.approx(0.0247, rel=0.01)


#: Peak (1,000 g) and width at a tenth of it (ms) as published.
AFRL = {
    "T04": (6.5, 0.305),
    "T04repeat": (7.95, 0.29),
    "T05": (14, 0.22),
    "T06": (21, 0.155),
    "T07": (17.55, 0.13),
}
AFRL["T08"] = (29.5, 0.095)


def test_saturated_endaq_sensor_is_flagged_and_its_reference_not(store, real_data, tmp_path):
    records = np.load(real_data / "endaq-ide" / "windows_300ms.npz")
    recordings = {}
    for name, key in (
        ("saturated", "water6mps_40g_DC_Acceleration"),
        ("reference", "water6mps_100g_PR_Acceleration"),
    ):
        time, x, *_ = records[key].astype(float).T
        recordings[name] = {"time": time, "x": x.astype(np.float32)}
    channels = '[channels.x]\nquantity="acceleration"\nunit="g"\nposition="impactor"\n'
    ingest_folder(store, write(tmp_path / "endaq", "endaq", channels, recordings))
    flagged = {path for path, check in doubts(store) if check in ("clipping", "saturation")}
    assert flagged == {"saturated.npz"}


def test_raw_irvine_record_is_flagged_for_zero_shift_and_the_cleaned_not(
    store, real_data, tmp_path
):
    records = np.load(real_data / "vibrationdata-irvine" / "records.npz")
    recordings = {
        name: {"time": records[key][:, 0], "a": records[key][:, 1]}
        for name, key in (
            ("raw", "rv_separation_raw_txt"),
            ("cleaned", "rv_separation_cleaned_txt"),
        )
    }
    channels = '[channels.a]\nquantity="acceleration"\nunit="g"\n'
    ingest_folder(store, write(tmp_path / "irvine", "irvine", channels, recordings))
    assert {path for path, check in doubts(store) if check == "zero-shift"} == {"raw.npz"}


@pytest.mark.parametrize(
    ("name", "impacts", "shots", "recordings"),
    [
        ("gun-valve-flow", 0, 32, 0),
        ("hammer-effective-mass", 32, 0, 32),
        ("plate-damping", 20, 0, 20),
    ],
)
def test_example_campaigns_ingest_whole(store, examples, name, impacts, shots, recordings):
    report = ingest_folder(store, examples / name)
    assert (report.impacts, report.shots, report.recordings) == (impacts, shots, recordings)
    assert report.set_aside == []
    assert len(pulses_of(store)) == impacts
    assert doubts(store) == set()


@pytest.mark.parametrize("shock", AFRL)
def test_afrl_shocks_have_the_published_figures(store, real_data, tmp_path, shock):
    """As a pulse, and as a campaign without a force; peak and width after a 50 kHz low-pass, as
    published."""
    from scipy.signal import butter, sosfiltfilt

    record = np.load(real_data / "afrl-ds3-electronics-shock" / "shocks.npz")[shock]
    smooth = sosfiltfilt(butter(4, 50e3, fs=1e6, output="sos"), record[:, 1])
    (pulse,) = extract_pulses(smooth / 1e3, 1e6)
    channels = '[channels.fixture]\nquantity="acceleration"\nunit="g"\n'
    ingest_folder(
        store, write(tmp_path / "afrl", "afrl", channels, {"shock": {"fixture": smooth, "fs": 1e6}})
    )
    with store.reading() as session:
        figures = session.scalars(select(ChannelFigures)).one()
    found_kg = [pulse.peak_force_n, figures.peak_acceleration_m_s2 / 9806.65]
    peak_kg, width_ms = AFRL[shock]
    assert found_kg == pytest.approx([peak_kg] * 2, rel=0.02)
    # their reading of the width from a figure scatters by a tenth about ours
    found_ms = [pulse.width_tenth_s * 1e3, figures.pulse_duration_s * 1e3]
    assert found_ms == pytest.approx([width_ms] * 2, rel=0.25)


def test_irvine_records_have_the_published_velocities_and_spectrum(real_data):
    """Raw, the record integrates to -75.2 m/s, cleaned to none; a synthesised record comes with its
    spectrum."""
    records = np.load(real_data / "vibrationdata-irvine" / "records.npz")
    velocities = []
    for key in ("rv_separation_raw_txt", "rv_separation_cleaned_txt"):
        time, acceleration = records[key].T
        figures = shock_figures(acceleration * 9.80665, (time.size - 1) / (time[-1] - time[0]))
        rest = figures.rest_m_s2 or 0.0
        velocities.append(figures.record_velocity_change_m_s + rest * (time[-1] - time[0]))
    assert velocities == pytest.approx([-75.2, 0.0], abs=0.5)
    time, acceleration = records["srs2000G_accel_txt"].T
    figures = shock_figures(acceleration, (time.size - 1) / (time[-1] - time[0]))
    frequency, positive, negative = records["srs2000_pn_txt"].T
    theirs = np.interp(
        np.log(figures.srs_frequency_hz), np.log(frequency), np.maximum(positive, np.abs(negative))
    )
    inside = np.array(figures.srs_frequency_hz) >= frequency[0]
    assert np.array(figures.srs_maximax_m_s2)[inside] == pytest.approx(theirs[inside], rel=0.05)


def test_a_modal_hammer_hit_from_labview(real_data):
    """Published with it: 50 kHz, 50030 samples, decimal comma, 195.6 N, +35.5 and -27.8 g."""
    with open_recording(real_data / "ladisk-imac-tutorial" / "acceleration.lvm") as recording:
        assert [(c.unit, c.samples, c.sampling_rate_hz, c.start_s) for c in recording.channels] == [
            ("g", 50030, 50000.0, 0.0),
            ("Newtons", 50030, 50000.0, 0.0),
        ]
        acceleration, force = (recording.read(c.name) for c in recording.channels)
    assert force.max() == pytest.approx(195.6, abs=0.05)
    assert (acceleration.max(), acceleration.min()) == (
        pytest.approx(35.5, abs=0.05),
        pytest.approx(-27.8, abs=0.05),
    )
    assert (acceleration[0], force[-1]) == (-0.007387, pytest.approx(force[-1]))


def test_the_example_campaigns_open_with_what_scipy_reads(shared):
    from scipy.io import loadmat

    first = sorted(shared.glob("examples/*/recordings/0001.mat"))
    assert len(first) == 2
    for path in first:
        peer = loadmat(path)
        with open_recording(path) as recording:
            for channel in recording.channels:
                assert channel.sampling_rate_hz == peer["fs"].item()
                np.testing.assert_array_equal(
                    recording.read(channel.name), peer[channel.name].reshape(-1)
                )
            assert {c.name for c in recording.channels} == {
                n for n in peer if not n.startswith("__")
            } - {"fs"}
