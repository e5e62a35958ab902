"""Accelerations beside their spectrum: each check finds what is planted, and none accuses a sound
record."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from pyroshock.signals.channel import Channel, Sensor
from pyroshock.signals.checks import Finding, run_checks, run_spectrum_checks
from pyroshock.signals.checks.recording import check_recording_channels
from pyroshock.signals.srs.spectrum import octave_grid, shock_response_spectrum

RATE = 100_000.0
SAMPLES = 20_000
ONSET = 2_000
G = 9.80665
LINES = octave_grid(20, 10_000)
#: Notes that say something of a spectrum; noise and short rests before a shock do not.
NOTES = ("rest-level", "truncation", "zero-shift")


def ringing(seed: int = 1) -> np.ndarray:
    """Five decaying modes after 20 ms of rest, with noise 70 dB below the peak: what a plate does
    when it is hit."""
    rng = np.random.default_rng(seed)
    time = np.arange(SAMPLES - ONSET) / RATE
    x = np.zeros(SAMPLES)
    for hz, height in zip((700, 1300, 2600, 4300, 7100), rng.normal(0, 1000, 5), strict=True):
        x[ONSET:] += height * np.sin(2 * np.pi * hz * time) * np.exp(-0.02 * 2 * np.pi * hz * time)
    return x + rng.normal(0, 3e-4 * np.abs(x).max(), SAMPLES)


def findings(x, rate=RATE, lines=LINES, full_scale=None, **options) -> dict[str, Finding]:
    x = np.ascontiguousarray(x, dtype=np.float64)
    spectrum = shock_response_spectrum(x, rate, lines, **options)
    channel = Channel(Sensor("probe", "acceleration", "m/s2", range=full_scale), x, rate)
    findings = check_recording_channels(
        [channel], run_checks(channel, ()) + run_spectrum_checks(channel, spectrum)
    )
    return {
        finding.check: finding
        for finding in findings
        if finding.severity != "note" or finding.check in NOTES
    }


@pytest.mark.parametrize("seed", range(20))
def test_sound_record_is_not_accused(seed):
    assert findings(ringing(seed)) == {}


def test_free_body_that_keeps_its_velocity_is_not_accused():
    x = ringing()
    x[ONSET : ONSET + 100] += 3000 * np.sin(np.pi * np.arange(100) / 100)  # 1.9 m/s for good
    assert findings(x) == {}


@pytest.mark.parametrize("polarity", [1, -1])
def test_planted_zero_shift_and_clipped_crest_are_found_with_their_size(polarity):
    x = ringing()
    peak = np.abs(x).max()
    x[ONSET + 50 :] += polarity * 0.02 * peak
    clipping_findings = findings(x)
    assert set(clipping_findings) == {"zero-shift", "balance"}
    assert clipping_findings["zero-shift"].evidence["peak_share"] == pytest.approx(0.02, rel=0.1)
    assert ("positive" if polarity > 0 else "negative") in clipping_findings["balance"].message
    x = polarity * ringing()
    clipping_findings = findings(np.clip(x, -np.inf, 0.6 * x.max()))
    assert (
        clipping_findings["clipping"].evidence["longest_samples"] >= 3
        and clipping_findings["clipping"].severity == "reject"
    )


def test_offset_is_a_rest_level_and_wander_that_comes_back_a_displacement():
    x = ringing()
    found = findings(x + 0.01 * np.abs(x).max())
    assert "rest-level" in found and "zero-shift" not in found
    assert found["rest-level"].evidence["peak_share"] == pytest.approx(0.01, rel=0.05)
    wander = np.sin(
        2 * np.pi * np.arange(SAMPLES - ONSET) / (SAMPLES - ONSET)
    )  # no velocity at the end
    x[ONSET:] += 0.02 * np.abs(x).max() * wander
    found = findings(x)
    assert "displacement" in found and "velocity" not in found


def test_coarse_converter_and_slow_crest_are_no_clipping():
    x = ringing()
    for step in (2 * np.abs(x).max() / 2**bits for bits in (8, 10, 12, 16)):
        assert "clipping" not in findings(np.round(x / step) * step)
    for cycles in (1, 3, 40):
        slow = np.round(500 * np.sin(2 * np.pi * cycles * np.arange(SAMPLES) / SAMPLES))
        assert "clipping" not in findings(slow)


def test_peak_at_full_scale_is_saturation_and_a_record_with_a_hole_is_refused():
    x = ringing()
    assert "saturation" in findings(x, full_scale=float(np.abs(x).max()))
    assert findings(x, full_scale=2 * float(np.abs(x).max())) == {}
    x[100:103] = np.nan
    with pytest.raises(ValueError, match="3 samples that are no numbers, the first at 100"):
        findings(x)


def test_noise_before_the_shock_limits_the_lines():
    x = ringing() + 100 * np.sin(2 * np.pi * 150 * np.arange(SAMPLES) / RATE)
    floor = findings(x)["noise-floor"]
    assert 150 < floor.evidence["from_hz"] < 700 and floor.evidence["to_hz"] == LINES[-1]
    # White noise 16 dB below the peak drives the lines above all modes, and those far below, as the
    # shock does.
    x = ringing()
    noise = np.random.default_rng(3).normal(0, 0.15 * np.abs(x).max(), SAMPLES)
    low, high = re.findall(
        r"from (\d+) to (\d+) Hz only", findings(x + noise)["noise-floor"].message
    )[0]
    largest = LINES[shock_response_spectrum(x, RATE, LINES).maximax.argmax()]
    assert 700 < float(low) < largest < float(high) < 10_000


def test_lines_that_the_record_cannot_show_are_named():
    """A burst at five samples a cycle is off at every line, until it is resampled; of one at half
    the sampling rate nothing can be told."""
    at = np.arange(4000) / 20_000 - 0.1
    bursts = {
        hz: 100 * np.exp(-((at / 2e-3) ** 2)) * np.sin(2 * np.pi * hz * at)
        for hz in (4000.0, 9900.0)
    }
    lines = np.array([250.0, 500.0, 1000.0, 2000.0])
    plain = findings(bursts[4000.0], 20_000.0, lines, resample_within=None)["sampling"]
    assert "trust no line" in plain.message and "--no-resample" in plain.message
    assert "sampling" not in findings(bursts[4000.0], 20_000.0, lines)
    folded = findings(bursts[9900.0], 20_000.0, lines)["sampling"]
    assert (
        "half the sampling rate" in folded.message
        and folded.evidence["close_to_half_rate_share"] > 0.5
    )
    assert "truncation" in findings(ringing()[: ONSET + 300], lines=LINES[LINES > 500])


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("share", [0.01, 0.03, 0.1])
def test_white_noise_is_neither_ringing_nor_offset(share, seed):
    x = ringing(seed)
    noise = np.random.default_rng(seed).normal(0, share * np.abs(x).max(), SAMPLES)
    assert set(findings(x + noise)) <= {"noise-floor", "pre-trigger-noise"}


@pytest.mark.parametrize("factor", [-1.0, 1e-6, -1e6])
def test_findings_depend_neither_on_size_nor_on_sign(factor):
    x = ringing()
    x[ONSET + 50 :] += 0.02 * np.abs(x).max()
    x = np.minimum(x, 0.7 * x.max())
    assert list(findings(factor * x)) == list(findings(x)) != []


def irvine(real_data: Path, name: str) -> tuple[np.ndarray, float]:
    table = np.load(real_data / "vibrationdata-irvine" / "records.npz")[name]
    return table[:, 1] * G, (len(table) - 1) / (table[-1, 0] - table[0, 0])


def test_raw_and_cleaned_pyroshock_are_told_apart(real_data):
    """One event, with its zero shift and mended. As published beside the records: 239 g against
    20.5 g at 100 Hz; at 2 kHz 0.1 dB apart."""
    raw, cleaned = (irvine(real_data, f"rv_separation_{name}_txt") for name in ("raw", "cleaned"))
    lines = np.array([100.0, 126, 159, 200, 500, 1000, 2000])
    assert {"zero-shift", "balance"} <= set(findings(*raw, lines))
    assert findings(*cleaned, lines) == {}
    largest = [
        shock_response_spectrum(*record, [100.0, 2000.0], resample_within=None).maximax / G
        for record in (raw, cleaned)
    ]
    assert [at_100_hz for at_100_hz, _ in largest] == pytest.approx([239, 20.5], rel=2e-3)
    assert abs(20 * np.log10(largest[0][1] / largest[1][1])) < 0.1


def test_saturated_sensor_is_found_and_the_one_beside_it_is_not(real_data):
    """Flat at 42.01 g for 13 samples; the larger sensor shows 64 g."""
    windows = np.load(real_data / "endaq-ide" / "windows_300ms.npz")
    found = {}
    for sensor in ("40g_DC", "100g_PR"):
        table = windows[f"water6mps_{sensor}_Acceleration"].astype(np.float64)
        rate = (len(table) - 1) / (table[-1, 0] - table[0, 0])
        found[sensor] = findings(table[:, 1] * G, rate, octave_grid(10, 100))
    assert found["40g_DC"]["clipping"].evidence["longest_samples"] == 13
    assert "clipping" not in found["100g_PR"]


def test_drop_table_shocks_are_not_accused_and_hammer_hits_of_their_cut_alone(real_data):
    """33 hits on a structure that rings beyond the quarter of a second kept here."""
    hits = np.load(real_data / "vrtac-impact-hammer" / "dewesoft_20000Hz.npz")
    checks: set[str] = set()
    for name in (key for key in hits.files if key.startswith("F")):
        for record in hits[name][:, 1:].reshape(-1, hits[name].shape[-1]):
            checks |= set(findings(record, 20_000.0, octave_grid(20, 2000)))
    assert checks <= {"truncation"}
    # They keep a velocity of some 14 m/s, and begin with a slow foot that is no offset.
    shocks = np.load(real_data / "afrl-ds3-electronics-shock" / "shocks.npz")
    accused = [
        set(findings(shocks[name][:, 1] * G, 1e6, octave_grid(400, 1e5)))
        for name in shocks.files
        if name[0] == "T"
    ]
    assert accused == [set()] * 6
