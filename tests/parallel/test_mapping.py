"""Work that is spread over processes of this machine: who may do it, in what order, and what a
death costs."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import psutil
import pytest
from pyroshock.ingest.readers.contents import end_this_process_when_stuck
from pyroshock.parallel import cluster
from pyroshock.parallel import executor as executor_module
from pyroshock.parallel.executor import HERE, ExecutorConfig
from pyroshock.parallel.map_tasks import run_all_tasks
from pyroshock.parallel.read_ahead import Isolation, map_ahead
from pyroshock.plugins import Plugin
from support.processes import chores

TWO = ExecutorConfig(jobs=2)
TESTS = Path(__file__).resolve().parent.parent


def gone_within(seconds: float, pids: list[int]) -> bool:
    until = time.monotonic() + seconds
    while time.monotonic() < until and any(map(psutil.pid_exists, pids)):
        time.sleep(0.05)
    return not any(map(psutil.pid_exists, pids))


@pytest.mark.parametrize("executor", [HERE, TWO], ids=["here", "two"])
def test_each_item_comes_with_its_result(executor):
    assert sorted(run_all_tasks(executor, chores.squared, range(9))) == [
        (n, n * n) for n in range(9)
    ]
    assert list(run_all_tasks(executor, chores.squared, [])) == []


@pytest.mark.parametrize("executor", [HERE, TWO], ids=["here", "two"])
def test_what_is_shared_reaches_every_call(executor):
    results = run_all_tasks(executor, chores.scaled, range(5), shared=(np.ones(200_000), 7))
    assert sorted(results) == [(n, n * 200_000 + 7.0) for n in range(5)]
    assert dict(run_all_tasks(executor, chores.scaled, [1], shared=(np.ones(2), 1))) == {
        1: 3.0
    }  # not what was shared before


def test_one_job_works_here_and_two_do_not():
    assert {pid for _, pid in run_all_tasks(HERE, chores.process, range(3))} == {os.getpid()}
    beside = {pid for _, pid in run_all_tasks(TWO, chores.process, range(6))}
    assert os.getpid() not in beside
    assert len(beside) == 2
    assert os.getpid() not in {
        pid for _, pid in run_all_tasks(HERE, chores.process, range(2), isolated=True)
    }


def test_workers_have_one_thread_and_the_same_bits():
    here, beside = (
        dict(run_all_tasks(executor, chores.product, range(3))) for executor in (HERE, TWO)
    )
    assert here == beside
    for executor in (HERE, TWO):
        assert {
            count
            for _, counts in run_all_tasks(executor, chores.threads, range(2))
            for count in counts
        } == {1}


def test_item_whose_process_dies_costs_no_other():
    results = dict(run_all_tasks(TWO, chores.deadly, range(8), lost=lambda number: -number))
    assert results == {n: -3 if n == 3 else n for n in range(8)}


def test_item_that_dies_is_named_where_nothing_stands_in():
    with pytest.raises(ValueError, match="worked on 3 died twice"):
        list(run_all_tasks(TWO, chores.deadly, [3]))


def test_item_that_takes_too_long_is_ended():
    results = dict(
        run_all_tasks(
            HERE, chores.endless, range(2, 5), lost=lambda number: -number, patience_s=0.5
        )
    )
    assert results == {2: 2, 3: -3, 4: 4}


@pytest.mark.parametrize("executor", [HERE, TWO], ids=["here", "two"])
def test_error_of_the_function_ends_everything(executor):
    with pytest.raises(LookupError, match="no chore 0"):
        list(run_all_tasks(executor, chores.refused, [0]))


def test_iterator_that_is_closed_cancels_the_rest(tmp_path):
    work = run_all_tasks(TWO, chores.left_behind, range(20), shared=(tmp_path,))
    assert next(work) == (0, 0)
    work.close()
    begun = {file.name for file in tmp_path.glob("begun-*")}
    time.sleep(0.3)
    assert {file.name for file in tmp_path.glob("begun-*")} == begun
    assert [file.name for file in tmp_path.glob("ended-*")] == ["ended-0"]


def test_window_bounds_what_is_drawn_and_draws_here():
    drawn = []

    def items():
        for number in range(10):
            assert threading.current_thread() is threading.main_thread()
            drawn.append(number)
            yield number

    for done, _ in enumerate(run_all_tasks(TWO, chores.squared, items(), window=4)):
        assert len(drawn) <= 4 * (done // 4 + 1)
    assert drawn == list(range(10))


SCRIPT = """
import sys
from pathlib import Path
from support.processes import chores
from pyroshock.parallel.map_tasks import ExecutorConfig, run_all_tasks
for found in run_all_tasks(ExecutorConfig(jobs=2), chores.process, range(100_000)):
    print(found[1], flush=True)
"""


def test_workers_end_with_a_parent_that_is_killed():
    command = [sys.executable, "-c", SCRIPT]
    environment = {**os.environ, "PYTHONPATH": str(TESTS)}
    with subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as parent:
        assert parent.stdout is not None
        workers = [int(parent.stdout.readline()) for _ in range(6)]
        parent.send_signal(signal.SIGKILL)
    assert gone_within(10, workers)


NOBODY = "tcp://127.0.0.1:9"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"backend": "slurm"}, "backend 'slurm'; expected one of local, dask"),
        ({"jobs": 0}, "jobs = 0; expected 1 or more"),
        ({"backend": "dask"}, "--scheduler tcp://HOST:8786"),
        ({"scheduler": "tcp://lab:8786"}, "--backend dask"),
    ],
)
def test_what_is_no_crew_is_refused(arguments, said):
    with pytest.raises(ValueError, match=said):
        ExecutorConfig(**arguments)


def test_missing_library_is_named_with_its_cure(monkeypatch):
    monkeypatch.setattr(executor_module, "find_spec", lambda _: None)
    with pytest.raises(ValueError, match=r"needs distributed.*pip install 'pyroshock\[cluster\]'"):
        ExecutorConfig("dask", scheduler=NOBODY)


def test_scheduler_that_does_not_answer_is_named(monkeypatch):
    monkeypatch.setattr(cluster, "WAIT_S", 0.5)
    with pytest.raises(ValueError, match=f"no Dask scheduler answers at {NOBODY}"):
        ExecutorConfig("dask", scheduler=NOBODY).check()


def test_workers_with_other_software_are_refused():
    """They would give other results, and nobody would know."""

    def versions(here, there):
        client = {"packages": {"pyroshock": here}}
        workers = {"tcp://lab-2:4711": {"packages": {"pyroshock": there}}}
        return lambda packages: {"client": client, "workers": workers}

    for version in ("0.0.9", None):
        client = SimpleNamespace(
            wait_for_workers=lambda *_, **__: None, get_versions=versions("0.1.0", version)
        )
        with pytest.raises(
            ValueError, match=f"lab-2:4711 has pyroshock {version}, here it is 0.1.0"
        ):
            cluster._check_workers(client, NOBODY)


def test_workers_with_other_packages_that_add_to_it_are_refused():
    """A worker without the package cannot load its model; with another version it gives others."""
    version = {"packages": {"pyroshock": "0.1.0"}}
    added = Plugin("pyroshock.models", "nearest", "bench-extras", "1.0", "bench_extras:Nearest")
    client = SimpleNamespace(
        wait_for_workers=lambda *_, **__: None,
        get_versions=lambda packages: {"client": version, "workers": {"tcp://lab-2:4711": version}},
        run=lambda function: {"tcp://lab-2:4711": (*function(), added)},
    )
    with pytest.raises(
        ValueError, match=r"lab-2:4711 and this machine .*: bench-extras 1\.0; inst"
    ):
        cluster._check_workers(client, NOBODY)


ISOLATION = Isolation(chores.lost, chores.patience)
ALWAYS = Isolation(chores.lost, chores.patience, always=True)


@pytest.mark.parametrize("jobs", [1, 2, 3])
@pytest.mark.parametrize("count", [0, 1, 2, 20])
def test_results_come_in_order(jobs, count):
    assert list(map_ahead(chores.squared, range(count), jobs, ISOLATION)) == [
        (i, i * i) for i in range(count)
    ]


def test_dead_process_takes_only_its_own_item():
    results = list(map_ahead(chores.dies_on_three, range(25), 2, ISOLATION))
    assert results == [(i, -1 if i % 10 == 3 else i * i) for i in range(25)]


def test_error_of_the_function_is_the_callers():
    with pytest.raises(ValueError, match="three"):
        list(map_ahead(chores.raises_on_three, range(10), 2, ISOLATION))


@pytest.mark.parametrize("count", [0, 1, 5])
def test_always_isolated_runs_nothing_here(count):
    results = list(map_ahead(chores.process, range(count), 1, ALWAYS))
    assert [item for item, _ in results] == list(range(count))
    assert os.getpid() not in [process for _, process in results]


def test_dead_or_endless_item_of_one_job_is_given_up_alone():
    results = list(map_ahead(chores.dies_on_three, range(5), 1, ALWAYS))
    assert results == [(i, -1 if i == 3 else i * i) for i in range(5)]
    assert list(map_ahead(chores.hangs_on_three, range(5), 1, ALWAYS)) == [
        (i, -1 if i == 3 else i) for i in range(5)
    ]
    begun = time.monotonic()
    limited = Isolation(
        chores.lost, lambda _: 60.0, True, end_this_process_when_stuck
    )  # by its processor time
    results = list(map_ahead(chores.walks_in_circles_on_three, range(5), 1, limited))
    assert results == [(i, -1 if i == 3 else i) for i in range(5)]
    assert time.monotonic() - begun < 60


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_process_that_cannot_begin_is_no_fault_of_an_item(jobs):
    broken = Isolation(chores.lost, chores.patience, always=True, begin=chores.dies_before_any)
    with pytest.raises(
        OSError, match="ended before it read one, so nothing is known about the files"
    ):
        list(map_ahead(chores.squared, range(5), jobs, broken))


def test_item_that_kills_the_only_process_is_not_tried_again(tmp_path):
    """It was the first of those under way: a second try would take as long to fail."""
    list(
        map_ahead(
            chores.dies_and_leaves_a_mark,
            [tmp_path / "a", tmp_path / "b"],
            1,
            Isolation(chores.lost, chores.patience, always=True),
        )
    )
    assert [(tmp_path / name).read_text() for name in "ab"] == ["x", "x"]
