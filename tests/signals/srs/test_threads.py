from __future__ import annotations

import threading

import pytest
from pyroshock.signals.srs.threads import checked_threads, over_threads, processors


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


def test_errors_reach_the_caller():
    def run(start, stop):
        if start <= 3 < stop:
            raise ArithmeticError("task 3")

    with pytest.raises(ArithmeticError, match="task 3"):
        over_threads(run, 8, 2)


def test_as_many_threads_as_processors():
    assert checked_threads(None) == processors() >= 1
    with pytest.raises(ValueError, match="threads = 0"):
        checked_threads(0)
