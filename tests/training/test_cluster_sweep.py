"""A training sweep on a Dask cluster of which a worker is killed."""

from __future__ import annotations

import os
import signal
import time

import numpy as np
import pytest
from pyroshock.parallel.executor import HERE, ExecutorConfig
from pyroshock.training.fitting.fitting import task_of
from pyroshock.training.fitting.run_tasks import run_trainings
from pyroshock.training.fitting.session import Progress, train
from support.processes.dask_clusters import dask_cluster
from support.records.pulse_tables import pulse_table
from support.stores.registries import context_in, fresh_registry, without_figures

MODELS, SPLITS, HELD = ["hann", "linear", "hertz"], ["repetitions", "configurations"], "linear"


def begun(folder) -> list[tuple[str, int]]:
    """(task, process) in the order in which they were begun."""
    lines = (folder / "begun").read_text().splitlines() if (folder / "begun").exists() else []
    return [(task, int(pid)) for task, pid in map(str.split, lines)]


def silent(*_: object) -> None:
    pass


@pytest.mark.slow
def test_sweep_outlives_a_killed_worker_and_is_that_of_one_process(tmp_path, monkeypatch):
    """The worker is killed over a training that it holds, when another training is registered
    already."""
    without_figures(monkeypatch)
    registry = fresh_registry(tmp_path)
    context = context_in(registry, pulse_table(np.random.default_rng(1), repetitions=2))
    may_be_held = {task_of(HELD, split, context).key for split in SPLITS}
    killed: list[tuple[str, int]] = []

    def kill(_: str) -> None:
        until = time.monotonic() + 60
        while not killed and time.monotonic() < until:
            time.sleep(0.02)
            if held := [one for one in begun(tmp_path) if one[0] in may_be_held]:
                killed.append(held[0])
                os.kill(held[0][1], signal.SIGKILL)
                (tmp_path / "released").touch()

    with dask_cluster(
        tmp_path,
        2,
        "--preload",
        "support.processes.watched_worker",
        WATCHED=str(tmp_path),
        HELD=HELD,
    ) as cluster:
        executor = ExecutorConfig("dask", scheduler=cluster.address)
        session = train(
            registry, context, MODELS, SPLITS, executor=executor, progress=Progress(tell=kill)
        )

    (task, victim), workers = killed[0], {worker.pid for worker in cluster.workers}
    assert [pid for each, pid in begun(tmp_path) if each == task] == [victim, *(workers - {victim})]
    assert (session.trained, session.failures, len(registry.versions())) == (6, [], 6)
    tasks = [task_of(version.name, version.split, context) for version in session.versions]
    here = {
        task.key: trained for task, trained in run_trainings(tasks, context, HERE, silent, silent)
    }
    for version in session.versions:
        assert version.metrics == here[version.task_key].metrics
        one, other = (
            registry.held_out(version).prediction,
            here[version.task_key].held_out.prediction,
        )
        np.testing.assert_array_equal(one.force_n, other.force_n)
        np.testing.assert_array_equal(one.contact_time_s, other.contact_time_s)
