"""Sampling rates recovered from steps and times that were printed with few digits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.ingest.readers.base import RecordingError, rate_from_step, rate_from_times

PATH = Path("shot.csv")
RATES = [10000.0, 12800.0, 20000.0, 44100.0, 48000.0, 51200.0, 65536.0, 102400.0, 204800.0, 1e6]


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("digits", [5, 6, 9])
def test_a_printed_step_gives_the_round_rate(rate, digits):
    step = float(f"{1 / rate:.{digits}e}")
    assert rate_from_step(step, 5.1 * 10.0 ** -(digits + 1)) == rate


@given(rate=st.floats(1.0, 1e7))
def test_a_rate_stays_within_what_its_step_leaves_open(rate):
    assert rate_from_step(1 / rate, 1e-6) == pytest.approx(rate, rel=1.0001e-6)


@pytest.mark.parametrize("rate", [20000.0, 51200.0, 102400.0])
def test_times_printed_to_the_microsecond_give_the_rate(rate):
    """The median of these steps is 50, 20 and 10 us: 50 kHz for a record at 51.2 kHz, as an earlier version gave."""
    times = np.round(np.arange(8192) / rate, 6)
    assert rate_from_times(PATH, times) == (rate, 0.0)


@given(missing=st.sets(st.integers(1, 998), max_size=20))
def test_missing_samples_do_not_change_the_rate(missing):
    times = np.delete(np.arange(1000), sorted(missing)) / 51200
    assert rate_from_times(PATH, times)[0] == 51200


def test_single_precision_times_give_the_rate_and_one_that_is_not_round_is_kept():
    times = (np.arange(8192) / 51200).astype(np.float32).astype(np.float64)
    assert rate_from_times(PATH, times)[0] == 51200
    assert rate_from_times(PATH, np.arange(1000) / 31415.926)[0] == pytest.approx(31415.926, rel=1e-6)


def test_uneven_times_and_one_time_are_refused():
    with pytest.raises(RecordingError, match="expected evenly spaced time"):
        rate_from_times(PATH, np.geomspace(1, 1e4, 200))
    for times in ([], [0.0]):
        with pytest.raises(RecordingError, match="at least two samples"):
            rate_from_times(PATH, np.array(times))
