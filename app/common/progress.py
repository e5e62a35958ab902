"""Progress of long work on standard error: bars on terminals, a line every ten seconds in logs,
notebook widgets."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from threading import Event, Thread
from typing import Any

Step = Callable[[int, int, str], None]

#: On a terminal: this long between two lines before the first step.
BEFORE_THE_BLOCK_S = 5.0
#: Where standard error is no terminal: work that ends earlier is not told, and this long between
#: two lines.
SILENT_S, BETWEEN_LINES_S = 2.0, 10.0
_SIZE_OF_NO_TERMINAL: dict[str, Any] = {"ncols": 80, "nrows": 25}
_BEFORE_THE_FIRST_STEP = "{desc} [{elapsed}]"
_STEPS = "{percentage:3.0f} %|{bar}| {n_fmt} of {total_fmt}{unit} [{elapsed}]{postfix}"
_STEPS_AND_TIME = _STEPS.replace("{elapsed}", "{elapsed}, about REMAINING left")
#: Nothing is said of the remaining time before so much of the work is done.
LEAST_SHARE = 0.1


class RemainingTime:
    """How long work with steps still takes, from the steps that are done.

    The time before the first step that is told, and the first steps themselves, say little of the
    others: they import, compile and start processes. So the rate is that since the first step,
    as soon as a tenth of the work lies behind it. Where the number of steps changes, or fewer are
    done than before, other work begins, and the past says nothing of it.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._total = 0
        #: Times of the steps that were told, and the shares of the work that were done then.
        self._steps: list[tuple[float, float]] = []

    def step(self, done: int, total: int) -> None:
        """So many of `total` steps are done now."""
        share = done / total if total else 0.0
        if not self._steps or total != self._total or share < self._steps[-1][1] or not done:
            self._total, self._steps = total, [(self._clock(), share)]
        elif share > self._steps[-1][1]:
            self._steps.append((self._clock(), share))

    def estimate_s(self) -> float | None:
        """Seconds until the work is done; None before a tenth of it was done since the first
        step."""
        steps = self._steps
        if not steps:
            return None
        last_s, share = steps[-1]
        since = next(
            (step for step in steps[1:-1] if share - step[1] >= LEAST_SHARE - 1e-9), steps[0]
        )
        if share - since[1] < LEAST_SHARE - 1e-9:
            return None
        rate = (share - since[1]) / (last_s - since[0])
        # The step in work is as long as the last one at most, as far as anybody knows.
        waited = min(rate * (self._clock() - last_s), share - steps[-2][1])
        return (1.0 - min(share + waited, 1.0)) / rate


class WorkProgress:
    """Says what is done as soon as it is made, before imports and the first step; within its block,
    how far it is.

    On a terminal a line, every five seconds the time until the block begins, and then a bar, whose
    clock runs whether or not a step ends. Elsewhere, as in a log, lines at the beginning, every ten
    seconds and at the end, and nothing for work of less than two seconds.
    """

    def __init__(self, label: str, unit: str = "") -> None:
        self._label, self._unit = label, unit
        self._start_s = time.monotonic()
        self._done, self._total, self._has_lines = 0, 0, False
        self._remaining = RemainingTime()
        self._begin, self._end = Event(), Event()
        self._bar: Any = None
        self._thread: Thread | None = None
        if sys.stderr.isatty():
            print(f"{label} …", file=sys.stderr, flush=True)
            Thread(target=self._tell_time_before, daemon=True).start()

    def __enter__(self) -> Step:
        self._begin.set()
        if sys.stderr.isatty():
            from tqdm import tqdm

            self._bar = tqdm(
                desc="working",
                unit=f" {self._unit}",
                leave=False,
                bar_format=_BEFORE_THE_FIRST_STEP,
                **({"dynamic_ncols": True} if _has_size() else _SIZE_OF_NO_TERMINAL),
            )
        self._thread = Thread(
            target=self._tick if self._bar is not None else self._tell_lines, daemon=True
        )
        self._thread.start()
        return self._step

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._end.set()
        assert self._thread is not None
        self._thread.join()
        if self._bar is not None:
            self._bar.close()
        elif self._has_lines and kind is None:
            self._tell(f"done in {_duration(time.monotonic() - self._start_s)}")

    def _step(self, done: int, total: int, what: str) -> None:
        self._done, self._total = done, total
        self._remaining.step(done, total)
        if self._bar is not None:
            _count(self._bar, done, total, what, self._remaining)

    def _tell_time_before(self) -> None:
        while not self._begin.wait(BEFORE_THE_BLOCK_S):
            self._tell(self._state())

    def _tick(self) -> None:
        while not self._end.wait(1.0):
            _tell_remaining(self._bar, self._remaining)
            self._bar.refresh()

    def _tell_lines(self) -> None:
        pause = SILENT_S - (time.monotonic() - self._start_s)
        while not self._end.wait(max(pause, 0.0)):
            self._tell(self._state() if self._has_lines else "…")
            self._has_lines, pause = True, BETWEEN_LINES_S

    def _state(self) -> str:
        elapsed = time.monotonic() - self._start_s
        if not self._done or not self._total:
            return f"{_duration(elapsed)} elapsed"
        steps = f"{self._done} of {self._total} {self._unit}".strip()
        if self._unit == "%":
            steps = f"{self._done} %"
        remaining_s = self._remaining.estimate_s()
        words = "" if remaining_s is None else f", about {_duration(remaining_s)} left"
        return f"{steps}, {_duration(elapsed)} elapsed{words}"

    def _tell(self, words: str) -> None:
        separator = " " if words == "…" else ": "
        with suppress(OSError, ValueError):  # nobody reads any more: the work goes on
            print(f"{self._label}{separator}{words}", file=sys.stderr, flush=True)


def _has_size() -> bool:
    """Whether the terminal says how wide it is; a pseudo-terminal may say 0, where tqdm draws
    nothing."""
    with suppress(OSError, ValueError):  # it is no terminal, or it is closed: then it has no size
        return min(os.get_terminal_size(sys.stderr.fileno())) > 0
    return False


def _duration(seconds: float) -> str:
    whole = round(seconds)
    return f"{whole} s" if whole < 120 else f"{whole // 60} min {whole % 60} s"


def progress_bar(label: str, unit: str = "") -> WorkProgress:
    """Says `label` at once; its block gives `step(done, total, what)`. Work without steps shows the
    time that it took.

    To be made before what takes time, imports and the store included; the block may begin later.
    """
    return WorkProgress(label, unit)


@contextmanager
def notebook_bar(label: str, unit: str) -> Iterator[Step]:
    """A bar in a notebook, where it is a widget or text, and on a terminal; elsewhere it is
    silent."""
    from tqdm.auto import tqdm

    in_notebook = "ipykernel" in sys.modules
    bar = tqdm(
        desc=label,
        unit=f" {unit}",
        delay=0.5,
        disable=not (in_notebook or sys.stderr.isatty()),
        leave=False,
        bar_format=_STEPS,
    )
    remaining = RemainingTime()

    def step(done: int, total: int, what: str) -> None:
        remaining.step(done, total)
        _count(bar, done, total, what, remaining)

    try:
        yield step
    finally:
        bar.close()


def _count(bar: Any, done: int, total: int, what: str, remaining: RemainingTime) -> None:
    if bar.disable:  # tqdm gives a bar that is not shown none of the attributes below
        return
    if done and bar.bar_format == _BEFORE_THE_FIRST_STEP:
        bar.bar_format = _STEPS
    _tell_remaining(bar, remaining)
    bar.total = total
    bar.set_postfix_str(what, refresh=False)
    bar.update(done - bar.n)


def _tell_remaining(bar: Any, remaining: RemainingTime) -> None:
    """Our estimate in the place of the bar's own, which knows no work of several parts."""
    if bar.bar_format == _BEFORE_THE_FIRST_STEP:
        return
    seconds = remaining.estimate_s()
    bar.bar_format = (
        _STEPS if seconds is None else _STEPS_AND_TIME.replace("REMAINING", _duration(seconds))
    )
