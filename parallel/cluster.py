"""The workers of a Dask cluster."""

from __future__ import annotations

import logging
import pickle
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError, Future
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..plugins import Plugin, installed
from .local_backend import WorkerPool, cancel_after
from .task import Outcome, WorkerDied, WorkerTask, run_task

if TYPE_CHECKING:
    from distributed import Client

#: To be reached in, and for a first worker to join.
WAIT_S = 10


def connect_cluster(address: str) -> Client:
    """Raises `ValueError` where nobody answers, where there is no worker, and where one runs
    another pyroshock, or other packages that add to it."""
    from distributed import Client

    try:
        client = Client(address, timeout=WAIT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ValueError(
            f"no Dask scheduler answers at {address} "
            f"({error or type(error).__name__}); start one: dask scheduler"
        ) from None
    try:
        _check_workers(client, address)
    except BaseException:  # an interruption, too, closes the connection; it is raised again
        client.close()
        raise
    return client


def _check_workers(client: Client, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=WAIT_S)
    except TimeoutError:
        raise ValueError(
            f"the Dask scheduler at {address} has no worker; start some: dask worker {address}"
        ) from None
    versions = client.get_versions(packages=["pyroshock"])
    ours = versions["client"]["packages"]["pyroshock"]
    for worker, worker_versions in versions["workers"].items():
        theirs = worker_versions["packages"]["pyroshock"]
        if theirs != ours:
            raise ValueError(
                f"the Dask worker at {worker} has pyroshock {theirs}, here it "
                f"is {ours}; install the same"
            )
    for worker, plugins in client.run(installed).items():
        if different := sorted(set(plugins) ^ set(installed())):
            raise ValueError(
                f"the Dask worker at {worker} and this machine do not have the same packages that "
                f"add to pyroshock: {_words(different)}; install the same"
            )


def _words(plugins: Sequence[Plugin]) -> str:
    return ", ".join(dict.fromkeys(f"{plugin.package} {plugin.version}" for plugin in plugins))


@contextmanager
def dask_pool(
    address: str, function: Callable[..., Any], shared: tuple[Any, ...]
) -> Iterator[WorkerPool]:
    """Workers of the cluster, as long as the block lasts; what is left then is cancelled with the
    connection."""
    with _told_once(), connect_cluster(address) as client:
        # A task, not scattered data: the scheduler has it made again when the workers that hold it
        # are gone.
        sent = client.submit(pickle.loads, pickle.dumps(shared), pure=False) if shared else ()
        yield _OnDask(client, address, function, sent)


@contextmanager
def _told_once() -> Iterator[None]:
    """Dask logs the traceback of a lost connection; here it becomes one line."""
    log = logging.getLogger("distributed.client")
    before = log.level
    log.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        log.setLevel(before)


@dataclass(frozen=True)
class _OnDask:
    client: Client
    address: str
    function: Callable[..., Any]
    shared: Any

    def outcomes(self, tasks: Iterable[WorkerTask]) -> Generator[Outcome, None, None]:
        from joblib import Parallel, delayed, parallel_config

        calls = [delayed(run_task)(self.function, task, self.shared) for task in tasks]
        options = {"batch_size": 1, "pre_dispatch": "all", "return_as": "generator_unordered"}
        with parallel_config(_backend(self.client, self.address)):
            stream = Parallel(n_jobs=-1, **options)(calls)
        with cancel_after(stream):
            # `yield from` would close the stream itself, and joblib warn.
            for outcome in stream:  # noqa: UP028
                yield outcome


def _backend(client: Client, address: str) -> Any:
    from distributed import KilledWorker
    from joblib._dask import DaskDistributedBackend  # imports Dask

    class Backend(DaskDistributedBackend):  # type: ignore[misc]
        """joblib's, which waits for ever for a task that Dask gives up, and knows nothing of a lost
        scheduler."""

        def effective_n_jobs(self, n_jobs: int) -> int:
            """At least 2: a cluster of one thread joblib would not use, and work in this
            process."""
            return max(2, int(super().effective_n_jobs(n_jobs)))

        def submit(self, func: Any, callback: Callable[[Any], None]) -> Future[Any]:
            future: Future[Any] = super().submit(func, callback)
            number = func.items[0][1][1].number

            def tell(done: Future[Any]) -> None:
                if error := done.exception():
                    callback(_Failed(number, error))

            future.add_done_callback(tell)
            return future

        def retrieve_result_callback(self, out: Any) -> Any:
            if isinstance(out, _Failed):
                if isinstance(out.error, KilledWorker):
                    return [(out.number, WorkerDied())]
                raise out.error
            if isinstance(out, CancelledError):
                raise ValueError(
                    f"the Dask scheduler at {address} is gone; start it again and repeat"
                )
            return super().retrieve_result_callback(out)

    return Backend(client=client)


@dataclass(frozen=True)
class _Failed:
    number: int
    error: BaseException
