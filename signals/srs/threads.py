"""Work that holds no lock of the interpreter, spread over the processors.

Threads wait between calls, as starting one takes as long as half a spectrum. The caller works too,
from the other end, and takes back what no thread has begun: on a busy machine it does not wait for
one that gets no processor.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise

_PARTS_PER_THREAD = 4


def processors() -> int:
    """Those this process may run on."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on this system
        return os.cpu_count() or 1


def checked_threads(threads: int | None) -> int:
    """None is one to a processor. Raises `ValueError` below 1."""
    if threads is not None and threads < 1:
        raise ValueError(
            f"threads = {threads!r}: expected 1 or more, or None for one to a processor"
        )
    return processors() if threads is None else threads


def over_threads(run: Callable[[int, int], None], tasks: int, threads: int) -> None:
    """`run(start, stop)` for parts of the tasks that make up all of them."""
    if threads == 1 or tasks == 1:
        return run(0, tasks)
    parts = min(tasks, _PARTS_PER_THREAD * threads)
    spans = list(pairwise(tasks * i // parts for i in range(parts + 1)))
    pool = _pool(threads - 1, os.getpid())
    waiting = [pool.submit(run, *span) for span in spans]
    for future, span in zip(reversed(waiting), reversed(spans), strict=True):
        if future.cancel():
            run(*span)
    for future in waiting:
        if not future.cancelled():
            future.result()
    return None


@cache
# A fork has none of its parent's threads.
def _pool(threads: int, process: int) -> ThreadPoolExecutor:  # noqa: ARG001
    return ThreadPoolExecutor(threads, thread_name_prefix="spectra")
