"""Smoothing and measures against pulses whose every figure is known, and shapes whose samples give
it exactly."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.ingest.extraction.pulses import extract_pulses, nrmse, smoothing_spline
from pyroshock.ingest.extraction.settings import ExtractionSettings

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
    # the highest sample lies at most half a step from the peak; the spline between samples gets
    # nearer
    assert peak * np.cos(np.pi / 2 / samples) * 0.999 <= pulse.peak_force_n <= peak * 1.001
    assert pulse.spline_peak_force_n == pytest.approx(peak, rel=0.01)
    assert pulse.impulse_n_s == pytest.approx(2 / np.pi * peak * width, rel=0.02)
    assert pulse.width_half_s == pytest.approx(2 / 3 * width, rel=0.03)
    assert pulse.compression_time_s == pytest.approx(width / 2, abs=1.1 * step)
    assert pulse.compression_impulse_n_s == pytest.approx(pulse.impulse_n_s / 2, rel=0.25)
    assert pulse.spline_nrmse < 0.01
    assert pulse.force_points_n.shape == (20,)


def test_fine_pulse_has_ten_points_per_sample_and_twenty_at_its_ventiles():
    (pulse,) = extract_pulses(half_sines([0.1], [100.0], [2e-3]), RATE)
    fine = np.arange(pulse.fine_force_n.size)
    at = np.linspace(0, fine[-1], 20)
    np.testing.assert_allclose(
        pulse.force_points_n, np.interp(at, fine, pulse.fine_force_n), atol=0.05
    )
    assert pulse.fine_period_s == pytest.approx(1 / RATE / 10)
    assert (pulse.fine_force_n.size - 1) * pulse.fine_period_s == pytest.approx(
        pulse.contact_time_s
    )


def test_hits_are_found_in_order_joined_when_near_and_the_main_ones_kept():
    starts = 0.12 + 0.9 * np.arange(10)
    peaks = np.linspace(300, 1000, 10)[::-1]
    pulses = extract_pulses(half_sines(starts, peaks, [1e-3] * 10, seconds=10, noise_n=0.5), RATE)
    assert [round(p.start_s, 1) for p in pulses] == [round(s, 1) for s in starts]
    assert [p.peak_force_n for p in pulses] == pytest.approx(list(peaks), rel=0.02)
    force = half_sines([0.1, 0.13, 0.5], [800, 300, 700], [1e-3] * 3)
    pulses = extract_pulses(force, RATE)
    assert [p.extra_hits for p in pulses] == [1, 0]
    assert pulses[0].start_s == pytest.approx(0.1, abs=1e-4)
    force = half_sines([0.1, 0.4, 0.7], [800, 120, 700], [1e-3] * 3)
    assert len(extract_pulses(force, RATE)) == 3
    assert [round(p.start_s, 1) for p in extract_pulses(force, RATE, expected=2)] == [0.1, 0.7]


def test_mask_is_one_sample_shorter_and_the_threshold_a_share_that_noise_raises():
    force = half_sines([0.1], [800], [9.3 / RATE])
    (walk,) = extract_pulses(force, RATE)
    (mask,) = extract_pulses(force, RATE, ExtractionSettings(segmentation="mask"))
    samples = round(walk.contact_time_s * RATE)
    assert round(mask.contact_time_s * RATE) == samples - 1
    # the thesis saw "nearly 12 %" on contacts of nine samples (Fig. 4.6)
    assert walk.segmentation_difference == pytest.approx(1 / samples)
    assert 0.08 < walk.segmentation_difference < 0.12
    force = half_sines([0.1], [1000], [2e-3])
    (pulse,) = extract_pulses(force, RATE, ExtractionSettings(threshold=0.5))
    assert pulse.contact_time_s == pytest.approx(2e-3 * 2 / 3, abs=2.01 / RATE)
    (quiet,) = extract_pulses(half_sines([0.1], [500], [2e-3], noise_n=0.5), RATE)
    (loud,) = extract_pulses(half_sines([0.1], [500], [2e-3], noise_n=5.0), RATE)
    assert (quiet.threshold_raised, loud.threshold_raised) == (False, True)


def test_noise_alone_and_silence_are_no_impact():
    noises = [np.random.default_rng(seed).normal(size=51200) for seed in range(20)]
    for force in (
        *noises,
        np.zeros(0),
        np.zeros(1),
        np.zeros(1000),
        np.full(1000, 7.5),
        np.full(50, np.nan),
    ):
        assert extract_pulses(force, RATE) == ()


@pytest.mark.parametrize("cut", [slice(None, 5140), slice(5130, None)], ids=["end", "begin"])
def test_record_that_ends_inside_a_contact_says_so(cut):
    force = half_sines([0.1], [500], [1e-3])[cut]
    (pulse,) = extract_pulses(force, RATE)
    assert pulse.truncated


def test_setting_out_of_bounds_is_named_and_a_fingerprint_tells_them_apart():
    for name, value in (("threshold", 0.0), ("threshold", np.nan), ("refinement", 0),
                        ("smoothing", 1.5), ("segmentation", "guess"),
                        ("rigid_to_hz", 5.0)):  # fmt: skip
        with pytest.raises(ValueError, match=name.split("_to_")[0]):
            ExtractionSettings(**{name: value})
    assert ExtractionSettings().fingerprint == ExtractionSettings().fingerprint
    assert ExtractionSettings(threshold=0.01).fingerprint != ExtractionSettings().fingerprint


LOW_RATE = 1000.0
#: Up in 4 samples, down in 10.
TRIANGLE = np.concatenate([np.linspace(0, 100, 5), np.linspace(90, 0, 10)])
EXACT = ExtractionSettings(smoothing=1.0, points=15, refinement=10)


def record(shape: np.ndarray, before: int = 2000, after: int = 500) -> np.ndarray:
    return np.concatenate([np.zeros(before), shape, np.zeros(after)])


@pytest.mark.parametrize("sign", [1, -1])
def test_triangle_gives_its_own_figures(sign):
    (pulse,) = extract_pulses(sign * (record(TRIANGLE) + 30.0), LOW_RATE, EXACT, start_s=0.25)
    assert (pulse.contact.first, pulse.contact.peak, pulse.contact.last) == (2000, 2004, 2014)
    assert (pulse.sign, pulse.rest_n, pulse.peak_force_n) == (sign, 30.0, 100.0)
    assert (pulse.start_s, pulse.contact_time_s) == (pytest.approx(2.25), pytest.approx(14e-3))
    assert pulse.width_half_s == pytest.approx(7e-3)
    assert pulse.width_tenth_s == pytest.approx(12.6e-3)
    assert (pulse.samples_in_contact, pulse.threshold_n) == (13, pytest.approx(0.5))
    assert pulse.segmentation_difference == pytest.approx(1 / 14)
    assert (pulse.threshold_raised, pulse.truncated, pulse.extra_hits) == (False, False, 0)
    assert pulse.spline_nrmse == pytest.approx(0, abs=1e-12)
    np.testing.assert_allclose(pulse.force_points_n, TRIANGLE, atol=1e-9)
    np.testing.assert_allclose(pulse.fine_force_n[::10], TRIANGLE, atol=1e-9)
    assert pulse.fine_period_s == pytest.approx(1e-4)
    assert pulse.compression_time_s == pytest.approx(np.argmax(pulse.fine_force_n) * 1e-4)
    assert pulse.spline_peak_force_n == pulse.fine_force_n.max()


def test_half_sine_between_its_samples_and_a_compression_of_one_sample():
    sine = 100 * np.sin(np.pi * np.arange(41) / 40)
    (pulse,) = extract_pulses(record(sine), LOW_RATE, EXACT)
    np.testing.assert_allclose(
        pulse.fine_force_n, 100 * np.sin(np.pi * np.arange(401) / 400), atol=0.7
    )
    assert pulse.compression_time_s == pytest.approx(20e-3)
    assert pulse.impulse_n_s == pytest.approx(2 / np.pi * 100 * 40e-3, rel=1e-3)
    assert pulse.compression_impulse_n_s == pytest.approx(pulse.impulse_n_s / 2, rel=1e-9)
    coarse = ExtractionSettings(smoothing=1.0, refinement=1)
    (pulse,) = extract_pulses(record(np.array([0.0, 100, 50, 0])), LOW_RATE, coarse)
    assert pulse.compression_impulse_n_s == pytest.approx(0.05)


def test_width_counts_from_the_end_of_a_record_to_where_a_flat_top_falls_and_without_shoulders():
    (late,) = extract_pulses(record(TRIANGLE[4:], before=0), LOW_RATE, EXACT)
    assert (late.width_half_s, late.width_tenth_s) == (pytest.approx(5e-3), pytest.approx(9e-3))
    assert (late.compression_time_s, late.compression_impulse_n_s) == (0.0, 0.0)
    (early,) = extract_pulses(record(TRIANGLE[:7], after=0), LOW_RATE, EXACT)
    assert (early.width_half_s, early.width_tenth_s) == (pytest.approx(4e-3), pytest.approx(5.6e-3))
    (flat,) = extract_pulses(record(np.full(6, 80.0)), LOW_RATE, EXACT)  # to where it falls
    assert flat.width_half_s == pytest.approx(6e-3)
    (shoulders,) = extract_pulses(
        record(np.array([0.0, 50, 50, 100, 50, 50, 0])), LOW_RATE, EXACT
    )  # are outside
    assert shoulders.width_half_s == pytest.approx(2e-3)


def test_sample_at_the_threshold_two_samples_and_a_gap_are_no_exceptions():
    (pulse,) = extract_pulses(record(TRIANGLE), LOW_RATE, ExtractionSettings(threshold=0.1))
    assert (pulse.contact.first, pulse.contact.last, pulse.samples_in_contact) == (2000, 2013, 12)
    calm = ExtractionSettings(event_noise=0.0, threshold_noise=0.0)
    assert len(extract_pulses(np.array([0.0, 1.0]), LOW_RATE, calm)) == 1
    holed = record(TRIANGLE)
    holed[[1998, 2016]] = np.nan
    (holed_pulse,), (whole,) = (
        extract_pulses(holed, LOW_RATE, EXACT),
        extract_pulses(record(TRIANGLE), LOW_RATE, EXACT),
    )
    np.testing.assert_array_equal(holed_pulse.fine_force_n, whole.fine_force_n)


def test_as_many_main_hits_as_expected_are_kept():
    hits = np.concatenate([record(TRIANGLE), record(TRIANGLE / 2), record(TRIANGLE / 4)])
    assert [pulse.peak_force_n for pulse in extract_pulses(hits, LOW_RATE, EXACT, expected=3)] == [
        100,
        50,
        25,
    ]
    assert [pulse.peak_force_n for pulse in extract_pulses(hits, LOW_RATE, EXACT, expected=2)] == [
        100,
        50,
    ]
    twice = np.concatenate([TRIANGLE, np.zeros(20), TRIANGLE / 8])
    hits = np.concatenate([record(twice), record(TRIANGLE / 2)])
    (pulse,) = extract_pulses(hits, LOW_RATE, EXACT, expected=1)
    assert (pulse.peak_force_n, pulse.extra_hits) == (100, 1)


@pytest.mark.parametrize("samples", [5, 6, 7, 30, 400])
@pytest.mark.parametrize("smoothing", [0.01, 0.5, 0.99, 0.999999])
def test_is_scipys_smoothing_spline(samples, smoothing):
    from scipy.interpolate import make_smoothing_spline

    x = np.arange(float(samples))
    values = 1e3 * np.sin(x / samples * np.pi) + np.random.default_rng(samples).normal(
        0, 10, samples
    )
    at = np.linspace(0, samples - 1, 10 * samples)
    expected = make_smoothing_spline(x, values, lam=(1 - smoothing) / smoothing)(at)
    np.testing.assert_allclose(smoothing_spline(values, smoothing)(at), expected, rtol=0, atol=1e-9)


def test_straight_line_and_few_samples_are_gone_through():
    values = np.random.default_rng(0).normal(size=20)
    np.testing.assert_allclose(smoothing_spline(values, 1.0)(np.arange(20.0)), values, atol=1e-12)
    for samples in (2, 3, 4):
        squares = np.arange(samples) ** 2.0
        np.testing.assert_allclose(
            smoothing_spline(squares, 0.5)(np.arange(float(samples))), squares, atol=1e-12
        )
    values = 3.0 * np.arange(50.0) - 7.0
    np.testing.assert_allclose(
        smoothing_spline(values, 0.01)(np.array([0.5, 48.25])), [-5.5, 137.75], rtol=1e-12
    )


@pytest.mark.parametrize(
    ("samples", "smoothing", "power"), [(2, 0.5, 1), (3, 0.5, 2), (4, 0.5, 3), (9, 1.0, 3)]
)
def test_interpolation_is_of_the_highest_order_up_to_a_cubic(samples, smoothing, power):
    spline = smoothing_spline(np.arange(float(samples)) ** power, smoothing)
    between = np.arange(samples - 1) + 0.5
    np.testing.assert_allclose(spline(between), between**power, rtol=1e-9)


def test_error_is_over_the_range_of_the_values():
    assert nrmse(np.array([5.0, 5.5]), np.array([5.05, 5.45])) == pytest.approx(0.1)  # equation 4.4
    assert nrmse(np.full(4, 7.0), np.full(4, 8.0)) == 0.0
