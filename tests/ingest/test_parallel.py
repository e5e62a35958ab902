"""Several processes work ahead: in order, bounded, and a process that dies takes only its own item with it."""

from __future__ import annotations

import os

import pytest
from pyroshock.parallel.read_ahead import Isolation, map_ahead
from support.processes.work_items import (
    dies_and_leaves_a_mark,
    dies_on_three,
    hangs_on_three,
    lost,
    patience,
    process_of,
    raises_on_three,
    square,
    walks_in_circles_on_three,
)

ISOLATION = Isolation(lost, patience)
ALWAYS = Isolation(lost, patience, always=True)


@pytest.mark.parametrize("jobs", [1, 2, 3])
@pytest.mark.parametrize("count", [0, 1, 2, 20])
def test_results_come_in_order(jobs, count):
    assert list(map_ahead(square, range(count), jobs, ISOLATION)) == [(i, i * i) for i in range(count)]


def test_dead_process_takes_only_its_own_item():
    results = list(map_ahead(dies_on_three, range(25), 2, ISOLATION))
    assert results == [(i, -1 if i % 10 == 3 else i * i) for i in range(25)]


def test_error_of_the_function_is_the_callers():
    with pytest.raises(ValueError, match="three"):
        list(map_ahead(raises_on_three, range(10), 2, ISOLATION))


@pytest.mark.parametrize("count", [0, 1, 5])
def test_always_isolated_runs_nothing_here(count):
    results = list(map_ahead(process_of, range(count), 1, ALWAYS))
    assert [item for item, _ in results] == list(range(count))
    assert os.getpid() not in [process for _, process in results]


def test_dead_process_of_one_job_takes_only_its_own_item():
    assert list(map_ahead(dies_on_three, range(5), 1, ALWAYS)) == [(i, -1 if i == 3 else i * i) for i in range(5)]


def test_item_that_never_ends_is_given_up():
    assert list(map_ahead(hangs_on_three, range(5), 1, ALWAYS)) == [(i, -1 if i == 3 else i) for i in range(5)]


def test_call_without_end_is_ended_by_its_processor_time():
    never = Isolation(lost, lambda _: 60.0, always=True)
    results = list(map_ahead(walks_in_circles_on_three, range(5), 1, never))
    assert results == [(i, -1 if i == 3 else i) for i in range(5)]


def test_item_that_kills_the_only_process_is_not_tried_again(tmp_path):
    """It was the first of those under way: a second try would take as long to fail."""
    list(map_ahead(dies_and_leaves_a_mark, [tmp_path / "a", tmp_path / "b"], 1, Isolation(lost, patience, always=True)))
    assert [(tmp_path / name).read_text() for name in "ab"] == ["x", "x"]
