"""`pyroshock serve` with many readers at once: how long a page takes, how many pages a second are
sent, and what memory the server needs.

`python -m benchmarks serving` measures it. Each repeat has a fresh server, which has made no page
yet, and then the same requests once more.
"""

from __future__ import annotations

import http.client
import random
import re
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .harness import (
    ABSENT,
    PYROSHOCK,
    Figure,
    compared,
    has,
    missing,
    promised,
)
from .shared_records import full_campaign

THEME = "`pyroshock serve` with 50 readers at once"
READERS, REQUESTS, IMPACTS = 50, 400, 20
#: Aims: the 95th percentile of a page's time, the time between two pages, and the memory.
PAGE_S, BETWEEN_S, MEMORY_BYTES = 2.0, 1 / 40, 300e6
#: What the members of a laboratory open; {impact} is any of the store.
PAGES = (
    "/", "/campaigns", "/campaigns/spring", "/impacts", "/impacts/{impact}", "/shots",
    "/compare", "/compare/spectra?impacts=1,2,3", "/models", "/models/linear/1",
    "/models/compare?version=linear@1&version=tree@1", "/datasets", "/datasets/pulses", "/plans",
    "/plans/spring", "/diagnoses", "/jobs", "/twin",
)  # fmt: skip
_MLFLOW = "/ajax-api/2.0/mlflow/model-versions/search?max_results=100"
_LISTENS = re.compile(r"http://\S+?:(\d+)")


@dataclass(frozen=True)
class Load:
    """What readers met: the seconds of each request (n,), those of all together, and the most bytes
    of memory that the server had (Linux)."""

    request_s: Sequence[float]
    total_s: float
    memory_bytes: float

    @property
    def slow_s(self) -> float:
        """The 95th percentile."""
        return float(np.percentile(self.request_s, 95))

    @property
    def between_s(self) -> float:
        """From one answer to the next."""
        return self.total_s / len(self.request_s)


def measure_serving(folder: Path, repeats: int = 3) -> Iterator[Figure]:
    """Fresh servers and full ones, beside a file of the same server and the lists of MLflow."""
    db = _store(folder)
    rng = random.Random(0)
    addresses = [rng.choice(PAGES).format(impact=rng.randint(1, IMPACTS)) for _ in range(REQUESTS)]
    fresh, full, files, peers = [], [], [], []
    for _ in range(repeats):
        with _serving([*PYROSHOCK, "serve", "--db", db, "--port", "0"], folder) as server:
            fresh.append(read_at_once(server, addresses))
            full.append(read_at_once(server, addresses))
            files.append(read_at_once(server, ["/static/style.css"] * REQUESTS))
        if has("mlflow"):
            with _mlflow(folder) as server:
                peers.append(read_at_once(server, [_MLFLOW] * REQUESTS))
    for name, loads in (("a server that has made no page yet", fresh), ("made pages", full)):
        at_most: dict[str, Any] = {"binding": False, "peer_name": "the aim"}
        yield promised(
            THEME, f"95th percentile of a page, {name}", [load.slow_s for load in loads], PAGE_S,
            bound="a file of this server", bound_values=[load.slow_s for load in files],
            question=f"a page among {READERS} readers", **at_most,
        )  # fmt: skip
        yield promised(
            THEME, f"time from one page to the next, {name}", [load.between_s for load in loads],
            BETWEEN_S, bound="a file of this server",
            bound_values=[load.between_s for load in files], question="pages a second", **at_most,
        )  # fmt: skip
    yield promised(
        THEME, "memory of the server", [load.memory_bytes for load in full], MEMORY_BYTES, "MB",
        question="memory of the server", binding=False, peer_name="the aim",
    )  # fmt: skip
    name = "list of three models; `mlflow server`"
    if not peers:
        yield missing(THEME, name, ABSENT, peer_name="MLflow")
        return
    yield compared(
        THEME, f"95th percentile of all pages; {name}", [load.slow_s for load in full],
        [load.slow_s for load in peers], peer_name="MLflow",
    )  # fmt: skip


def _store(folder: Path) -> str:
    """The address of a store with 20 impacts of a hammer, a dataset, two models and a plan."""
    db = f"sqlite:///{folder / 'served.db'}"
    if (folder / "served.db").exists():
        return db
    full_campaign(folder / "spring", "spring")
    for words in (
        ["ingest", "spring", "--jobs", "1"],
        ["dataset", "build", "pulses", "--from", "spring"],
        ["train", "pulses", "--models", "linear,tree", "--split", "repetitions"],
        ["plan", "factorial", "spring", "--kind", "hammer"],
    ):
        subprocess.run(
            [sys.executable, *PYROSHOCK, *words, "--db", db],
            cwd=folder,
            check=True,
            capture_output=True,
        )
    return db


@dataclass(frozen=True)
class Server:
    """A server that listens on a port of this machine."""

    port: int
    pid: int


@contextmanager
def _serving(arguments: Sequence[str], folder: Path) -> Iterator[Server]:
    with (folder / "server.log").open("w+") as log:
        process = subprocess.Popen(
            [sys.executable, *arguments], cwd=folder, stdout=log, stderr=subprocess.STDOUT
        )
        try:
            yield Server(_port(folder / "server.log", process), process.pid)
        finally:
            process.terminate()
            process.wait(30)


def _mlflow(folder: Path) -> Any:
    """MLflow's server over the same registry, with one worker, as ours has."""
    database = f"sqlite:///{folder / 'served-models.db'}"
    words = ("server", "--backend-store-uri", database, "--workers", "1", "--port", "5099")
    return _serving(["-m", "mlflow", *words], folder)


def _port(log: Path, process: subprocess.Popen[bytes], patience_s: float = 120.0) -> int:
    """Where a server listens, once it answers. Raises `TimeoutError`."""
    deadline = time.monotonic() + patience_s
    while time.monotonic() < deadline and process.poll() is None:
        listening = _LISTENS.search(log.read_text())
        if listening is not None:
            try:
                _ask(
                    http.client.HTTPConnection("127.0.0.1", int(listening[1]), timeout=10), "/jobs"
                )
            except OSError:
                pass  # it has told its port, and does not answer yet
            else:
                return int(listening[1])
        time.sleep(0.1)
    raise TimeoutError(f"no server listens after {patience_s:g} s: {log.read_text()[-500:]}")


def read_at_once(server: Server, addresses: Sequence[str], readers: int = READERS) -> Load:
    """Readers who open the next page as soon as they have the last one, until all are read.

    Raises `ValueError` for an answer that is no page.
    """
    waiting, seconds, faults = deque(addresses), list[float](), list[str]()

    def read() -> None:
        connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=300)
        while waiting:
            try:
                address = waiting.popleft()
            except IndexError:  # another reader took the last one
                return
            begin = time.perf_counter()
            status = _ask(connection, address)
            seconds.append(time.perf_counter() - begin)
            if status != http.client.OK:
                faults.append(f"{address}: {status}")

    threads = [threading.Thread(target=read) for _ in range(readers)]
    begin = time.perf_counter()
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    total = time.perf_counter() - begin
    if faults or len(seconds) != len(addresses):
        raise ValueError(f"{len(seconds)} of {len(addresses)} pages; {'; '.join(faults[:5])}")
    return Load(seconds, total, _peak_bytes(server.pid))


def _ask(connection: http.client.HTTPConnection, address: str) -> int:
    connection.request("GET", address, headers={"accept": "text/html", "accept-encoding": "gzip"})
    answer = connection.getresponse()
    answer.read()
    return answer.status


def _peak_bytes(pid: int) -> float:
    """The most memory that a process had so far; NaN where the system does not tell."""
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except OSError:  # a system without /proc, or a process that has ended
        return float("nan")
    peak_match = re.search(r"VmHWM:\s+(\d+) kB", status)
    return 1024.0 * int(peak_match[1]) if peak_match else float("nan")
