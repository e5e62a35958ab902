"""One function over many items, wherever the work is done."""

from __future__ import annotations

import reprlib
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import AbstractContextManager
from itertools import islice
from typing import Any, TypeVar

from .executor import DASK, ExecutorConfig
from .local_backend import WorkerPool
from .task import WorkerDied, WorkerTask

Item = TypeVar("Item")
Result = TypeVar("Result")


def run_all_tasks(
    executor: ExecutorConfig,
    function: Callable[..., Result],
    items: Iterable[Item],
    *,
    shared: tuple[Any, ...] = (),
    lost: Callable[[Item], Result] | None = None,
    patience_s: float | Callable[[Item], float] | None = None,
    isolated: bool = False,
    window: int | None = None,
) -> Generator[tuple[Item, Result], None, None]:
    """`(item, function(item, *shared))` as they are finished, in any order.

    The items under way when a process dies (a C library can be crashed by a damaged file, or want
    all memory) are tried once more, alone. A cluster gives the work of a worker that is gone to the
    others by itself; where it gives up, the same is done. What is left when the iterator is closed
    is cancelled. An error of the function ends everything, and is raised here.

    Parameters:
        executor: Where the work is done, and by how many processes.
        function: A function of a module, which workers import by its name.
        items: What it is called with, one by one; items and results can be pickled.
        shared: Further arguments, which each worker gets once. Each has one thread of linear
            algebra, so that the results are the same wherever they are made.
        lost: What stands for the result of an item that kills its process twice.
        patience_s: The time in s, or a function of the item that gives it, after which a process is
            ended.
        isolated: Whether an executor of one job is kept out of this process too, as with
            `patience_s`.
        window: The largest number of items that exist at a time; by default all are drawn at once.

    Raises:
        ValueError: Where the cluster cannot be reached, and for an item that kills its process
            without `lost`.
    """
    watched = patience_s if callable(patience_s) or patience_s is None else _always(patience_s)
    rest = enumerate(items)
    batch = list(islice(rest, window))
    if not batch:
        return  # nobody is called for nothing
    with _open_pool(executor, function, shared, isolated or patience_s is not None) as pool:
        while batch:
            tasks = {
                number: WorkerTask(number, item, watched and watched(item))
                for number, item in batch
            }
            for number, result in _outcomes(pool, tasks):
                item = tasks[number].item
                yield item, _lost_result(item, lost) if isinstance(result, WorkerDied) else result
            batch = list(islice(rest, window))


def _always(patience_s: float) -> Callable[[Any], float]:
    return lambda _: patience_s


def _open_pool(
    executor: ExecutorConfig, function: Callable[..., Any], shared: tuple[Any, ...], isolated: bool
) -> AbstractContextManager[WorkerPool]:
    if executor.backend == DASK:
        from .cluster import dask_pool

        assert executor.scheduler is not None
        return dask_pool(executor.scheduler, function, shared)
    from .local_backend import in_process, process_pool

    run_here = not isolated and executor.jobs == 1
    return (
        in_process(function, shared) if run_here else process_pool(executor.jobs, function, shared)
    )


def _outcomes(pool: WorkerPool, tasks: dict[int, WorkerTask]) -> Iterator[tuple[int, Any]]:
    """Of every task; those over which a worker died last, each tried again when nothing else is
    under way."""
    rest, suspects = dict(tasks), list[WorkerTask]()
    while rest:
        for number, result in pool.outcomes(list(rest.values())):
            task = rest.pop(number)
            if isinstance(result, WorkerDied):
                suspects.append(task)
            else:
                yield number, result
    for task in suspects:
        yield from pool.outcomes([task])


def _lost_result(item: Item, lost: Callable[[Item], Result] | None) -> Result:
    if lost is None:
        raise ValueError(
            f"the process that worked on {reprlib.repr(item)} died twice, for "
            f"memory perhaps; repeat with fewer jobs"
        )
    return lost(item)
