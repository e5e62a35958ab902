"""Ways that are measured in processes of their own, which time themselves and are asked in turn with others.

A way that must not share memory, threads or packages with ours is a program that answers requests, a line of JSON
each: what it takes to ask it counts for nobody. Nothing here needs more than the standard library, so that the
interpreter of another environment can be the one that answers.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Self

from .measuring import ROOT
from .peers import has, python_of

Answer = dict[str, Any]


class ApartError(RuntimeError):
    """The program ended instead of answering; the message is why, in a few words."""


class Apart:
    """`python ARGUMENTS`, which answers as long as the block lasts; it may take `limit_bytes` of address space."""

    def __init__(self, *arguments: str | Path, python: str | Path = sys.executable, limit_bytes: int = 0) -> None:
        def limited() -> None:
            import resource

            resource.setrlimit(resource.RLIMIT_AS, (limit_bytes, limit_bytes))

        self._said = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the program
        self._process = subprocess.Popen(
            [str(python), *map(str, arguments)],
            cwd=ROOT,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._said,
            text=True,
            preexec_fn=limited if limit_bytes else None,
        )

    def ask(self, limit_s: float = 600.0, **request: Any) -> Answer:
        """Raises `ApartError` where the program ends, or has not answered in time."""
        assert self._process.stdin and self._process.stdout
        impatient = threading.Timer(limit_s, self._process.kill)
        impatient.start()
        try:
            self._process.stdin.write(json.dumps(request) + "\n")
            self._process.stdin.flush()
            line = self._process.stdout.readline()
        except BrokenPipeError:
            line = ""
        finally:
            in_time = impatient.is_alive()
            impatient.cancel()
        if not line:
            raise ApartError(self._reason() if in_time else f"killed after {limit_s:g} s")
        return dict(json.loads(line))

    def seconds(self, **request: Any) -> float:
        """What the program says that it took."""
        return float(self.ask(**request)["seconds"])

    def _reason(self) -> str:
        self._process.wait()
        self._said.seek(0)
        said = self._said.read().decode(errors="replace")
        if "No module named" in said:
            return "not installed"
        if any(word in said.lower() for word in ("memoryerror", "allocate memory", "not enough memory")):
            return "out of memory"
        return f"failed ({self._process.returncode}): {said.strip().splitlines()[-1:] or ''}"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        assert self._process.stdin and self._process.stdout
        with suppress(BrokenPipeError):  # it has ended by itself; who asked it was told
            self._process.stdin.close()
        self._process.stdout.close()
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._said.close()


def interpreter_with(module: str) -> Path | None:
    """Ours where it has the module, else that of the peer's own environment; None where there is neither."""
    return Path(sys.executable) if has(module) else python_of(module.lower())


def answering(answer: Callable[[Answer], Answer]) -> None:
    """The other side: answers the requests that come on the standard input, until there are no more."""
    out = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what libraries print is no answer
    for line in sys.stdin:
        out.write(json.dumps(answer(json.loads(line))) + "\n")
        out.flush()


def seconds_of(function: Callable[[], object]) -> float:
    begin = time.perf_counter()
    function()
    return time.perf_counter() - begin


def in_turn(ways: Mapping[str, Callable[[], float]], repeats: int) -> dict[str, list[float]]:
    """Seconds that each way says it took, in turn and again; what is not warm yet is asked once before."""
    taken: dict[str, list[float]] = {name: [] for name in ways}
    for _ in range(repeats):
        for name, way in ways.items():
            taken[name].append(way())
    return taken


def busy_seconds_of(function: Callable[[], object]) -> float:
    """Of this process's processors: what else the machine does does not count."""
    begin = time.process_time()
    function()
    return time.process_time() - begin
