"""A figure says which way it is promised, whether the promise holds, and where ours is behind."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import pytest
from pyroshock.benchmarks.figures import Figure, missing
from pyroshock.benchmarks.measuring import Spread, interleaved, ratio

FASTER = Figure("series", "reading", "1 ms", "4 ms", Spread(4.0, 2.0, 5.0), "at least", 3.0)
SLOWER = Figure("plans", "time", "3 s", "2 s", Spread(1.5, 1.25, 1.75))


def test_ratio_is_repeat_by_repeat():
    assert ratio([1.0, 4.0, 9.0], [2.0, 2.0, 3.0]) == Spread(2.0, 0.5, 3.0)


def test_ways_take_turns_after_one_call_that_does_not_count():
    said: list[str] = []
    taken = interleaved({name: partial(said.append, name) for name in "ab"}, 2)
    assert said == ["a", "b", "a", "b", "a", "b"]
    assert {name: len(seconds) for name, seconds in taken.items()} == {"a": 2, "b": 2}


def test_inverse_swaps_least_and_largest():
    assert Spread(4.0, 2.0, 5.0).inverse() == Spread(0.25, 0.2, 0.5)
    assert Spread(0.0, 0.0, 1.0).inverse() == Spread(float("inf"), 1.0, float("inf"))


def test_a_promise_of_at_least_is_shown_the_other_way_round():
    assert FASTER.over == Spread(0.25, 0.2, 0.5)
    assert FASTER.promise == "at most 0.333: holds"
    assert replace(FASTER, limit=4.5).promise == "at most 0.222: **lost**"


@pytest.mark.parametrize(("limit", "holds"), [(None, True), (1.5, True), (1.4, False)])
def test_promise_is_of_the_median(limit, holds):
    assert replace(SLOWER, limit=limit).holds is holds


def test_slower_is_said_in_bold():
    assert SLOWER.ratio == "1.5 (1.25 to 1.75) **slower**"
    assert replace(SLOWER, value=Spread(1.1, 0.9, 1.2)).ratio == "1.1 (0.9 to 1.2) **slower**, within the spread"
    assert replace(SLOWER, of="quality").behind == "worse"
    assert FASTER.behind == ""


@pytest.mark.parametrize("of", ["growth", "bound"])
def test_without_a_peer_nobody_is_behind(of):
    assert replace(SLOWER, of=of).behind == ""


def test_missing_peer_has_a_row_and_breaks_no_promise():
    gone = missing("spectra", "endaq", "not installed")
    assert gone.row() == "| endaq | — | not installed | — | — | — | — |"
    assert gone.holds


def test_promise_that_was_not_measured_is_lost():
    assert not Figure("spectra", "x", "failed", "—", None, limit=1.0).holds
