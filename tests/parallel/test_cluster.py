"""Work that is sent to a Dask cluster: two workers, each a process of its own."""

from __future__ import annotations

import os
import signal
import time

import numpy as np
import pytest
from pyroshock.parallel import cluster
from pyroshock.parallel.executor import HERE, ExecutorConfig
from pyroshock.parallel.map_tasks import run_all_tasks
from support.processes import chores
from support.processes.dask_clusters import dask_cluster


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    with dask_cluster(tmp_path_factory.mktemp("lab")) as running:
        yield ExecutorConfig("dask", scheduler=running.address)


def begun(folder) -> list[tuple[int, int]]:
    """(item, process) in the order in which they were begun."""
    text = (folder / "begun").read_text() if (folder / "begun").exists() else ""
    return [(int(item), int(pid)) for item, pid in map(str.split, text.splitlines())]


def test_results_are_those_of_this_process(lab):
    for function, shared in ((chores.scaled, (np.ones(300_000), 7)), (chores.product, ())):
        here, there = (
            sorted(run_all_tasks(executor, function, range(5), shared=shared))
            for executor in (HERE, lab)
        )
        assert here == there


def test_workers_of_the_cluster_do_it_with_one_thread(lab):
    assert os.getpid() not in {pid for _, pid in run_all_tasks(lab, chores.process, range(6))}
    assert {
        count for _, counts in run_all_tasks(lab, chores.threads, range(4)) for count in counts
    } == {1}


def test_items_arrive_as_they_are(lab):
    """Also those in which Dask would look for something to compute."""
    items = [(1, 2), {"a": (max, [1, 2])}, ["b", None], np.arange(500)]
    results = sorted(
        (repr(item), result) for item, result in run_all_tasks(lab, repr, items, window=3)
    )
    assert results == sorted((repr(item), repr(item)) for item in items)


def test_error_of_the_function_is_raised_here(lab):
    with pytest.raises(LookupError, match="no chore 0"):
        list(run_all_tasks(lab, chores.refused, [0]))


def test_iterator_that_is_closed_cancels_the_rest(lab, tmp_path):
    work = run_all_tasks(lab, chores.left_behind, range(20), shared=(tmp_path,))
    next(work)
    work.close()
    assert list(run_all_tasks(lab, chores.squared, [5])) == [
        (5, 25)
    ]  # when what was under way has ended
    assert len(list(tmp_path.glob("begun-*"))) <= 5


def test_work_of_a_worker_that_is_killed_goes_to_the_other(tmp_path):
    """Killed over an item that it holds, after others were finished; what is shared had been sent
    to it, too."""
    with dask_cluster(tmp_path) as running:
        work = run_all_tasks(
            ExecutorConfig("dask", scheduler=running.address),
            chores.held,
            range(12),
            shared=(tmp_path,),
        )
        found = [next(work), next(work)]
        holder = wait_for(lambda: [pid for item, pid in begun(tmp_path) if item == 3])
        os.kill(holder, signal.SIGKILL)
        (tmp_path / "released").touch()
        found += work
    assert sorted(found) == [(n, n * n) for n in range(12)]
    processes = [pid for item, pid in begun(tmp_path) if item == 3]
    assert processes[0] == holder
    assert processes[1:] == [pid for pid in {one.pid for one in running.workers} if pid != holder]


def wait_for(found) -> int:
    until = time.monotonic() + 60
    while time.monotonic() < until:
        if pids := found():
            return pids[0]
        time.sleep(0.02)
    raise TimeoutError("nothing was begun")


@pytest.mark.slow
def test_item_that_kills_its_workers_costs_no_other(tmp_path):
    """Nannies start workers anew, Dask gives up after four; alone it is tried once more."""
    with dask_cluster(tmp_path, 2, "--nanny") as running:
        executor = ExecutorConfig("dask", scheduler=running.address)
        results = dict(
            run_all_tasks(executor, chores.deadly, range(8), lost=lambda number: -number)
        )
        assert results == {n: -3 if n == 3 else n for n in range(8)}
        ended = dict(
            run_all_tasks(
                executor, chores.endless, range(2, 5), lost=lambda number: -number, patience_s=1
            )
        )
        assert ended == {2: 2, 3: -3, 4: 4}


@pytest.mark.slow
def test_one_worker_works_and_not_this_process(tmp_path):
    """joblib takes a cluster of one thread for none."""
    with dask_cluster(tmp_path, 1) as running:
        results = {
            pid
            for _, pid in run_all_tasks(
                ExecutorConfig("dask", scheduler=running.address), chores.process, range(3)
            )
        }
        assert results == {running.workers[0].pid}


@pytest.mark.slow
def test_scheduler_that_is_gone_is_named(tmp_path):
    with dask_cluster(tmp_path) as running:
        work = run_all_tasks(
            ExecutorConfig("dask", scheduler=running.address),
            chores.held,
            range(12),
            shared=(tmp_path,),
        )
        next(work)
        running.scheduler.kill()
        with pytest.raises(ValueError, match=f"the Dask scheduler at {running.address} is gone"):
            list(work)


@pytest.mark.slow
def test_cluster_without_workers_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "WAIT_S", 1)
    with (
        dask_cluster(tmp_path, 0) as running,
        pytest.raises(
            ValueError, match=f"has no worker; start some: dask worker {running.address}"
        ),
    ):
        ExecutorConfig("dask", scheduler=running.address).check()
