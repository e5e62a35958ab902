"""A Dask cluster for tests: a scheduler and workers, each a process of its own."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

TESTS = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Cluster:
    address: str
    scheduler: subprocess.Popen[bytes]
    workers: list[subprocess.Popen[bytes]]


@contextmanager
def dask_cluster(
    folder: Path, workers: int = 2, *options: str, **environment: str
) -> Iterator[Cluster]:
    """`workers` of one thread, which nobody starts again unless `options` say so; they know the
    modules of tests."""
    file = folder / "scheduler.json"
    env = {
        **os.environ,
        "PYTHONPATH": str(TESTS),
        "DASK_DISTRIBUTED__SCHEDULER__WORKER_TTL": "60s",
        **environment,
    }
    place = ["--scheduler-file", str(file), "--no-dashboard"]
    started: list[subprocess.Popen[bytes]] = []

    def start(program: str, *arguments: str) -> None:
        log = (folder / f"{program}-{len(started)}.log").open("wb")
        with log:
            command = [sys.executable, "-m", f"distributed.cli.{program}", *arguments]
            # A session of its own: a nanny and its worker are ended together.
            pipes = {"stdout": log, "stderr": log, "start_new_session": True}
            started.append(subprocess.Popen(command, env=env, cwd=folder, **pipes))

    try:
        start("dask_scheduler", *place, "--host", "127.0.0.1", "--port", "0")
        for _ in range(workers):
            nanny = [] if "--nanny" in options else ["--no-nanny"]
            start(
                "dask_worker",
                *place,
                *nanny,
                "--nthreads",
                "1",
                "--local-directory",
                str(folder),
                *options,
            )
        address = _address(file)
        _wait_for(address, workers)
        yield Cluster(address, started[0], started[1:])
    finally:
        for one in started:
            with suppress(ProcessLookupError):
                os.killpg(one.pid, signal.SIGKILL)
            one.wait(timeout=30)


def _wait_for(address: str, workers: int) -> None:
    from distributed import Client

    if workers:
        with Client(address, set_as_default=False, timeout=60) as client:
            client.wait_for_workers(workers, timeout=60)


def _address(file: Path) -> str:
    until = time.monotonic() + 60
    while time.monotonic() < until:
        try:
            return str(json.loads(file.read_text())["address"])
        except (OSError, ValueError):
            time.sleep(0.05)
    raise TimeoutError(f"no scheduler wrote {file}")
