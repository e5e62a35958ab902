"""Commands killed in the middle of their work, and what is counted of it."""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Protocol, TypeVar

import numpy as np

STRUCK = Path(__file__).with_name("struck.py")

#: A place is struck so often before its command is let through: later strikes find less left to do.
PER_PLACE = 3


class Place(Protocol):
    """Where one command works: a store or a registry of its own."""

    command: Sequence[str]
    environment: Mapping[str, str]
    folder: Path

    def look(self) -> None:
        """After a kill: whole, consistent, usable. Raises `AssertionError`."""

    def content(self) -> object:
        """What the finished command left, apart from keys and clocks."""


@dataclass
class Tally:
    """What was tried on an operation, and what was lost."""

    operation: str
    engine: str
    tried: int = 0
    struck: int = 0
    completed: int = 0
    lost: list[str] = field(default_factory=list)

    def row(self) -> str:
        """A row of the table in docs/measurements/faults.md."""
        cells = (
            self.operation,
            self.engine,
            self.tried,
            self.struck,
            self.completed,
            len(self.lost),
        )
        return "| " + " | ".join(map(str, cells)) + " |"


#: Of this run; conftest prints them at its end.
TALLIES: dict[tuple[str, str], Tally] = {}
HEADER = (
    "| operation | engine | kills | in mid-work | then completed | lost |\n| --- "
    "| --- | --- | --- | --- | --- |"
)


@dataclass(frozen=True)
class Undisturbed:
    """A command that nobody disturbed: seconds of its work, its statements, what it left."""

    seconds: float
    statements: int
    content: object


class Forge:
    """Starts commands in processes of their own, without their imports (see `struck`); those of
    `models` or others."""

    def __init__(self, folder: Path, models: bool = True) -> None:
        self.errors, self.count = folder / "errors.txt", folder / "count.txt"
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True, "bufsize": 1}
        self._process = subprocess.Popen(
            [sys.executable, str(STRUCK), "models" if models else ""], **pipes
        )

    def start(self, place: Place, at: int = 0) -> int:
        """The number of the process that runs the place's command; with `at`, it is killed at that
        statement."""
        asked = {
            "command": list(place.command), "environment": dict(place.environment),
            "folder": str(place.folder),
            "errors": str(self.errors), "count": str(self.count), "at": at,
        }  # fmt: skip
        print(json.dumps(asked), file=self._process.stdin, flush=True)
        return int(self._process.stdout.readline())

    def ended_within(self, seconds: float) -> bool:
        """Whether the command that was started last ends by then."""
        return bool(select.select([self._process.stdout], [], [], seconds)[0])

    def wait(self) -> int:
        """The exit code of the command that was started last; -9 of a killed one."""
        return os.waitstatus_to_exitcode(int(self._process.stdout.readline()))

    def close(self) -> None:
        """No more commands."""
        self._process.communicate()


P = TypeVar("P", bound=Place)


def strike(
    forge: Forge,
    operation: str,
    engine: str,
    make: Callable[[str], P],
    kills: int,
    rng: np.random.Generator,
    is_done: Callable[[P], bool] = lambda _: False,
) -> Tally:
    """Kill the command of fresh places until `kills` came in mid-work, look after each, then let it
    through.

    Half of the kills come at a random moment of the work, half before a random statement to a
    database. Each place must end with the content of an undisturbed one. What does not is listed in
    the tally as lost. A place that `is_done` is not struck again, nor is its command run again.
    """
    tally = TALLIES.setdefault((operation, engine), Tally(operation, engine))
    kills += tally.struck
    most = tally.tried + 3 * kills
    undisturbed = measured(forge, make("undisturbed"))
    while tally.struck < kills and tally.tried < most:
        place = make(f"struck-{tally.tried}")
        for _ in range(min(PER_PLACE, kills - tally.struck)):
            tally.tried += 1
            if not _struck(forge, place, undisturbed, rng, by_clock=bool(tally.tried % 2)):
                break
            tally.struck += 1
            _count_lost(tally, place.look)
            if is_done(place):
                break
        if not is_done(place):
            _count_lost(tally, partial(_complete, forge, place, undisturbed.content))
        tally.completed += 1
    return tally


def _count_lost(tally: Tally, look: Callable[[], None]) -> None:
    try:
        look()
    except Exception as error:  # noqa: BLE001 - whatever a store that is not whole may raise
        tally.lost.append(f"{tally.operation}, kill {tally.tried}: {type(error).__name__}: {error}")


def _complete(forge: Forge, place: Place, expected: object) -> None:
    forge.start(place)
    assert forge.wait() == 0, forge.errors.read_text()
    content = place.content()
    assert content == expected, f"{content!r} is not {expected!r}"


def measured(forge: Forge, place: Place) -> Undisturbed:
    """Run a place's command to its end."""
    forge.start(place)
    began = time.perf_counter()
    assert forge.wait() == 0, forge.errors.read_text()
    seconds = time.perf_counter() - began
    return Undisturbed(seconds, int(forge.count.read_text()), place.content())


def _struck(
    forge: Forge, place: Place, undisturbed: Undisturbed, rng: np.random.Generator, by_clock: bool
) -> bool:
    """Start the command, kill it once; whether it was at work then."""
    if by_clock:
        number = forge.start(place)
        if not forge.ended_within(undisturbed.seconds * rng.uniform(0, 0.98)):
            with suppress(ProcessLookupError):  # it has ended since, and its exit code tells so
                os.killpg(number, signal.SIGKILL)
    else:
        forge.start(place, at=int(rng.integers(1, undisturbed.statements + 1)))
    code = forge.wait()
    assert code in (0, -signal.SIGKILL), forge.errors.read_text()
    return code == -signal.SIGKILL
