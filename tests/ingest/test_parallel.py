"""Several processes work ahead: in order, bounded, and a process that dies takes only its own item with it."""

from __future__ import annotations

import os
import threading

import pytest
from pyroshock.ingest.parallel import Isolation, map_ahead


def square(x: int) -> int:
    return x * x


def dies_on_three(x: int) -> int:
    if x % 10 == 3:
        os._exit(139)
    return x * x


def raises_on_three(x: int) -> int:
    if x == 3:
        raise ValueError("three")
    return x


def hangs_on_three(x: int) -> int:
    if x == 3:
        threading.Event().wait()
    return x


def process_of(_: int) -> int:
    return os.getpid()


def lost(_: int) -> int:
    return -1


def patience(x: int) -> float:
    return 1.0 if x == 3 else 30.0


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
