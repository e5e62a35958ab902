"""Distances between configurations, and which levels of a factor set some apart."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.diagnosis.evidence.factors import each_level, smooth, squared_distances, varying


def between(*values: str | float) -> np.ndarray:
    return squared_distances([{"factor": value} for value in values])


@pytest.mark.parametrize(
    ("values", "first_to_second"),
    [
        ((1.0, 2.0, 3.0), 0.25),  # the greatest over the least is 3: in proportion
        ((1.0, 2.0, 3.1), (np.log(2) / np.log(3.1)) ** 2),  # beyond: in logarithms
        ((2.0, 4.0, 5.9), (2 / 3.9) ** 2),
        ((1.0, 10.0, 100.0), 0.25),
        ((0.0, 10.0, 100.0), 0.01),  # a logarithm of nothing
        ((-1.0, 1.0, 4.0), 0.16),
        (("steel", "delrin", "steel"), 1.0),
        ((1.0, "soft", 1.0), 1.0),
        ((2.0, 2.0, 2.0), 0.0),
    ],
)
def test_numbers_go_by_their_share_of_the_range_and_words_are_others(values, first_to_second):
    found = between(*values)
    assert found[0, 1] == found[1, 0] == pytest.approx(first_to_second, rel=1e-12)
    assert found[0, 0] == 0.0


def test_factors_add_up_and_what_is_not_told_is_a_word():
    rows = [{"mass": 1.0, "tip": "steel"}, {"mass": 2.0, "tip": "delrin"}, {"mass": 1.0}]
    np.testing.assert_array_equal(squared_distances(rows), [[0, 2, 1], [2, 0, 2], [1, 2, 0]])


def test_kernels_at_known_distances():
    distance = np.array([[0.0, 0.32], [0.32, 0.0]])
    assert varying(distance, 0.4) == pytest.approx(np.array([[1, np.exp(-1)], [np.exp(-1), 1]]))
    assert smooth(distance, 0.4) == pytest.approx((1 + varying(distance, 0.4)) / 2)


def test_a_level_has_two_configurations_at_least_and_leaves_two():
    def levels(*values: str) -> list[list[bool]]:
        return [each.tolist() for each in each_level([{"tip": value} for value in values])]

    assert levels("a", "a", "b", "b") == [[True, True, False, False], [False, False, True, True]]
    assert levels("a", "a", "b") == []
    assert levels("a", "b", "b", "b") == []
    assert levels("a", "a", "b", "b", "c") == [[True, True, False, False, False], [False, False, True, True, False]]


def test_the_same_configurations_are_one_level():
    rows = [{"tip": "a", "mass": 1.0}] * 2 + [{"tip": "b", "mass": 2.0}] * 2
    assert len(each_level(rows)) == 2
