"""Long work of the server, one at a time, in the order it was asked for: each with its progress and a stop.

A store has one writer and the machine few cores, hence one worker. Jobs live as long as the server; what they did is
in the store, whole or not at all.
"""

from __future__ import annotations

import itertools
import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from queue import Queue
from typing import Any

_log = logging.getLogger("pyroshock.web")

WAITING, RUNNING, DONE, FAILED, STOPPED = "waiting", "running", "done", "failed", "stopped"
ENDED = (DONE, FAILED, STOPPED)
#: The worker tells (done, total, what); raises `Stopped` where a person wants it to end.
Step = Callable[[int, int, str], None]
#: Gives where its result is to be seen: an address of this server, and words.
Work = Callable[[Step], "Result"]
#: So many ended ones stay listed.
_KEPT = 200


class Stopped(Exception):
    """A person has stopped the job."""


@dataclass(frozen=True)
class Result:
    """Where to see what a job did, what to say of it, and it as plain data for scripts."""

    address: str
    words: str = ""
    data: Any = None


@dataclass
class Job:
    """One piece of work; only the worker changes it."""

    key: int
    label: str
    state: str = WAITING
    done: int = 0
    total: int = 0
    what: str = ""
    error: str | None = None
    result: Result | None = None
    asked_at: datetime = field(default_factory=lambda: datetime.now(UTC))
    ended_at: datetime | None = None
    stop: threading.Event = field(default_factory=threading.Event, repr=False)

    def as_json(self) -> dict[str, Any]:
        return {
            "id": self.key,
            "label": self.label,
            "state": self.state,
            "done": self.done,
            "total": self.total,
            "what": self.what,
            "error": self.error,
            "address": self.result.address if self.result else None,
            "words": self.result.words if self.result else None,
            "result": self.result.data if self.result else None,
            "asked_at": self.asked_at.isoformat(timespec="seconds"),
            "ended_at": self.ended_at.isoformat(timespec="seconds") if self.ended_at else None,
        }


class Jobs:
    """The queue and its worker. `is_for_the_user`: which errors are told in their own words."""

    def __init__(self, is_for_the_user: Callable[[Exception], bool] = lambda _: True) -> None:
        self._is_for_the_user = is_for_the_user
        self._numbers = itertools.count(1)
        self._jobs: dict[int, Job] = {}
        self._lock = threading.Lock()
        self._queue: Queue[tuple[Job, Work] | None] = Queue()
        self._worker: threading.Thread | None = None

    def start(self, label: str, work: Work) -> Job:
        """Queue a piece of work."""
        with self._lock:
            job = Job(next(self._numbers), label)
            self._jobs[job.key] = job
            ended = [key for key, each in self._jobs.items() if each.state in ENDED]
            for key in ended[: max(0, len(ended) - _KEPT)]:
                del self._jobs[key]
            if self._worker is None:
                self._worker = threading.Thread(target=self._run, name="pyroshock jobs", daemon=True)
                self._worker.start()
            self._queue.put((job, work))
        return job

    def get(self, key: int) -> Job:
        """Raises `LookupError` for a number that no job of this server has."""
        job = self._jobs.get(key)
        if job is None:
            raise LookupError(f"no job {key}: the server keeps the last {_KEPT} since it was started")
        return job

    def listed(self) -> list[Job]:
        """The newest first."""
        with self._lock:
            return list(self._jobs.values())[::-1]

    def stop(self, key: int) -> Job:
        """Ask a job to end; one that has ended stays as it is."""
        job = self.get(key)
        job.stop.set()
        return job

    def close(self, patience_s: float = 5.0) -> None:
        """Stop all, and wait for the one at work."""
        for job in self.listed():
            job.stop.set()
        self._queue.put(None)
        if self._worker is not None:
            self._worker.join(patience_s)

    def _run(self) -> None:
        while (item := self._queue.get()) is not None:
            self._work(*item)

    def _work(self, job: Job, work: Work) -> None:
        def step(done: int, total: int, what: str) -> None:
            job.done, job.total, job.what = done, total, what
            if job.stop.is_set():
                raise Stopped

        try:
            if job.stop.is_set():
                raise Stopped
            job.state = RUNNING
            job.result = work(step)
            state = DONE
        except Stopped:
            state = STOPPED
        except Exception as error:  # noqa: BLE001 - whatever ends a job, the next one must run
            state, job.error = FAILED, self._words(error)
        job.ended_at = datetime.now(UTC)
        job.state = state  # last: who polls for it finds the rest

    def _words(self, error: Exception) -> str:
        if self._is_for_the_user(error):
            return str(error)
        _log.error("a job failed", exc_info=error)
        return f"an error of pyroshock itself, {type(error).__name__}: {error}; the server's log has its trace"
