"""How things are measured here: interleaved repeats, fresh processes, and the spread beside the median."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
#: What is dear to make is kept in this folder between runs, where the variable names one.
FOLDER_VARIABLE = "PYROSHOCK_BENCH_FOLDER"


@dataclass(frozen=True)
class Spread:
    """Median, least and largest of some repeats."""

    median: float
    low: float
    high: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Spread:
        return cls(statistics.median(values), min(values), max(values))

    def inverse(self) -> Spread:
        """Of the values' inverses; that of nothing is infinite."""
        return Spread(*(1 / value if value else float("inf") for value in (self.median, self.high, self.low)))

    def text(self, unit: str = "", scale: float = 1.0) -> str:
        low, median, high = (f"{scale * x:.3g}" for x in (self.low, self.median, self.high))
        return f"{median}{unit} ({low} to {high})"


@dataclass(frozen=True)
class Child:
    """What a fresh process and its children took; `peak_bytes` is the most they held together (0: not asked for)."""

    wall_s: float
    peak_bytes: int


def interleaved(what: Mapping[str, Callable[[], object]], repeats: int) -> dict[str, list[float]]:
    """Wall-clock seconds of each, in turn and again: a machine that slows down slows all of them."""
    for function in what.values():
        function()  # caches and imports
    taken: dict[str, list[float]] = {name: [] for name in what}
    for _ in range(repeats):
        for name, function in what.items():
            begin = time.perf_counter()
            function()
            taken[name].append(time.perf_counter() - begin)
    return taken


def ratio(ours: Sequence[float], peers: Sequence[float]) -> Spread:
    """Ours over the peer's, repeat by repeat."""
    return Spread.of([a / b for a, b in zip(ours, peers, strict=True)])


def run_child(arguments: Sequence[str | Path], *, watch_memory: bool = False) -> Child:
    """`python ARGUMENTS` in a fresh process, from the root of the repository. Raises `CalledProcessError`."""
    return run_program([sys.executable, *arguments], watch_memory=watch_memory)


def run_program(words: Sequence[str | Path], *, watch_memory: bool = False) -> Child:
    """A program and its arguments, as `run_child`."""
    begin = time.perf_counter()
    command = [*map(str, words)]
    # Where it is set, each process would compile what it imports.
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    with subprocess.Popen(
        command, cwd=ROOT, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    ) as process:
        watch = _MemoryWatch(process.pid) if watch_memory else None
        _, said = process.communicate()
        peak = watch.stop() if watch else 0
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command, stderr=said.decode())
    return Child(time.perf_counter() - begin, peak)


class _MemoryWatch:
    """Adds up the proportional share of memory of a process and its descendants, 50 times a second (Linux)."""

    def __init__(self, pid: int) -> None:
        self._pid, self._peak, self._done = pid, 0, threading.Event()
        self._thread = threading.Thread(target=self._look, daemon=True)
        self._thread.start()

    def stop(self) -> int:
        self._done.set()
        self._thread.join()
        return self._peak

    def _look(self) -> None:
        while not self._done.wait(0.02):
            self._peak = max(self._peak, sum(map(_share_bytes, _family(self._pid))))


def _family(pid: int) -> list[int]:
    """A process and all that it started, however far down."""
    found = [pid]
    for one in found:
        try:
            tasks = list(Path(f"/proc/{one}/task").iterdir())
            found += [int(child) for task in tasks for child in (task / "children").read_text().split()]
        except OSError:  # it has just ended
            continue
    return found


def _share_bytes(pid: int) -> int:
    """Proportional set size: pages that several processes share are counted once in all."""
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    except OSError:
        return 0
    return next((1024 * int(line.split()[1]) for line in lines if line.startswith("Pss:")), 0)
