"""What holds for the spectrum of any record, its lines and its threads."""

from __future__ import annotations

import threading
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pyroshock.signals.srs.spectrum import (
    grid_of_record,
    octave_grid,
    oscillator_response,
    shock_response_spectrum,
)
from pyroshock.signals.srs.threads import checked_threads, over_threads, processors

RATE = 1e4
LINES = np.geomspace(20, 4000, 11)
PEAKS = ("maximax", "positive", "negative", "primary", "residual", "pseudo_velocity_m_s")

few = settings(max_examples=25)
dampings = st.floats(0.005, 0.5)
numbers = st.floats(-1, 1).map(lambda x: round(x, 6))
records = arrays(np.float64, st.integers(2, 60), elements=numbers).filter(
    lambda x: np.ptp(x) > 0.01
)


def spectrum(record, zeta, lines=LINES, **options):
    """Of the straight lines between the samples, unless a test asks for more."""
    return shock_response_spectrum(
        record, RATE, lines, damping_ratio=zeta, **{"resample_within": None, **options}
    )


def close(values, rel=1e-9):
    return pytest.approx(values, rel=rel, abs=1e-12)


@given(records, dampings, st.floats(0.1, 1e4), st.integers(1, 50), st.integers(1, 200))
@few
def test_spectrum_of_a_scaled_turned_later_or_longer_record(record, zeta, factor, before, after):
    """It grows with the record; the other sign swaps positive and negative; waiting changes
    nothing. Zeros at the end move peaks from after the record, where they are exact, into it, where
    they lie beside samples."""
    one, more = spectrum(record, zeta), spectrum(factor * record, zeta)
    late = spectrum(np.append(np.zeros(before), record), zeta)
    for name in PEAKS:
        assert getattr(more, name) / factor == close(getattr(one, name))
        assert getattr(late, name) == close(getattr(one, name))
    assert np.array_equal(one.maximax, np.maximum(one.positive, one.negative))
    assert np.array_equal(one.maximax, np.maximum(one.primary, one.residual))
    other = spectrum(-record, zeta)
    assert other.positive == close(one.negative)
    assert other.negative == close(one.positive)
    assert other.pseudo_velocity_m_s == close(one.pseudo_velocity_m_s)
    assert other.maximax == close(one.maximax)
    longer = spectrum(np.append(record, np.zeros(after)), zeta)
    assert np.all(longer.maximax <= one.maximax * (1 + 1e-9) + 1e-12)
    assert np.all(longer.residual <= one.residual * (1 + 1e-9) + 1e-12)


@given(records, records, dampings)
@few
def test_a_sum_is_no_more_than_its_parts(first, second, zeta):
    n = min(first.size, second.size)
    total = first[:n] + second[:n] + np.append(0.001, np.zeros(n - 1))  # not constant
    parts = [spectrum(np.append(part[:n], 0.5), zeta) for part in (first, second)]
    parts.append(spectrum(np.append(0.001, np.zeros(n)), zeta))
    whole = spectrum(np.append(total, 1.0), zeta)
    for name in PEAKS:
        assert np.all(
            getattr(whole, name) <= sum(getattr(part, name) for part in parts) * (1 + 1e-9) + 1e-12
        )


@given(records)
@few
def test_time_runs_backwards_for_undamped_residuals(record):
    one, back = spectrum(record, 1e-12), spectrum(record[::-1], 1e-12)
    assert back.residual == close(one.residual, rel=1e-7)


@given(records, dampings)
@few
def test_primary_and_residual_are_of_the_series_of_the_oscillator(record, zeta):
    """The residual is of the series after the record: one step to 0, then a decay whose peaks 2,000
    zeros show at samples."""
    both_parts = spectrum(record, zeta)
    series = [oscillator_response(record, RATE, line, damping_ratio=zeta) for line in LINES]
    assert both_parts.primary == close(
        [np.abs(oscillator.absolute_acceleration_m_s2).max() for oscillator in series]
    )
    for line, residual in zip(LINES[LINES < RATE / 20], both_parts.residual, strict=False):
        longer = oscillator_response(
            np.append(record, np.zeros(2000)), RATE, line, damping_ratio=zeta
        )
        later = np.abs(longer.absolute_acceleration_m_s2[record.size :]).max()
        assert later <= residual * (1 + 1e-9)
        assert (
            later
            >= residual * np.cos(np.pi * line / RATE) * np.exp(-np.pi * zeta * line / RATE) - 1e-12
        )


@pytest.mark.parametrize("shape", [(100,), (3, 100), (2, 3, 100)])
def test_many_records_are_each_on_its_own(shape):
    record = np.random.default_rng(1).normal(size=shape)
    many, first = spectrum(record, 0.05, resample_within=0.05), (0,) * (len(shape) - 1)
    assert many.maximax.shape == (*shape[:-1], LINES.size)
    alone = spectrum(record[first], 0.05, resample_within=0.05)
    for name in PEAKS:
        assert getattr(many, name)[first] == close(getattr(alone, name))
    own_lines, lines = (
        shock_response_spectrum(part, RATE).frequency_hz for part in (record, record[first])
    )
    np.testing.assert_array_equal(own_lines, lines)


@pytest.mark.parametrize("count", [1, 7, 8, 9, 41])
@pytest.mark.parametrize("threads", [1, 2, 5])
def test_threads_and_other_lines_change_nothing(count, threads):
    record = np.random.default_rng(2).normal(size=(3, 50_000))
    lines = np.linspace(50, 3000, 41)
    every = spectrum(record, 0.05, lines, threads=1)
    some = spectrum(record, 0.05, lines[-count:], threads=threads)
    assert np.array_equal(some.maximax, every.maximax[:, -count:])
    assert np.array_equal(some.residual, every.residual[:, -count:])


def test_no_shock_has_no_response_and_a_decay_ends_at_0():
    """States that fade below 1e-308 are held up by what no sample notices."""
    nothing = spectrum(np.zeros((2, 50)), 0.05)
    assert not any(np.any(getattr(nothing, name)) for name in PEAKS)
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
    assert all(
        np.all(np.isfinite(getattr(one, each.name)))
        for each in fields(one)
        if each.name != "sampling"
    )


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
        (
            [0.0, 1.0],
            {"frequency_hz": [100.0], "q": 10, "damping_ratio": 0.05},
            "expected one of them",
        ),
        ([0.0, 1.0], {"frequency_hz": [100.0], "resample_within": 0.0}, "resample_within = 0.0"),
        ([0.0, 1.0], {"frequency_hz": [100.0], "threads": 0}, "threads = 0"),
    ],
)
def test_refuses_what_has_no_spectrum(acceleration, options, what):
    with pytest.raises(ValueError, match=what):
        shock_response_spectrum(np.array(acceleration), RATE, **options)


def test_refuses_what_is_no_range_and_a_rate_that_is_none():
    for low, high, per_octave in ((0, 1, 6), (2, 1, 6), (1, np.inf, 6), (np.nan, 2, 6), (1, 2, 0)):
        with pytest.raises(ValueError, match="expected"):
            octave_grid(low, high, per_octave)
    for rate in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match="sampling_rate_hz"):
            shock_response_spectrum(np.array([0.0, 1.0]), rate, [1.0])


@given(st.floats(1, 1e3), st.floats(0, 12), st.integers(1, 24))
def test_ends_are_lines_and_steps_are_equal(low, octaves, per_octave):
    high = low * 2**octaves
    lines = octave_grid(low, high, per_octave)
    ratios = lines[1:] / lines[:-1]
    assert (lines[0], lines[-1]) == pytest.approx((low, high), rel=1e-9)
    assert ratios[:-1] == pytest.approx(2 ** (1 / per_octave), rel=1e-12)
    assert np.all(ratios > 1) and np.all(ratios <= 2 ** (1 / per_octave) * (1 + 1e-8))


def test_lines_of_octaves_and_of_a_record():
    """A record gives a cycle to its length; ten samples are enough for a line."""
    assert octave_grid(100.0, 400.0) == pytest.approx(100 * 2 ** (np.arange(13) / 6))
    assert octave_grid(100.0, 10_000.0).size == 41
    assert octave_grid(50.0, 50.0).tolist() == [50.0]
    lines = grid_of_record(2000, 1e5, per_octave=1)
    assert (lines[0], lines[-1]) == pytest.approx((50.0, 1e4))
    assert grid_of_record(10, 1e4).tolist() == [1e3]
    with pytest.raises(ValueError, match="9 samples"):
        grid_of_record(9, 1e4)


@pytest.mark.parametrize("threads", [1, 2, 3])
@pytest.mark.parametrize("tasks", [1, 2, 7, 100])
def test_every_task_is_done_once(tasks, threads):
    done, lock = list[int](), threading.Lock()

    def run(start, stop):
        with lock:
            done.extend(range(start, stop))

    over_threads(run, tasks, threads)
    assert sorted(done) == list(range(tasks))


def test_a_busy_pool_is_not_waited_for():
    """The other thread is held until the caller has done all that is left."""
    held, begun, by = threading.Event(), threading.Event(), {}

    def run(start, stop):
        by[start] = threading.current_thread()
        if by[start] is not threading.main_thread():
            begun.set()
            held.wait(10)
        elif start <= 1:  # the last that is left to the caller
            held.set()
        else:
            begun.wait(10)

    over_threads(run, 8, 2)
    assert len(by) == 8
    assert sum(thread is not threading.main_thread() for thread in by.values()) == 1


def test_errors_reach_the_caller_and_threads_are_as_many_as_processors():
    def run(start, stop):
        if start <= 3 < stop:
            raise ArithmeticError("task 3")

    with pytest.raises(ArithmeticError, match="task 3"):
        over_threads(run, 8, 2)
    assert checked_threads(None) == processors() >= 1
    with pytest.raises(ValueError, match="threads = 0"):
        checked_threads(0)
