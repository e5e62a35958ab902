"""Even times, however they are printed, give their rate; two rates, drift and jitter are told apart
and refused."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.ingest.readers.base import RecordingError
from pyroshock.ingest.readers.even_time import UnevenTimeError, even_time

SHOT = Path("shot.csv")
RATES = (3200.0, 20000.0, 44100.0, 51200.0, 102400.0, 1e6)
SAMPLE = np.arange(8192)

#: As programs write even times (s): the last digit, the float or the counter makes their steps
#: differ.
WRITTEN = {
    "exact": lambda t: (t, 1.0),
    "%.6f": lambda t: (np.round(t, 6), 1.0),
    "%.6g": lambda t: (np.array([float(f"{x:.6g}") for x in t]), 1.0),
    "%.5e": lambda t: (np.array([float(f"{x:.5e}") for x in t]), 1.0),
    "single": lambda t: (t.astype(np.float32).astype(np.float64), 1.0),
    "ms": lambda t: (np.round(t * 1e3, 4), 1e-3),
    "us": lambda t: (np.round(t * 1e6, 0), 1e-6),
    "min": lambda t: (np.round(t / 60, 8), 60.0),
    "from before the trigger": lambda t: (np.round(t - 0.02, 6), 1.0),
    "of day": lambda t: (np.round(43200 + t, 6), 1.0),
    "since 1970": lambda t: (np.round(1772452800 + t, 6), 1.0),
    "40 MHz counter": lambda t: (np.floor(t * 40e6 + 1e-6) / 40e6, 1.0),
}


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("form", WRITTEN)
def test_even_times_give_their_rate(rate, form):
    times, unit = WRITTEN[form](SAMPLE / rate)
    even = even_time(SHOT, times, unit)
    assert even.rate_hz == pytest.approx(rate, rel=2e-4 if form == "min" else 2e-5)
    assert even.gaps == []


@pytest.mark.parametrize("rate", [20000.0, 51200.0, 102400.0])
def test_times_printed_to_the_microsecond_give_the_rate(rate):
    """The median of these steps is 50, 20 and 10 us: 50 kHz for a record at 51.2 kHz, as an earlier
    version gave."""
    even = even_time(SHOT, np.round(SAMPLE / rate, 6))
    assert (even.rate_hz, even.start_s) == (rate, 0.0)


def test_old_counter_of_32768_hz():
    assert even_time(SHOT, np.floor(SAMPLE / 3200 * 32768) / 32768).rate_hz == pytest.approx(
        3200, rel=1e-4
    )


@given(missing=st.sets(st.integers(1, 998), max_size=20))
def test_missing_samples_do_not_change_the_rate_and_are_gaps(missing):
    even = even_time(SHOT, np.delete(np.arange(1000), sorted(missing)) / 51200)
    assert even.rate_hz == 51200
    assert sum(count for _, count in even.gaps) == len(missing)


def test_gap_of_a_second_write():
    times = np.r_[np.arange(1000), 25000 + np.arange(1000)] / 50000
    assert even_time(SHOT, times).gaps == [[1000, 24000]]


rng = np.random.default_rng(46)
UNEVEN = {
    "two rates, 40000 Hz .* and 58000 Hz": np.cumsum(np.where(SAMPLE < 1200, 1 / 40e3, 1 / 58e3)),
    "two rates, 50000 Hz .* and 51200 Hz": np.cumsum(np.where(SAMPLE < 6000, 1 / 50e3, 1 / 51.2e3)),
    "two rates, 100000 Hz .* and 10000 Hz": np.cumsum(np.where(SAMPLE < 3000, 1e-5, 1e-4)),
    "jitter: .* 23": np.cumsum(2e-5 * (1 + 0.4 * rng.uniform(-1, 1, SAMPLE.size))),
    "jitter: .* 1.7": np.cumsum(2e-5 * (1 + 0.03 * rng.uniform(-1, 1, SAMPLE.size))),
    "jitter": 2e-5 * (SAMPLE + 0.03 * rng.uniform(-1, 1, SAMPLE.size)),
    "drifts: .* 1.6[0-9e-]* to 2.4": np.cumsum(2e-5 * np.linspace(0.8, 1.2, SAMPLE.size)),
    "drifts: .* 1.98[0-9e-]* to 2.02": np.cumsum(2e-5 * np.linspace(1.01, 0.99, SAMPLE.size)),
    "drifts": np.cumsum(2e-5 * (1 + 0.03 * np.sin(SAMPLE / 500))),
    "drifts: ": np.geomspace(1, 1e4, 200),
}


@pytest.mark.parametrize("kind", UNEVEN)
def test_uneven_times_are_refused_by_their_kind(kind):
    with pytest.raises(
        UnevenTimeError, match=rf"shot\.csv: its time (has )?{kind}.*uneven_time = .resample"
    ):
        even_time(SHOT, UNEVEN[kind])


@pytest.mark.parametrize(
    "kind", [kind for kind in UNEVEN if "100000" not in kind and kind != "drifts: "]
)
def test_printed_digits_do_not_hide_it(kind):
    with pytest.raises(UnevenTimeError):
        even_time(SHOT, np.round(UNEVEN[kind], 7))


@pytest.mark.parametrize("share", [50e-6, 2e-3])
def test_clock_that_wanders_a_little_is_even(share):
    times = np.cumsum(2e-5 * np.linspace(1 - share / 2, 1 + share / 2, SAMPLE.size))
    assert even_time(SHOT, times).rate_hz == pytest.approx(50000, rel=share)


def test_blocks_whose_starts_are_counted_in_ticks_are_even():
    """As enDAQ and Slam Stick recorders write: 110 samples from the block's start, which is counted
    in 1/32768 s."""
    start = np.floor(np.arange(0, SAMPLE.size, 110) / 5000 * 32768) / 32768
    times = np.concatenate(
        [np.linspace(a, b, 110, endpoint=False) for a, b in itertools.pairwise(start)]
    )
    late = np.concatenate([a + np.arange(110) / 5000 for a in start])
    for written in (times, late):
        even = even_time(SHOT, np.round(written, 6))
        assert even.rate_hz == pytest.approx(5000, rel=1e-4)
        assert even.gaps == []


def test_any_rate_within_its_digits():
    assert even_time(SHOT, np.arange(1000) / 31415.926).rate_hz == pytest.approx(
        31415.926, rel=1e-6
    )


@pytest.mark.parametrize("samples", [0, 1])
def test_one_time_gives_no_rate(samples):
    with pytest.raises(RecordingError, match="at least two samples"):
        even_time(SHOT, np.zeros(samples))


def test_time_that_stands_or_falls_is_named():
    with pytest.raises(RecordingError, match=r"time does not increase at sample 2 \(t = 0.001 s\)"):
        even_time(SHOT, np.array([0.0, 1.0, 1.0, 2.0]), 1e-3)
