"""Placeholders: found wherever they stand, and never where a shock is merely short."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pyroshock.ingest.readers import open_recording
from pyroshock.signals.checks.clipping import check_clipping
from pyroshock.signals.checks.placeholders import check_placeholders
from pyroshock.signals.placeholders import without_placeholders
from scipy.signal import firwin, lfilter

RATE_HZ = 50_000.0


@pytest.fixture
def rng():
    return np.random.default_rng(46)


def shock(rng, samples=4000, peak=4000.0, noise=1.0, band_hz=(500.0, 8000.0)):
    """A pyroshock in m/s2: decaying oscillations from 20 ms on, on the noise of a sensor."""
    time_s = np.arange(samples) / RATE_HZ - 0.02
    x = np.zeros(samples)
    on = time_s >= 0
    for frequency in rng.uniform(*band_hz, 12):
        phase = rng.uniform(0, 2 * np.pi)
        x[on] += np.exp(-time_s[on] * frequency / 8) * np.sin(
            2 * np.pi * frequency * time_s[on] + phase
        )
    return peak * x / np.abs(x).max() + noise * rng.standard_normal(samples)


def lone(x, dtype=np.float64):
    return without_placeholders(np.asarray(x, np.float64), np.asarray(x, dtype))[0].lone.tolist()


@pytest.mark.parametrize(
    "value", [9.9e37, 9.91e37, -9.9e37, 1e30, -9999.0, -999.25, 99999.0, 32767.0, -32768.0, 12345.0]
)
@pytest.mark.parametrize("at", [[0], [1], [300], [3999], [300, 900, 901], [10, 12, 14], [3000]])
def test_placeholders_are_found_wherever_they_stand_and_mended(value, at, rng):
    clean = shock(rng)
    x = clean.copy()
    x[at] = value
    placeholders, usable = without_placeholders(x, x)
    if value >= 1e30 or value <= -1e30:
        assert sorted([*placeholders.lone, *placeholders.beyond_range]) == at
    else:
        assert placeholders.lone.tolist() == at
        assert np.abs(usable - clean).max() < 0.02 * 4000


@pytest.mark.parametrize("value", [-9999.0, 9.91e37, 32767.0])
def test_a_placeholder_within_the_shock_is_found(value, rng):
    clean = shock(rng, band_hz=(300.0, 2000.0))
    peak = int(np.abs(clean).argmax())
    for at in (peak - 1, peak + 7, peak + 40):
        x = clean.copy()
        x[at] = value
        assert lone(x) == [at]


def test_the_mended_spectrum_is_that_of_the_whole_record(rng):
    from pyroshock.signals.srs.spectrum import shock_response_spectrum

    clean = shock(rng)
    x = clean.copy()
    x[[300, 1050, 2500]] = -9999.0
    lines = [500.0, 1000.0, 2000.0, 4000.0]
    right = shock_response_spectrum(clean, RATE_HZ, lines).maximax
    mended = shock_response_spectrum(without_placeholders(x, x)[1], RATE_HZ, lines).maximax
    assert mended == pytest.approx(right, rel=0.01)
    assert np.abs(shock_response_spectrum(x, RATE_HZ, lines).maximax / right - 1).max() > 0.15


def test_whole_numbers_have_their_type_s_end(channel_of, rng):
    codes = np.round(shock(rng)).astype(np.int16)
    codes[500] = -32768
    channel = channel_of(codes, "acceleration")
    (finding,) = check_placeholders(channel, ())
    assert finding.severity == "reject" and finding.evidence["samples_at"] == [500]
    assert finding.evidence["recorded"] == [-32768] and "-32768 in the file" in finding.message
    assert not check_clipping(channel, ())


def test_a_run_beyond_the_range_is_clipping_at_the_largest_reading(channel_of, rng):
    clean = shock(rng, band_hz=(300.0, 1000.0))
    x = np.where(clean > 2000.0, 9.99999e37, clean)
    channel = channel_of(x, "acceleration")
    findings = check_clipping(channel, ())
    assert {(f.check, f.severity) for f in findings} == {("clipping", "reject")}
    assert findings[0].evidence["level"] == pytest.approx(clean[clean <= 2000.0].max())
    assert not check_placeholders(channel, ()) or channel.placeholders.lone.size


# --- nothing where nothing is ---


@pytest.mark.parametrize("samples", [2, 3, 4, 5, 9])
@pytest.mark.parametrize("noise", [0.0, 0.2])
def test_short_contacts_are_no_placeholders(samples, noise, rng):
    """Half sines of few samples, at every position between samples."""
    for offset in np.linspace(0, 1, 21):
        at = np.arange(4000) - 2000 + offset
        inside = np.abs(at) < (samples + 1) / 2
        x = noise * rng.standard_normal(4000)
        x[inside] += 1000.0 * np.cos(np.pi * at[inside] / (samples + 1))
        assert lone(x) == []


@pytest.mark.parametrize("cut", [0.39, 0.4, 0.42, 0.45])
def test_the_shortest_impulse_that_an_anti_alias_filter_lets_through_is_none(cut, rng):
    """A Dirac impulse at any time between samples, seen through filters of recorders."""
    for offset in np.linspace(0, 1, 41):
        at = np.arange(-200, 200) - offset
        ideal = 2 * cut * np.sinc(2 * cut * at) * np.blackman(at.size)
        assert lone(1000.0 * ideal + 0.01 * rng.standard_normal(at.size)) == []
    fine = np.zeros(8 * 1000)
    for offset in range(8):
        fine[:] = 0
        fine[4000 + offset] = 1000.0
        decimated = lfilter(firwin(257, 2 * cut / 8), 1.0, fine)[::8]
        assert lone(decimated + 0.01 * rng.standard_normal(decimated.size)) == []


def test_content_up_to_the_nyquist_frequency_is_none(rng):
    for _ in range(200):
        x = shock(rng, samples=2000, noise=0.5, band_hz=(0.05 * RATE_HZ, 0.48 * RATE_HZ))
        assert lone(np.round(x)) == [] and lone(x) == []
    for _ in range(200):
        assert lone(rng.standard_normal(4000)) == []


@pytest.mark.parametrize(
    "law", ["step", "triangle", "sawtooth", "trapezium", "square", "one code", "exponential"]
)
def test_kinks_and_steps_are_none(law):
    x = np.zeros(1000)
    ramp = np.arange(50.0)
    x[500:550] = {
        "step": np.full(50, 100.0), "triangle": np.minimum(ramp, 50 - ramp), "sawtooth": ramp,
        "trapezium": np.minimum(np.minimum(ramp, 50 - ramp), 10), "square": np.where(ramp % 10 < 5,
        50.0, -50.0),
        "one code": np.where(ramp == 20, 1.0, 0.0) + np.where(ramp > 40, -1.0, 0.0),
        "exponential": 100 * np.exp(-ramp / 3),
    }[law]  # fmt: skip
    if law == "step":
        x[500:] = 100.0
    assert lone(x) == []


def test_light_barriers_and_triggers_may_be_one_sample_wide(channel_of):
    x = np.zeros(1000)
    x[500] = 5.0
    for quantity in ("voltage", "displacement"):
        from pyroshock.signals.channel import Channel, Sensor

        unit = {"voltage": "V", "displacement": "mm"}[quantity]
        assert not check_placeholders(Channel(Sensor("laser", quantity, unit), x, RATE_HZ), ())


def test_measured_records_have_none(real_data):
    """Every channel of the real records: shocks of pyrotechnics, drops, hammers, water entry, down
    to 500 Hz."""
    records = 0
    for file in sorted(real_data.rglob("*.npz")):
        arrays = np.load(file)
        for key in arrays.files:
            if arrays[key].dtype.kind in "iuf" and arrays[key].size >= 64:
                matrix = np.asarray(arrays[key], np.float64)
                along = (
                    matrix if matrix.ndim < 2 or matrix.shape[-1] > matrix.shape[0] else matrix.T
                )
                for x in along.reshape(-1, along.shape[-1]):
                    records += 1
                    assert lone(x[np.isfinite(x)]) == [], (file.name, key)
    for file in sorted(real_data.rglob("*.lvm")):
        with open_recording(file) as recording:
            for channel in recording.channels:
                records += 1
                assert lone(recording.read(channel.name)) == [], (file.name, channel.name)
    assert records > 200 and math.isfinite(records)
