"""What a kind of work is given, and what it gives back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .fenced_store import FencedStore

#: Told (done, total, what); raises `StoppedError` or another end of the attempt.
Step = Callable[[int, int, str], None]


class StoppedError(Exception):
    """A person has stopped the job."""


class InterruptedWorkError(Exception):
    """The worker is told to end: the job goes back to the queue."""


class NotHereError(Exception):
    """This worker lacks what the job needs; another may have it. The message says what is missing."""


@dataclass(frozen=True)
class Result:
    """Where to see what a job did (an address of the window), what to say of it, and it as plain data for scripts."""

    address: str
    words: str = ""
    data: Any = None


#: Writes what must not be written twice, and tells the result: called within the transaction that ends the job, and
#: again where that was rolled back.
Ending = Callable[[], Result]


@dataclass(frozen=True)
class RunningJob:
    """A job in hand: its number, the store that it may write while it is this worker's, and how to tell progress.

    `db` is the store's address, beside which models and plates are kept; `folders` those that may be read from.
    """

    job: int
    store: FencedStore
    db: str
    step: Step
    folders: tuple[Path, ...] = ()
