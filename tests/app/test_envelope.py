"""What a screen shows of a series: every peak, in order, in at most so many points."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pyroshock.app.impacts.signals import FEWEST_POINTS, bucket_length, envelope

NUMBERS = st.one_of(
    arrays(np.float64, st.integers(1, 400), elements=st.floats(-1e6, 1e6)),
    arrays(np.int16, st.integers(1, 400)),
    arrays(np.float32, st.integers(1, 400), elements=st.sampled_from([0.0, 1.0, -1.0, 2.5])),
)
POINTS = st.integers(FEWEST_POINTS, 80)


@given(NUMBERS, POINTS)
@settings(max_examples=200)
def test_every_bucket_keeps_its_extremes(values, points):
    kept, length = envelope(values, points), bucket_length(values.size, points)
    for start in range(0, values.size, length):
        mine = kept[(kept >= start) & (kept < start + length)]
        bucket = values[start : start + length]
        assert values[mine].min() == bucket.min()
        assert values[mine].max() == bucket.max()


@given(NUMBERS, POINTS)
@settings(max_examples=200)
def test_points_rise_are_few_and_hold_both_ends(values, points):
    kept = envelope(values, points)
    assert 0 < kept.size <= points
    assert (np.diff(kept) > 0).all()
    assert (kept[0], kept[-1]) == (0, values.size - 1)


@given(NUMBERS, st.integers(0, 200))
@settings(max_examples=50)
def test_what_fits_is_left_as_it_is(values, room):
    points = max(FEWEST_POINTS, values.size + room)
    np.testing.assert_array_equal(envelope(values, points), np.arange(values.size))


@given(st.integers(5, 5000), POINTS)
@settings(max_examples=100)
def test_a_single_spike_is_never_lost(samples, points):
    values = np.zeros(samples)
    spike = samples // 3
    values[spike] = 1.0
    assert spike in envelope(values, points)


def test_extremes_of_a_bucket_stand_in_order_of_time():
    falling_first = np.array([0.0, -5, 1, 9, 0, 0, 8, 0, -7, 0, 0, 0])
    np.testing.assert_array_equal(envelope(falling_first, 6), [0, 1, 3, 6, 8, 11])


def test_gap_keeps_the_extremes_of_what_is_there():
    values = np.zeros(1000)
    values[100:300], values[400], values[401] = np.nan, 3.0, -2.0
    kept = envelope(values, 50)
    assert {400, 401} <= set(kept.tolist())
    assert np.isnan(values[kept]).any()


def test_nothing_has_no_points():
    assert envelope(np.zeros(0), 10).size == 0


@pytest.mark.parametrize("points", [-1, 0, 3])
def test_too_few_points_are_refused(points):
    with pytest.raises(ValueError, match=f"points is {points}; expected 4 or more"):
        envelope(np.zeros(3), points)
