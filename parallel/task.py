"""What a worker does: one call of one function, watched.

One thread of linear algebra for each worker: the same sums everywhere, and as many workers as there
are cores.

What all calls share, sent to each process once.
"""

from __future__ import annotations

import faulthandler
import hashlib
import os
import pickle
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple, Protocol


class Sent(Protocol):
    """What is shared, on its way to a process."""

    def contents(self) -> tuple[Any, ...]: ...


@dataclass(frozen=True)
class SharedPayload:
    """A file of ours by its path and the SHA-256 of its bytes."""

    path: str
    sha256: str

    def contents(self) -> tuple[Any, ...]:
        """Read once by each process. Raises `ValueError` where the file is not the one that was
        packed."""
        if self not in _latest:
            content = Path(self.path).read_bytes()
            if hashlib.sha256(content).hexdigest() != self.sha256:
                raise ValueError(f"{self.path} is not what was packed for the workers")
            _latest.clear()  # of one call at a time, for it may be large
            _latest[self] = pickle.loads(content)
        return _latest[self]


_latest: dict[SharedPayload, tuple[Any, ...]] = {}


def payload_contents(shared: Sent | tuple[Any, ...]) -> tuple[Any, ...]:
    """As it was given to `run_all_tasks`."""
    return shared if isinstance(shared, tuple) else shared.contents()


@contextmanager
def pack_payload(shared: tuple[Any, ...]) -> Iterator[SharedPayload | tuple[Any, ...]]:
    """As a file that is gone afterwards; what is empty needs none."""
    if not shared:
        yield ()
        return
    content = pickle.dumps(shared, pickle.HIGHEST_PROTOCOL)
    with TemporaryDirectory(prefix="pyroshock-") as folder:  # no other user may look into it
        file = Path(folder) / "shared"
        file.write_bytes(content)
        yield SharedPayload(str(file), hashlib.sha256(content).hexdigest())


#: What libraries that are loaded later look at.
_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@cache
def use_one_thread() -> None:
    """From now on, in a process that is a worker and nothing else."""
    # Brings a BLAS of its own, which is limited only where it is loaded.
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_limits

    os.environ.update(dict.fromkeys(_VARIABLES, "1"))
    threadpool_limits(limits=1)
    if "torch" in sys.modules:
        sys.modules["torch"].set_num_threads(1)


@contextmanager
def one_thread() -> Iterator[None]:
    """As long as the block lasts, in a process that has other things to do; what is loaded within
    it stays at one."""
    import scipy.linalg  # noqa: F401 - as above
    from threadpoolctl import threadpool_limits

    torch = sys.modules.get("torch")
    threads = torch.get_num_threads() if torch else 0
    variables = {name: os.environ.get(name) for name in _VARIABLES}
    os.environ.update(dict.fromkeys(_VARIABLES, "1"))
    with threadpool_limits(limits=1):
        if torch:
            torch.set_num_threads(1)
        try:
            yield
        finally:
            if torch:
                torch.set_num_threads(threads)
            for name, value in variables.items():
                os.environ.pop(name) if value is None else os.environ.update({name: value})


class WorkerTask(NamedTuple):
    """An item by its number, and the seconds after which its worker is ended; None: it may take as
    long as it likes.

    A tuple, for joblib hands tuples to Dask as they are; other objects it would first place on one
    worker, and with that worker they would be lost.
    """

    number: int
    item: Any
    patience_s: float | None = None


@dataclass(frozen=True)
class WorkerDied:
    """In the place of a result: the worker died over the task."""


#: A task's number with what came of it.
Outcome = tuple[int, Any]


def run_task(function: Callable[..., Any], task: WorkerTask, shared: Any) -> Outcome:
    """In a worker."""
    from joblib import parallel_config

    use_one_thread()
    # The function's own libraries get no workers of their own: on a cluster they would wait for
    # each other.
    with parallel_config("sequential"), ended_after(task.patience_s):
        return task.number, function(task.item, *payload_contents(shared))


@contextmanager
def ended_after(patience_s: float | None) -> Iterator[None]:
    """This process ends when the block takes longer, even inside a C library."""
    if patience_s is None:
        yield
        return
    with Path(os.devnull).open("w") as nowhere:
        faulthandler.dump_traceback_later(patience_s, exit=True, file=nowhere)
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()
