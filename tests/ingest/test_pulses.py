"""Segmentation, smoothing and measures against pulses whose every figure is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.ingest.pulses import extract_pulses
from pyroshock.ingest.settings import ExtractionSettings

RATE = 51200.0


def half_sines(times_s, peaks_n, widths_s, seconds=1.0, rate=RATE, noise_n=0.0, seed=0):
    """A force record (n,) of half-sine contacts that begin at `times_s`."""
    time = np.arange(round(seconds * rate)) / rate
    force = np.random.default_rng(seed).normal(size=time.size) * noise_n
    for start, peak, width in zip(times_s, peaks_n, widths_s, strict=True):
        inside = (time > start) & (time < start + width)
        force[inside] += peak * np.sin(np.pi * (time[inside] - start) / width)
    return force


@given(
    peak=st.floats(1.0, 1e6),
    samples=st.floats(9.0, 400.0),
    start=st.floats(0.1, 0.2),
    sign=st.sampled_from([1, -1]),
    offset=st.floats(-0.5, 0.5),
)
@settings(max_examples=60)
def test_half_sine_gives_its_own_figures_back(peak, samples, start, sign, offset):
    width = samples / RATE
    force = sign * half_sines([start], [peak], [width]) + offset * peak
    (pulse,) = extract_pulses(force, RATE)
    step = 1 / RATE
    assert pulse.sign == sign
    assert pulse.start_s == pytest.approx(start, abs=1.01 * step + 0.002 * width)
    assert width - 0.01 * width - step <= pulse.contact_time_s <= width + 2 * step
    # the highest sample lies at most half a step from the peak; the spline between samples gets nearer
    assert peak * np.cos(np.pi / 2 / samples) * 0.999 <= pulse.peak_force_n <= peak * 1.001
    assert pulse.spline_peak_force_n == pytest.approx(peak, rel=0.01)
    assert pulse.impulse_n_s == pytest.approx(2 / np.pi * peak * width, rel=0.02)
    assert pulse.width_half_s == pytest.approx(2 / 3 * width, rel=0.03)
    assert pulse.compression_time_s == pytest.approx(width / 2, abs=1.1 * step)
    assert pulse.compression_impulse_n_s == pytest.approx(pulse.impulse_n_s / 2, rel=0.25)
    assert pulse.spline_nrmse < 0.01
    assert pulse.force_points_n.shape == (20,)


def test_fine_pulse_has_ten_points_per_sample_and_twenty_points_at_its_ventiles():
    force = half_sines([0.1], [100.0], [2e-3])
    (pulse,) = extract_pulses(force, RATE)
    fine = np.arange(pulse.fine_force_n.size)
    at = np.linspace(0, fine[-1], 20)
    np.testing.assert_allclose(pulse.force_points_n, np.interp(at, fine, pulse.fine_force_n), atol=0.05)
    assert pulse.fine_period_s == pytest.approx(1 / RATE / 10)
    assert (pulse.fine_force_n.size - 1) * pulse.fine_period_s == pytest.approx(pulse.contact_time_s)
    (upper,) = extract_pulses(force, RATE, ExtractionSettings(threshold=0.5))  # a share of each peak
    assert upper.contact_time_s == pytest.approx(2e-3 * 2 / 3, abs=2.01 / RATE)


def test_ten_hits_are_found_in_order():
    starts = 0.12 + 0.9 * np.arange(10)
    peaks = np.linspace(300, 1000, 10)[::-1]
    pulses = extract_pulses(half_sines(starts, peaks, [1e-3] * 10, seconds=10, noise_n=0.5), RATE)
    assert [round(p.start_s, 1) for p in pulses] == [round(s, 1) for s in starts]
    assert [p.peak_force_n for p in pulses] == pytest.approx(list(peaks), rel=0.02)


def test_noise_alone_is_no_impact():
    for seed in range(20):
        noise = np.random.default_rng(seed).normal(size=51200)
        assert extract_pulses(noise, RATE) == ()


@pytest.mark.parametrize(
    "force", [np.zeros(0), np.zeros(1), np.zeros(1000), np.full(1000, 7.5), np.full(50, np.nan)], ids=str
)
def test_silent_record_has_no_pulse(force):
    assert extract_pulses(force, RATE) == ()


def test_noise_above_the_threshold_raises_it():
    (quiet,) = extract_pulses(half_sines([0.1], [500], [2e-3], noise_n=0.5), RATE)
    (loud,) = extract_pulses(half_sines([0.1], [500], [2e-3], noise_n=5.0), RATE)
    assert (quiet.threshold_raised, loud.threshold_raised) == (False, True)


@pytest.mark.parametrize(
    "bad",
    [{"threshold": 0.0}, {"threshold": float("nan")}, {"refinement": 0}, {"smoothing": 1.5}, {"segmentation": "guess"},
     {"rigid_to_hz": 5.0}],
    ids=str,
)  # fmt: skip
def test_setting_out_of_bounds_is_named(bad):
    with pytest.raises(ValueError, match=next(iter(bad)).split("_to_")[0]):
        ExtractionSettings(**bad)


def test_fingerprint_tells_settings_apart():
    assert ExtractionSettings().fingerprint == ExtractionSettings().fingerprint
    assert ExtractionSettings(threshold=0.01).fingerprint != ExtractionSettings().fingerprint
