"""What every measurement shares: turns, spreads, figures with their promises, and programs in
processes of their own.

Nothing here needs more than the standard library and NumPy: peers in environments of their own
import it too.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from importlib.metadata import distributions
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
#: Campaigns and stores that take long to make are kept in this folder between runs, where the
#: variable names one.
FOLDER_VARIABLE = "PYROSHOCK_BENCH_FOLDER"
ABSENT = "not installed: `make bench` does it"
#: The product's command in a fresh process.
PYROSHOCK = ("-c", "from pyroshock.app.doors.command_line.main import main; main()")
_PEER_ENVIRONMENTS = ROOT / ".venv" / "peers"
#: Factors from SI.
_UNITS = {"": 1.0, "s": 1.0, "ms": 1e3, "MB": 1e-6, "MiB": 2.0**-20, "%": 100.0}


@dataclass(frozen=True)
class Spread:
    """Median, least and largest of some repeats."""

    median: float
    low: float
    high: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Spread:
        return cls(statistics.median(values), min(values), max(values))

    def text(self, unit: str = "", factor: float = 1.0) -> str:
        low, median, high = (f"{factor * x:.3g}" for x in (self.low, self.median, self.high))
        return f"{median}{unit} ({low} to {high})"


def spread_text(values: Sequence[float], unit: str = "") -> str:
    """Values in SI, shown in `unit`; one value stands alone."""
    if len(values) == 1:
        return f"{_UNITS[unit] * values[0]:.3g} {unit}".rstrip()
    return Spread.of(values).text(f" {unit}" if unit else "", _UNITS[unit])


def ratio(ours: Sequence[float], peers: Sequence[float]) -> Spread:
    """Ours over the peer's, turn by turn; 1 where both are nothing."""
    return Spread.of(
        [a / b if b else (np.inf if a else 1.0) for a, b in zip(ours, peers, strict=True)]
    )


def wall_seconds(function: Callable[[], object]) -> float:
    begin = time.perf_counter()
    function()
    return time.perf_counter() - begin


def processor_seconds(function: Callable[[], object]) -> float:
    """Seconds of this process's processors: what else the machine does is not in them."""
    begin = time.process_time()
    function()
    return time.process_time() - begin


def take_turns(
    functions: Mapping[str, Callable[[], Any]],
    repeats: int,
    clock: Callable[[Callable[[], object]], float] = wall_seconds,
    *,
    reported: Sequence[str] = (),
    warm: bool = True,
) -> dict[str, list[float]]:
    """Seconds of each function, in turn and again, so that a machine that slows down slows all of
    them.

    The functions named in `reported` return their own seconds: a program measures itself, a limit
    is scaled. With `warm` a first round does not count.
    """
    seconds: dict[str, list[float]] = {name: [] for name in functions}
    for turn in range(repeats + warm):
        for name, function in functions.items():
            measured = float(function()) if name in reported else clock(function)
            if turn or not warm:
                seconds[name].append(measured)
    return seconds


#: Which quantity a figure compares, and the word for ours being above the peer's. "growth" compares
#: ours with more to ours with less, "bound" ours with a promise: neither has a peer.
BEHIND = {"time": "slower", "room": "more", "quality": "worse", "growth": "", "bound": ""}
Kind = Literal["time", "room", "quality", "growth", "bound"]


@dataclass(frozen=True)
class Figure:
    """A measured figure. `value` is ours over the peer's, and promised to be at most `limit` (None:
    no promise).

    Without a value the peer was not measured, and `peer` says why. `bound` names what bounds ours,
    and `over_bound` is ours over that. A promise that is not `binding` is an aim: missing it does
    not fail the command. `question` is the row of the first table, which shows the figure that is
    worst for us; "" stands in the details only.
    """

    theme: str
    name: str
    ours: str
    peer: str
    value: Spread | None
    limit: float | None = None
    bound: str = ""
    over_bound: Spread | None = None
    question: str = ""
    peer_name: str = ""
    kind: Kind = "time"
    binding: bool = True

    @property
    def holds(self) -> bool:
        return self.limit is None or (self.value is not None and self.value.median <= self.limit)

    @property
    def behind(self) -> str:
        """In which way ours is behind its peer, as a word; "" where it is not, or has none."""
        return BEHIND[self.kind] if self.value and self.value.median > 1 else ""

    @property
    def promise(self) -> str:
        if self.limit is None:
            return "—"
        held, failed = ("holds", "**lost**") if self.binding else ("met", "**missed**")
        state = held if self.holds else failed if self.value else "**not measured**"
        return f"{'' if self.binding else 'aim '}at most {self.limit:.3g}: {state}"

    @property
    def ratio(self) -> str:
        if self.value is None:
            return "—"
        by_chance = ", within the spread" if self.value.low <= 1 else ""
        return self.value.text() + (f" **{self.behind}**{by_chance}" if self.behind else "")

    def row(self) -> str:
        over_bound = self.over_bound.text() if self.over_bound else "—"
        return table_row(
            self.name, self.ours, self.peer, self.ratio, self.promise, self.bound or "—", over_bound
        )


def table_row(*cells: str) -> str:
    return f"| {' | '.join(cells)} |"


def table(head: Sequence[str], rows: Iterable[str]) -> str:
    """Markdown; each of `rows` is a `table_row`."""
    return "\n".join([table_row(*head), "| --- " * len(head) + "|", *rows])


def compared(
    theme: str,
    name: str,
    ours: Sequence[float],
    peer: Sequence[float],
    unit: str = "ms",
    *,
    bound: str = "",
    bound_values: Sequence[float] | None = None,
    **fields: Any,
) -> Figure:
    """Ours beside a peer of the same run, turn by turn. `bound_values` are added to the text of the
    bound."""
    over_bound = None
    if bound_values is not None:
        bound, over_bound = f"{bound}: {spread_text(bound_values, unit)}", ratio(ours, bound_values)
    texts = spread_text(ours, unit), spread_text(peer, unit)
    return Figure(
        theme, name, *texts, ratio(ours, peer), bound=bound, over_bound=over_bound, **fields
    )


def promised(
    theme: str, name: str, ours: Sequence[float], most: float, unit: str = "ms", **fields: Any
) -> Figure:
    """Ours beside the most that is promised."""
    figure = compared(
        theme, name, ours, [most] * len(ours), unit, limit=1.0, kind="bound", **fields
    )
    return replace(figure, peer=f"{_UNITS[unit] * most:g} {unit}".rstrip() + ", promised")


def missing(theme: str, name: str, why: str, **fields: Any) -> Figure:
    """The row of a peer that cannot be measured: not installed, out of memory, out of time."""
    return Figure(theme, name, fields.pop("ours", "—"), why, None, **fields)


def beside(
    theme: str,
    name: str,
    seconds: Mapping[str, Sequence[float]],
    peer: str,
    why: str = ABSENT,
    **fields: Any,
) -> Figure:
    """ "ours" of the `seconds` beside a peer, and over the "bound" where it is among them.

    `why`: no such peer.
    """
    fields = {"peer_name": peer, "bound_values": seconds.get("bound"), **fields}
    if peer in seconds:
        return compared(theme, name, seconds["ours"], seconds[peer], **fields)
    shown = {key: fields[key] for key in ("question", "peer_name") if key in fields}
    return missing(
        theme, name, why, ours=spread_text(seconds["ours"], fields.get("unit", "ms")), **shown
    )


def report(measure: Callable[[Path], Iterable[Figure]]) -> int:
    """Measures one theme in this process and prints its rows; 1 where a promise is lost."""
    lost = []
    with work_folder() as folder:
        for figure in measure(folder):
            sys.stdout.write(figure.row() + "\n")
            sys.stdout.flush()
            lost += [figure.name] * (figure.binding and not figure.holds)
    sys.stdout.write(f"promises lost: {'; '.join(lost) or 'none'}\n")
    return 1 if lost else 0


@contextmanager
def work_folder() -> Iterator[Path]:
    """$PYROSHOCK_BENCH_FOLDER, where what takes long to make is kept; else a folder that is gone
    afterwards."""
    named = os.environ.get(FOLDER_VARIABLE)
    if named:
        Path(named).mkdir(parents=True, exist_ok=True)
        yield Path(named)
        return
    with tempfile.TemporaryDirectory(prefix="pyroshock-bench-") as folder:
        yield Path(folder)


def copying(nbytes: int) -> Callable[[], object]:
    """A limit: copies so many bytes from memory to memory once."""
    source = np.ones(max(nbytes // 8, 1))
    target = np.zeros_like(source)
    return lambda: np.copyto(target, source)


def multiplying(
    flops: float, dtype: type[np.floating[Any]] = np.float64, size: int = 512
) -> Callable[[], float]:
    """A limit: returns the seconds of so many operations at the rate of a product of two
    matrices."""
    a = np.random.default_rng(0).normal(size=(size, size)).astype(dtype)
    out = np.empty_like(a)
    return lambda: wall_seconds(lambda: np.matmul(a, a, out=out)) * flops / (2.0 * size**3)


def run_program(words: Sequence[str | Path], *, watch_memory: bool = False) -> int:
    """A program with its arguments, from the root of the repository; the most bytes that it and its
    children held together (0: not watched). Raises `CalledProcessError`."""
    command = [*map(str, words)]
    # With this variable each process would compile what it imports.
    environment = {
        name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"
    }
    with subprocess.Popen(
        command, cwd=ROOT, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    ) as process:
        done, peaks = threading.Event(), [0]
        watch = threading.Thread(target=_watch_memory, args=(process.pid, done, peaks), daemon=True)
        if watch_memory:
            watch.start()
        _, errors = process.communicate()
        done.set()
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command, stderr=errors.decode())
    return max(peaks)


def run_python(*arguments: str | Path, watch_memory: bool = False) -> int:
    return run_program([sys.executable, *arguments], watch_memory=watch_memory)


def _watch_memory(pid: int, done: threading.Event, peaks: list[int]) -> None:
    """The proportional share of memory of a process and its descendants (Linux), 50 times a second:
    pages that several of them share are counted once in all."""
    import psutil

    while not done.wait(0.02):
        shares = [0]
        with suppress(psutil.NoSuchProcess):
            for member in [psutil.Process(pid), *psutil.Process(pid).children(recursive=True)]:
                with suppress(psutil.Error):  # it has just ended
                    shares.append(member.memory_full_info().pss)
        peaks.append(sum(shares))


Message = dict[str, Any]


class ProgramError(RuntimeError):
    """The program ended instead of answering; the message is why, in a few words."""


class Program:
    """`python ARGUMENTS` that answers requests, a line of JSON each, as long as the block lasts.

    It shares no memory, threads or packages with ours, and measures itself, so that the time of a
    request counts for nobody. It may take `limit_bytes` of address space. `why` says why it has
    ended.
    """

    why = ""

    def __init__(
        self, *arguments: str | Path, python: str | Path = sys.executable, limit_bytes: int = 0
    ) -> None:
        def limit_memory() -> None:
            import resource

            resource.setrlimit(resource.RLIMIT_AS, (limit_bytes, limit_bytes))

        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the program
        self._process = subprocess.Popen(
            [str(python), *map(str, arguments)],
            cwd=ROOT,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            text=True,
            preexec_fn=limit_memory if limit_bytes else None,
        )

    def ask(self, limit_s: float = 600.0, **request: Any) -> Message:
        """Raises `ProgramError` where the program ends, or has not answered in time."""
        assert self._process.stdin and self._process.stdout
        timer = threading.Timer(limit_s, self._process.kill)
        timer.start()
        try:
            self._process.stdin.write(json.dumps(request) + "\n")
            self._process.stdin.flush()
            line = self._process.stdout.readline()
        except BrokenPipeError:
            line = ""
        finally:
            in_time = timer.is_alive()
            timer.cancel()
        if not line:
            self.why = self._reason() if in_time else f"killed after {limit_s:g} s"
            raise ProgramError(self.why)
        return dict(json.loads(line))

    def seconds(self, **request: Any) -> float:
        """What the program says that it took."""
        return float(self.ask(**request)["seconds"])

    def _reason(self) -> str:
        self._process.wait()
        self._errors.seek(0)
        errors = self._errors.read().decode(errors="replace")
        if "No module named" in errors:
            return "not installed"
        if any(
            word in errors.lower()
            for word in ("memoryerror", "allocate memory", "not enough memory")
        ):
            return "out of memory"
        return f"failed ({self._process.returncode}): {errors.strip().splitlines()[-1:] or ''}"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        assert self._process.stdin and self._process.stdout
        with suppress(BrokenPipeError):  # it has ended by itself
            self._process.stdin.close()
        self._process.stdout.close()
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._errors.close()


def answer_requests(answer: Callable[[Message], Message]) -> None:
    """The program's side: answers the requests of the standard input until it ends."""
    out = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what libraries print is no answer
    for line in sys.stdin:
        out.write(json.dumps(answer(json.loads(line))) + "\n")
        out.flush()


def has(module: str) -> bool:
    """Whether `import module` finds something in this environment."""
    return find_spec(module) is not None


def interpreter_with(module: str) -> Path | None:
    """This interpreter where it has the module, else that of `.venv/peers/MODULE`; None where there
    is neither."""
    if has(module):
        return Path(sys.executable)
    program = "Scripts/python.exe" if sys.platform == "win32" else "bin/python"
    path = _PEER_ENVIRONMENTS / module.lower() / program
    return path if path.exists() else None


def version_of(package: str) -> str:
    """The version by pip's name, from this environment or a peer's own; "" where it is not
    installed."""
    folders = [*sys.path, *map(str, _PEER_ENVIRONMENTS.glob("*/lib/python*/site-packages"))]
    return next((installed.version for installed in distributions(name=package, path=folders)), "")
