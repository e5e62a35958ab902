"""Segmentation, smoothing and measures against pulses whose every figure is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.ingest.pulses import extract_pulses, nrmse, smoothing_spline
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


def test_twenty_points_are_the_fine_pulse_at_ventiles():
    (pulse,) = extract_pulses(half_sines([0.1], [100.0], [2e-3]), RATE)
    fine = np.arange(pulse.fine_force_n.size)
    at = np.linspace(0, fine[-1], 20)
    np.testing.assert_allclose(pulse.force_points_n, np.interp(at, fine, pulse.fine_force_n), atol=0.05)


def test_fine_pulse_has_ten_points_per_sample():
    (pulse,) = extract_pulses(half_sines([0.1], [100.0], [2e-3]), RATE)
    assert pulse.fine_period_s == pytest.approx(1 / RATE / 10)
    assert (pulse.fine_force_n.size - 1) * pulse.fine_period_s == pytest.approx(pulse.contact_time_s)


def test_ten_hits_are_found_in_order():
    starts = 0.12 + 0.9 * np.arange(10)
    peaks = np.linspace(300, 1000, 10)[::-1]
    pulses = extract_pulses(half_sines(starts, peaks, [1e-3] * 10, seconds=10, noise_n=0.5), RATE)
    assert [round(p.start_s, 1) for p in pulses] == [round(s, 1) for s in starts]
    assert [p.peak_force_n for p in pulses] == pytest.approx(list(peaks), rel=0.02)


def test_contacts_nearer_than_the_separation_are_one_impact():
    force = half_sines([0.1, 0.13, 0.5], [800, 300, 700], [1e-3] * 3)
    pulses = extract_pulses(force, RATE)
    assert [p.extra_hits for p in pulses] == [1, 0]
    assert pulses[0].start_s == pytest.approx(0.1, abs=1e-4)


def test_expected_keeps_the_main_peaks():
    force = half_sines([0.1, 0.4, 0.7], [800, 120, 700], [1e-3] * 3)
    assert len(extract_pulses(force, RATE)) == 3
    assert [round(p.start_s, 1) for p in extract_pulses(force, RATE, expected=2)] == [0.1, 0.7]


def test_mask_is_one_sample_shorter_than_walk():
    force = half_sines([0.1], [800], [9.3 / RATE])
    (walk,) = extract_pulses(force, RATE)
    (mask,) = extract_pulses(force, RATE, ExtractionSettings(segmentation="mask"))
    samples = round(walk.contact_time_s * RATE)
    assert round(mask.contact_time_s * RATE) == samples - 1
    # the thesis saw "nearly 12 %" on contacts of nine samples (Fig. 4.6)
    assert walk.segmentation_difference == pytest.approx(1 / samples)
    assert 0.08 < walk.segmentation_difference < 0.12


def test_threshold_is_a_share_of_each_peak():
    force = half_sines([0.1], [1000], [2e-3])
    (pulse,) = extract_pulses(force, RATE, ExtractionSettings(threshold=0.5))
    assert pulse.contact_time_s == pytest.approx(2e-3 * 2 / 3, abs=2.01 / RATE)


def test_noise_alone_is_no_impact():
    for seed in range(20):
        noise = np.random.default_rng(seed).normal(size=51200)
        assert extract_pulses(noise, RATE) == ()


@pytest.mark.parametrize(
    "force", [np.zeros(0), np.zeros(1), np.zeros(1000), np.full(1000, 7.5), np.full(50, np.nan)], ids=str
)
def test_silent_record_has_no_pulse(force):
    assert extract_pulses(force, RATE) == ()


@pytest.mark.parametrize("cut", [slice(None, 5140), slice(5130, None)], ids=["end", "begin"])
def test_record_that_ends_inside_a_contact_says_so(cut):
    force = half_sines([0.1], [500], [1e-3])[cut]
    (pulse,) = extract_pulses(force, RATE)
    assert pulse.truncated


def test_noise_above_the_threshold_raises_it():
    (quiet,) = extract_pulses(half_sines([0.1], [500], [2e-3], noise_n=0.5), RATE)
    (loud,) = extract_pulses(half_sines([0.1], [500], [2e-3], noise_n=5.0), RATE)
    assert (quiet.threshold_raised, loud.threshold_raised) == (False, True)


def test_gap_outside_the_contact_changes_nothing():
    force = half_sines([0.1], [500], [2e-3])
    holed = force.copy()
    holed[3000:3100] = np.nan
    (whole,), (found,) = extract_pulses(force, RATE), extract_pulses(holed, RATE)
    np.testing.assert_allclose(found.fine_force_n, whole.fine_force_n, atol=1e-9)


@given(st.integers(2, 40), st.floats(0.01, 1.0), st.integers(0, 2**32 - 1))
@settings(max_examples=40)
def test_spline_is_csaps(n, smoothing, seed):
    """Its minimiser's own condition: the penalised sum of squares is not lower anywhere near."""
    values = np.random.default_rng(seed).normal(size=n)
    fitted = smoothing_spline(values, smoothing)(np.arange(n, dtype=float))
    if smoothing == 1.0 or n < 5:
        np.testing.assert_allclose(fitted, values, atol=1e-9)
    else:
        assert np.mean((fitted - values) ** 2) <= np.mean((values - values.mean()) ** 2) + 1e-12
        # a straight line has no curvature: it is never changed
        line = 3.0 + 0.5 * np.arange(n)
        np.testing.assert_allclose(smoothing_spline(line, smoothing)(np.arange(n, dtype=float)), line, atol=1e-6)


def test_nrmse_is_equation_4_4():
    assert nrmse(np.array([0.0, 10.0]), np.array([1.0, 9.0])) == pytest.approx(0.1)


@pytest.mark.parametrize(
    "bad",
    [
        {"threshold": 0.0},
        {"threshold": float("nan")},
        {"refinement": 0},
        {"smoothing": 1.5},
        {"segmentation": "guess"},
        {"rigid_to_hz": 5.0},
    ],
    ids=str,
)
def test_setting_out_of_bounds_is_named(bad):
    with pytest.raises(ValueError, match=next(iter(bad)).split("_to_")[0]):
        ExtractionSettings(**bad)


def test_fingerprint_tells_settings_apart():
    assert ExtractionSettings().fingerprint == ExtractionSettings().fingerprint
    assert ExtractionSettings(threshold=0.01).fingerprint != ExtractionSettings().fingerprint
