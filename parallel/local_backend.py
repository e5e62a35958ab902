"""This process, or processes beside it.

No worker outlives whoever started it.

What `run_all_tasks` asks of every kind of worker pool.
"""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from threading import Thread
from typing import Any, Protocol

from .task import Outcome, WorkerDied, WorkerTask, one_thread, pack_payload, run_task
from .working_directory import working_directory_closed


class WorkerPool(Protocol):
    """Workers that are ready."""

    def outcomes(self, tasks: Iterable[WorkerTask]) -> Generator[Outcome, None, None]:
        """As they come. A task over which its worker died comes with `WorkerDied()`; then some may
        not come at all."""
        ...


class _Abandoned(BaseException):
    pass


@contextmanager
def cancel_after(stream: Generator[Any, None, None]) -> Iterator[None]:
    """Whatever of joblib's `stream` is left after the block is cancelled.

    Thrown into, not closed: for a stream that is closed early joblib warns.
    """
    try:
        yield
    finally:
        with suppress(_Abandoned):
            stream.throw(_Abandoned())


def exit_with_parent(parent: int) -> None:
    """End this process soon after its parent: a killed parent tells nobody, and nobody would take
    the result."""
    Thread(target=_watch, args=(parent,), daemon=True).start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(0.5)
    os._exit(1)


@contextmanager
def in_process(function: Callable[..., Any], shared: tuple[Any, ...]) -> Iterator[WorkerPool]:
    """This process."""
    with one_thread():
        yield _Here(function, shared)


@contextmanager
def process_pool(
    jobs: int, function: Callable[..., Any], shared: tuple[Any, ...]
) -> Iterator[WorkerPool]:
    """`jobs` processes; joblib keeps them for the next call."""
    with working_directory_closed(), pack_payload(shared) as parcel:
        yield _Beside(jobs, function, parcel)


@dataclass(frozen=True)
class _Here:
    function: Callable[..., Any]
    shared: tuple[Any, ...]

    def outcomes(self, tasks: Iterable[WorkerTask]) -> Generator[Outcome, None, None]:
        for task in tasks:
            yield task.number, self.function(task.item, *self.shared)


@dataclass(frozen=True)
class _Beside:
    jobs: int
    function: Callable[..., Any]
    shared: Any

    def outcomes(self, tasks: Iterable[WorkerTask]) -> Generator[Outcome, None, None]:
        """After a crash, those that were under way come with `WorkerDied()`: one of them did it."""
        under_way: dict[int, None] = {}
        stream = self._stream(tasks, under_way)
        with cancel_after(stream):
            try:
                for number, result in stream:
                    del under_way[number]
                    yield number, result
            except BrokenProcessPool:
                yield from ((number, WorkerDied()) for number in under_way)

    def _stream(
        self, tasks: Iterable[WorkerTask], under_way: dict[int, None]
    ) -> Generator[Outcome, None, None]:
        from joblib import Parallel, delayed, parallel_config

        # A worker that has grown leaves after its task and another comes; nothing is lost, nobody
        # need know.
        warnings.filterwarnings(
            "ignore", "A worker stopped while some jobs were given", UserWarning
        )

        def calls() -> Iterator[Any]:
            for task in tasks:
                under_way[task.number] = None
                yield delayed(run_task)(self.function, task, self.shared)

        # joblib takes one process for none: it would work in this one. So there are two, and one
        # task at a time.
        processes = max(2, self.jobs)
        options = {
            "batch_size": 1,
            "pre_dispatch": self.jobs,
            "max_nbytes": None,
            "return_as": "generator_unordered",
        }
        with parallel_config(
            "loky", inner_max_num_threads=1, initializer=exit_with_parent, initargs=(os.getpid(),)
        ):
            stream: Generator[Outcome, None, None] = Parallel(n_jobs=processes, **options)(calls())
        return stream
