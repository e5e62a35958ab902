"""Several processes work ahead: in order, bounded, and a process that dies takes only its own item with it."""

from __future__ import annotations

import os

import pytest
from pyroshock.ingest.parallel import map_ahead


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


def lost(_: int) -> int:
    return -1


@pytest.mark.parametrize("jobs", [1, 2, 3])
@pytest.mark.parametrize("count", [0, 1, 2, 20])
def test_results_come_in_order(jobs, count):
    assert list(map_ahead(square, range(count), jobs, lost)) == [(i, i * i) for i in range(count)]


def test_dead_process_takes_only_its_own_item():
    results = list(map_ahead(dies_on_three, range(25), 2, lost))
    assert results == [(i, -1 if i % 10 == 3 else i * i) for i in range(25)]


def test_error_of_the_function_is_the_callers():
    with pytest.raises(ValueError, match="three"):
        list(map_ahead(raises_on_three, range(10), 2, lost))
