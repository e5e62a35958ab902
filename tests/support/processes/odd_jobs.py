"""Jobs for tests: a kind whose work is a function of the test, and workers that need not be waited
for."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import pytest
from pyroshock.app.jobs import known_kinds
from pyroshock.app.jobs.claims import Claimed, WorkerIdentity, claim_waiting
from pyroshock.app.jobs.kind import Ending, JobResult, Kind, RunningJob
from pyroshock.app.jobs.queue import JobView, ask, this_host
from pyroshock.app.jobs.worker import Worker
from pyroshock.schema.session import Store

#: Of the tests' workers: beats every 50 ms.
LEASE_S = 0.3

Do = Callable[[RunningJob, str], JobResult | Ending | None]


@dataclass(frozen=True)
class OddArguments:
    word: str = ""


@dataclass
class Odd:
    """The kind `odd` of a test: `do` is called with the work in hand and the job's word."""

    do: Do = lambda _work, word: JobResult(f"/{word}")

    def kind(self) -> Kind[OddArguments]:
        return Kind("odd", OddArguments, self._done)

    def ask(self, store: Store, word: str = "", host: str | None = None) -> JobView:
        return ask(store, self.kind(), f"odd {word}", OddArguments(word), host)

    def _done(self, work: RunningJob, arguments: OddArguments) -> Ending:
        ending = self.do(work, arguments.word) or JobResult("/")
        return ending if callable(ending) else lambda: ending


@pytest.fixture
def odd(monkeypatch: pytest.MonkeyPatch) -> Odd:
    """The kind `odd` beside the others, for as long as the test runs."""
    odd_jobs = Odd()
    monkeypatch.setitem(known_kinds.KINDS, "odd", odd_jobs.kind())  # a dict, declared as a mapping
    return odd_jobs


def hand(name: str = "a", lease_s: float = LEASE_S, host: str | None = None) -> WorkerIdentity:
    return WorkerIdentity(name, host or this_host(), tuple(known_kinds.KINDS), lease_s)


def claimed(store: Store, name: str = "dead", lease_s: float = LEASE_S) -> Claimed:
    """A job in the hands of a worker that does nothing, not even beat."""
    found = claim_waiting(store, hand(name, lease_s))
    assert found is not None
    return found


def work_off(store: Store, **settings: Any) -> int:
    """A worker does what there is, and what dead ones have left; how many jobs it had."""
    return Worker(
        store, store.engine.url.render_as_string(False), **{"lease_s": LEASE_S, **settings}
    ).run(once=True)


@contextmanager
def working(store: Store, **settings: Any) -> Iterator[Worker]:
    """A worker in a thread of its own, as a server has one."""
    worker = Worker(
        store, store.engine.url.render_as_string(False), **{"lease_s": LEASE_S, **settings}
    )
    thread = threading.Thread(target=worker.run, daemon=True)
    thread.start()
    try:
        yield worker
    finally:
        worker.end()
        thread.join(30)
        assert not thread.is_alive()
