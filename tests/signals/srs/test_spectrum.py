"""What holds for the spectrum of any record."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pyroshock.signals.srs.spectrum import oscillator_response, sampling_error, shock_response_spectrum

RATE = 1e4
LINES = np.geomspace(20, 4000, 11)
PEAKS = ("maximax", "positive", "negative", "primary", "residual", "pseudo_velocity_m_s")

few = settings(max_examples=25)
dampings = st.floats(0.005, 0.5)
numbers = st.floats(-1, 1).map(lambda x: round(x, 6))
records = arrays(np.float64, st.integers(2, 60), elements=numbers).filter(lambda x: np.ptp(x) > 0.01)


def spectrum(record, zeta, lines=LINES, **options):
    return shock_response_spectrum(record, RATE, lines, damping_ratio=zeta, **options)


def close(values, rel=1e-9):
    return pytest.approx(values, rel=rel, abs=1e-12)


@given(records, dampings, st.floats(0.1, 1e4))
@few
def test_grows_with_the_record(record, zeta, factor):
    one, more = spectrum(record, zeta), spectrum(factor * record, zeta)
    for name in PEAKS:
        assert getattr(more, name) / factor == close(getattr(one, name))


@given(records, dampings)
@few
def test_other_sign_swaps_positive_and_negative(record, zeta):
    one, other = spectrum(record, zeta), spectrum(-record, zeta)
    assert other.positive == close(one.negative)
    assert other.negative == close(one.positive)
    assert other.pseudo_velocity_m_s == close(one.pseudo_velocity_m_s)
    assert other.maximax == close(one.maximax)


@given(records, dampings, st.integers(1, 50))
@few
def test_waiting_changes_nothing(record, zeta, samples):
    one, late = spectrum(record, zeta), spectrum(np.append(np.zeros(samples), record), zeta)
    for name in PEAKS:
        assert getattr(late, name) == close(getattr(one, name))


@given(records, dampings, st.integers(1, 200))
@few
def test_a_longer_record_of_the_same_finds_less_by_the_sampling_error_at_most(record, zeta, samples):
    """Zeros at the end move peaks from after the record, where they are exact, into it."""
    one, longer = spectrum(record, zeta), spectrum(np.append(record, np.zeros(samples)), zeta)
    assert np.all(longer.maximax <= one.maximax * (1 + 1e-9) + 1e-12)
    assert np.all(longer.residual <= one.residual * (1 + 1e-9) + 1e-12)


@given(records, dampings)
@few
def test_maximax_is_the_largest_of_all(record, zeta):
    one = spectrum(record, zeta)
    assert np.array_equal(one.maximax, np.maximum(one.positive, one.negative))
    assert np.array_equal(one.maximax, np.maximum(one.primary, one.residual))


@given(records, records, dampings)
@few
def test_a_sum_is_no_more_than_its_parts(first, second, zeta):
    n = min(first.size, second.size)
    total = first[:n] + second[:n] + np.append(0.001, np.zeros(n - 1))  # not constant
    parts = [spectrum(np.append(part[:n], 0.5), zeta) for part in (first, second)]
    parts.append(spectrum(np.append(0.001, np.zeros(n)), zeta))
    whole = spectrum(np.append(total, 1.0), zeta)
    for name in PEAKS:
        assert np.all(getattr(whole, name) <= sum(getattr(part, name) for part in parts) * (1 + 1e-9) + 1e-12)


@given(records)
@few
def test_time_runs_backwards_for_undamped_residuals(record):
    one, back = spectrum(record, 1e-12), spectrum(record[::-1], 1e-12)
    assert back.residual == close(one.residual, rel=1e-7)


@given(records, dampings)
@few
def test_primary_is_of_the_series_of_the_oscillator(record, zeta):
    one = spectrum(record, zeta)
    series = [oscillator_response(record, RATE, line, damping_ratio=zeta) for line in LINES]
    highest = [np.abs(each.absolute_acceleration_m_s2).max() for each in series]
    assert one.primary == close(highest)


@given(records, dampings)
@few
def test_residual_is_of_the_series_after_the_record(record, zeta):
    """One step to 0, then a decay whose peaks 2,000 zeros show at samples."""
    lines = LINES[LINES < RATE / 20]
    one = spectrum(record, zeta, lines)
    for i, line in enumerate(lines):
        series = oscillator_response(np.append(record, np.zeros(2000)), RATE, line, damping_ratio=zeta)
        later = np.abs(series.absolute_acceleration_m_s2[record.size :]).max()
        assert later <= one.residual[i] * (1 + 1e-9)
        assert later >= one.residual[i] * np.cos(np.pi * line / RATE) * np.exp(-np.pi * zeta * line / RATE) - 1e-12


def test_lines_of_many_records_are_those_of_their_length():
    record = np.random.default_rng(2).normal(size=(2, 30, 240))
    many, alone = shock_response_spectrum(record, 1e4), shock_response_spectrum(record[0, 0], 1e4)
    np.testing.assert_array_equal(many.frequency_hz, alone.frequency_hz)
    assert many.maximax.shape == (2, 30, alone.frequency_hz.size)


@pytest.mark.parametrize("shape", [(100,), (3, 100), (2, 3, 100)])
def test_many_records_are_each_on_its_own(shape):
    record = np.random.default_rng(1).normal(size=shape)
    many = spectrum(record, 0.05, resample=10.0)
    assert many.maximax.shape == (*shape[:-1], LINES.size)
    alone = spectrum(record[(0,) * (len(shape) - 1)], 0.05, resample=10.0)
    for name in PEAKS:
        assert getattr(many, name)[(0,) * (len(shape) - 1)] == close(getattr(alone, name))


@pytest.mark.parametrize("count", [1, 7, 8, 9, 41])
@pytest.mark.parametrize("threads", [1, 2, 5])
def test_threads_and_other_lines_change_nothing(count, threads):
    record = np.random.default_rng(2).normal(size=(3, 50_000))
    lines = np.linspace(50, 3000, 41)
    every = spectrum(record, 0.05, lines, threads=1)
    some = spectrum(record, 0.05, lines[-count:], threads=threads)
    assert np.array_equal(some.maximax, every.maximax[:, -count:])
    assert np.array_equal(some.residual, every.residual[:, -count:])


def test_no_shock_has_no_response():
    nothing = spectrum(np.zeros((2, 50)), 0.05)
    for name in PEAKS:
        assert not np.any(getattr(nothing, name))


def test_a_decay_to_nothing_is_0_at_its_end():
    """States that fade below 1e-308 are held up by what no sample notices."""
    click = np.append(1.0, np.zeros(60_000))
    one = spectrum(click, 0.5)
    assert np.all(one.residual < 1e-150)
    assert one.primary == close(spectrum(click[:3000], 0.5).primary)


def test_defaults_are_q_10_and_six_lines_to_an_octave():
    record = np.random.default_rng(3).normal(size=1000)
    one = shock_response_spectrum(record, RATE)
    assert one.q == pytest.approx(10)
    assert one.frequency_hz[0] == pytest.approx(1 / 0.1)
    assert one.frequency_hz[-1] == pytest.approx(RATE / 10)
    assert one.frequency_hz[6] / one.frequency_hz[0] == pytest.approx(2)
    assert all(np.all(np.isfinite(getattr(one, each.name))) for each in fields(one))


def test_sampling_error_at_ten_samples_a_cycle():
    """The parts, 4.89 % and 3.24 %, are those pyyeti's documentation adds up to 8.14 %."""
    assert sampling_error(np.array([1.0]), 10.0) == pytest.approx([1 - (1 - 0.048943) * (1 - 0.032466)], abs=1e-5)


def ringing(share, phase, times):
    """At `share` of the coarse rate under a bell, so with a narrow band; `times` as many samples."""
    t = np.arange(0, 600 * times + 1) / times
    return np.exp(-(((t - 300) / 60) ** 2) / 2) * np.cos(2 * np.pi * (share * t + phase))


@given(st.floats(0.05, 0.4), st.floats(0, 1))
@few
def test_a_ringing_loses_no_more_than_the_sampling_error(share, phase):
    line = [share * RATE]
    found = shock_response_spectrum(ringing(share, phase, 1), RATE, line)
    truth = shock_response_spectrum(ringing(share, phase, 128), 128 * RATE, line)
    assert found.maximax[0] <= truth.maximax[0] * (1 + 1e-4)
    assert found.maximax[0] >= truth.maximax[0] * (1 - found.sampling_error[0])


@pytest.mark.parametrize(
    ("acceleration", "options", "what"),
    [
        ([], {}, "shape"),
        (3.0, {}, "shape"),
        ([0.0, np.nan, 1.0], {}, "1 samples that are no numbers, the first at 1"),
        ([0.0, 2.0, np.inf], {}, "the first at 2"),
        ([4.0, 4.0, 4.0], {}, "constant at 4"),
        ([[1.0, 2.0], [5.0, 5.0]], {}, "constant at 5"),
        ([0.0, 1.0], {"frequency_hz": [100.0, 5000.0]}, "below 5000.*record faster"),
        ([0.0, 1.0], {"frequency_hz": []}, "at least one"),
        ([0.0, 1.0], {"frequency_hz": [0.0]}, "positive"),
        ([0.0, 1.0], {"frequency_hz": [np.nan]}, "positive"),
        ([0.0, 1.0], {}, "2 samples: expected 10 or more"),
        ([0.0, 1.0], {"frequency_hz": [100.0], "q": 0.5}, "q = 0.5"),
        ([0.0, 1.0], {"frequency_hz": [100.0], "damping_ratio": 1.0}, "damping_ratio = 1.0"),
        ([0.0, 1.0], {"frequency_hz": [100.0], "damping_ratio": 0.0}, "damping_ratio = 0.0"),
        ([0.0, 1.0], {"frequency_hz": [100.0], "q": 10, "damping_ratio": 0.05}, "expected one of them"),
        ([0.0, 1.0], {"frequency_hz": [100.0], "resample": 0.0}, "resample = 0.0"),
        ([0.0, 1.0], {"frequency_hz": [100.0], "threads": 0}, "threads = 0"),
    ],
)
def test_refuses_what_has_no_spectrum(acceleration, options, what):
    with pytest.raises(ValueError, match=what):
        shock_response_spectrum(np.array(acceleration), RATE, **options)


@pytest.mark.parametrize("rate", [0.0, -1.0, np.nan, np.inf])
def test_refuses_a_rate_that_is_none(rate):
    with pytest.raises(ValueError, match="sampling_rate_hz"):
        shock_response_spectrum(np.array([0.0, 1.0]), rate, [1.0])
