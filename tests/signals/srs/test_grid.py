from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.signals.srs.spectrum import grid_of_record, octave_grid


@given(st.floats(1, 1e3), st.floats(0, 12), st.integers(1, 24))
def test_ends_are_lines_and_steps_are_equal(low, octaves, per_octave):
    high = low * 2**octaves
    lines = octave_grid(low, high, per_octave)
    ratios = lines[1:] / lines[:-1]
    assert (lines[0], lines[-1]) == pytest.approx((low, high), rel=1e-9)
    assert ratios[:-1] == pytest.approx(2 ** (1 / per_octave), rel=1e-12)
    assert np.all(ratios > 1) and np.all(ratios <= 2 ** (1 / per_octave) * (1 + 1e-8))


def test_octaves_of_six():
    assert octave_grid(100.0, 400.0) == pytest.approx(100 * 2 ** (np.arange(13) / 6))
    assert octave_grid(100.0, 10_000.0).size == 41


def test_one_line():
    assert octave_grid(50.0, 50.0).tolist() == [50.0]


def test_record_gives_a_cycle_to_its_length():
    lines = grid_of_record(2000, 1e5, per_octave=1)
    assert (lines[0], lines[-1]) == pytest.approx((50.0, 1e4))


def test_ten_samples_are_enough_for_one_line():
    assert grid_of_record(10, 1e4).tolist() == [1e3]
    with pytest.raises(ValueError, match="9 samples"):
        grid_of_record(9, 1e4)


@pytest.mark.parametrize(
    ("low", "high", "per_octave"), [(0, 1, 6), (2, 1, 6), (1, np.inf, 6), (np.nan, 2, 6), (1, 2, 0)]
)
def test_refuses_what_is_no_range(low, high, per_octave):
    with pytest.raises(ValueError, match="expected"):
        octave_grid(low, high, per_octave)
