"""Every figure of a pulse, of shapes whose samples give it exactly."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.ingest.pulses import extract_pulses
from pyroshock.ingest.settings import ExtractionSettings

RATE = 1000.0
#: Up in 4 samples, down in 10.
TRIANGLE = np.concatenate([np.linspace(0, 100, 5), np.linspace(90, 0, 10)])
EXACT = ExtractionSettings(smoothing=1.0, points=15, refinement=10)


def record(shape: np.ndarray, before: int = 2000, after: int = 500) -> np.ndarray:
    return np.concatenate([np.zeros(before), shape, np.zeros(after)])


@pytest.mark.parametrize("sign", [1, -1])
def test_triangle_gives_its_own_figures(sign):
    (pulse,) = extract_pulses(sign * (record(TRIANGLE) + 30.0), RATE, EXACT, start_s=0.25)
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


def test_half_sine_between_its_samples():
    sine = 100 * np.sin(np.pi * np.arange(41) / 40)
    (pulse,) = extract_pulses(record(sine), RATE, EXACT)
    np.testing.assert_allclose(pulse.fine_force_n, 100 * np.sin(np.pi * np.arange(401) / 400), atol=0.7)
    assert pulse.compression_time_s == pytest.approx(20e-3)
    assert pulse.impulse_n_s == pytest.approx(2 / np.pi * 100 * 40e-3, rel=1e-3)
    assert pulse.compression_impulse_n_s == pytest.approx(pulse.impulse_n_s / 2, rel=1e-9)


def test_width_counts_from_the_end_of_a_record_to_where_a_flat_top_falls_and_without_shoulders():
    (late,) = extract_pulses(record(TRIANGLE[4:], before=0), RATE, EXACT)
    assert (late.width_half_s, late.width_tenth_s) == (pytest.approx(5e-3), pytest.approx(9e-3))
    assert (late.compression_time_s, late.compression_impulse_n_s) == (0.0, 0.0)
    (early,) = extract_pulses(record(TRIANGLE[:7], after=0), RATE, EXACT)
    assert (early.width_half_s, early.width_tenth_s) == (pytest.approx(4e-3), pytest.approx(5.6e-3))
    (flat,) = extract_pulses(record(np.full(6, 80.0)), RATE, EXACT)  # to where it falls
    assert flat.width_half_s == pytest.approx(6e-3)
    (shoulders,) = extract_pulses(record(np.array([0.0, 50, 50, 100, 50, 50, 0])), RATE, EXACT)  # are outside
    assert shoulders.width_half_s == pytest.approx(2e-3)


def test_sample_at_the_threshold_is_not_in_contact():
    (pulse,) = extract_pulses(record(TRIANGLE), RATE, ExtractionSettings(threshold=0.1))
    assert (pulse.contact.first, pulse.contact.last, pulse.samples_in_contact) == (2000, 2013, 12)


def test_compression_of_one_sample_is_a_triangle():
    coarse = ExtractionSettings(smoothing=1.0, refinement=1)
    (pulse,) = extract_pulses(record(np.array([0.0, 100, 50, 0])), RATE, coarse)
    assert pulse.compression_impulse_n_s == pytest.approx(0.05)


def test_two_samples_are_a_record():
    calm = ExtractionSettings(event_noise=0.0, threshold_noise=0.0)
    assert len(extract_pulses(np.array([0.0, 1.0]), RATE, calm)) == 1


def test_gap_beside_a_contact_counts_as_rest():
    holed = record(TRIANGLE)
    holed[[1998, 2016]] = np.nan
    (found,), (whole,) = extract_pulses(holed, RATE, EXACT), extract_pulses(record(TRIANGLE), RATE, EXACT)
    np.testing.assert_array_equal(found.fine_force_n, whole.fine_force_n)


def test_as_many_hits_as_expected_are_all_kept():
    hits = np.concatenate([record(TRIANGLE), record(TRIANGLE / 2), record(TRIANGLE / 4)])
    assert [pulse.peak_force_n for pulse in extract_pulses(hits, RATE, EXACT, expected=3)] == [100, 50, 25]
    assert [pulse.peak_force_n for pulse in extract_pulses(hits, RATE, EXACT, expected=2)] == [100, 50]


def test_hits_count_by_their_main_peak():
    twice = np.concatenate([TRIANGLE, np.zeros(20), TRIANGLE / 8])
    hits = np.concatenate([record(twice), record(TRIANGLE / 2)])
    (pulse,) = extract_pulses(hits, RATE, EXACT, expected=1)
    assert (pulse.peak_force_n, pulse.extra_hits) == (100, 1)
