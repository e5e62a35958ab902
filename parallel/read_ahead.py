"""Reading ahead: several processes work on the next recordings while this one stores.

`local_backend` cannot stand in: joblib keeps its processes for the next call, and a reader's
process ends itself when a C library hangs, so that it must do nothing else; nor does joblib fork
from a server that has the readers imported.
"""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from .executor import usual_jobs
from .task import ended_after
from .working_directory import working_directory_closed

Item = TypeVar("Item")
Result = TypeVar("Result")


#: Below this, starting processes costs more than they save (measured: 1.5 s, in which one reads
#: about 200 MB).
_WORTH_PROCESSES_BYTES = 64 * 2**20


def default_jobs(total_bytes: int) -> int:
    """Processes for files of `total_bytes`: reading and compressing scale, the one writer soon does
    not."""
    if total_bytes < _WORTH_PROCESSES_BYTES:
        return 1
    return usual_jobs()


def _nothing() -> None:
    pass


@dataclass(frozen=True)
class Isolation(Generic[Item, Result]):
    """What stands in for an item whose process dies (a C library can be crashed by a damaged file,
    or never return).

    `patience_s(item)` is the time after which its process is ended; with `always`, not even a
    single item, or a single job, runs in this process. `begin` is called first in each process, and
    modules of `preload` are imported once for all of them.
    """

    lost: Callable[[Item], Result]
    patience_s: Callable[[Item], float]
    always: bool = False
    begin: Callable[[], None] = _nothing
    preload: tuple[str, ...] = ()


def map_ahead(
    function: Callable[[Item], Result],
    items: Sequence[Item],
    jobs: int,
    isolation: Isolation[Item, Result],
) -> Iterator[tuple[Item, Result]]:
    """(item, function(item)) in order. With `jobs` > 1, at most `2 * jobs` results exist at a time,
    so that memory does not grow with the number of items. An item whose process dies gives
    `isolation.lost(item)`, and the others go on.
    """
    if not isolation.always and (jobs <= 1 or len(items) < 2):
        for item in items:
            yield item, function(item)
        return
    rest = deque(items)
    while rest:
        under_way: list[Item] = []
        processes = max(1, min(jobs, len(rest)))
        yield from _until_a_crash(function, rest, processes, isolation, under_way)
        if under_way and processes == 1:  # one process takes them in order: it was the first
            yield under_way[0], isolation.lost(under_way[0])
            rest.extendleft(reversed(under_way[1:]))
            continue
        for item in under_way:
            yield item, _alone(function, item, isolation)


@contextmanager
def _open_pool(jobs: int, isolation: Isolation[Any, Any]) -> Iterator[ProcessPoolExecutor]:
    """Raises `OSError` where no process begins: then no item is the cause, and none is given up."""
    from .workers_without_main import ContextWithoutMain  # which Windows lacks

    # Processes are forked from a clean server, not from this one, which may hold connections and
    # threads; the server has imported what they need, so that each does not do it again.
    context = ContextWithoutMain()
    context.set_forkserver_preload(list(isolation.preload))
    processes = ProcessPoolExecutor(
        jobs, mp_context=context, initializer=_begin, initargs=(isolation.begin,)
    )
    with working_directory_closed(), processes as pool:
        try:
            pool.submit(_nothing).result()
        except BrokenProcessPool as error:
            raise OSError(
                "a process that reads files ended before it read one, so nothing is known about "
                "the files; its error output says why, and where it says nothing, memory is short: "
                "close other programs, then repeat"
            ) from error
        yield pool


def _watched(function: Callable[[Item], Result], patience_s: float, item: Item) -> Result:
    with ended_after(patience_s):
        return function(item)


def _begin(begin: Callable[[], None]) -> None:
    begin()
    _end_with_parent()


def _end_with_parent() -> None:
    """Leave no process behind when the parent is killed: it cannot tell, and would be waited for in
    vain."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_wait_and_exit, args=(parent.join,), daemon=True).start()


def _wait_and_exit(wait: Callable[[], None]) -> None:
    wait()
    os._exit(1)


def _until_a_crash(
    function: Callable[[Item], Result],
    rest: deque[Item],
    jobs: int,
    isolation: Isolation[Item, Result],
    under_way: list[Item],
) -> Iterator[tuple[Item, Result]]:
    """Work off `rest`; after a crash `under_way` holds the items of which one did it."""
    waiting: deque[tuple[Item, Future[Result]]] = deque()
    with _open_pool(jobs, isolation) as pool:
        try:
            while rest or waiting:
                while rest and len(waiting) < 2 * jobs:
                    waiting.append(
                        (
                            rest[0],
                            pool.submit(_watched, function, isolation.patience_s(rest[0]), rest[0]),
                        )
                    )
                    rest.popleft()
                item, future = waiting[0]
                result = future.result()
                waiting.popleft()
                yield item, result
        except BrokenProcessPool:
            under_way.extend(item for item, _ in waiting)
        finally:
            for _, future in waiting:
                future.cancel()


def _alone(
    function: Callable[[Item], Result], item: Item, isolation: Isolation[Item, Result]
) -> Result:
    with _open_pool(1, isolation) as pool:
        try:
            return pool.submit(_watched, function, isolation.patience_s(item), item).result()
        except BrokenProcessPool:
            return isolation.lost(item)
