"""The workers of a Ray cluster."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass
from tempfile import TemporaryDirectory
from typing import Any

from .errand import Died, Errand, Outcome, carried_out
from .hands import Hands, abandoned_after
from .working_directory import working_directory_closed


@contextmanager
def on_ray(address: str | None, function: Callable[..., Any], shared: tuple[Any, ...]) -> Iterator[Hands]:
    """Workers of the cluster; without an address, of one that is started on this machine for as long as it lasts."""
    import ray

    # Ray has its workers look for modules in the caller's working directory, unless it is told of another.
    with working_directory_closed(), TemporaryDirectory(prefix="pyroshock-") as nothing:
        options = {"include_dashboard": False} if address is None else {}
        try:
            ray.init(address, log_to_driver=False, runtime_env={"working_dir": nothing}, **options)
        except (OSError, ValueError) as error:
            raise ValueError(f"no Ray cluster answers at {address} ({error}); start one: ray start --head") from None
        try:
            yield _OnRay(function, Put(ray.put(shared)) if shared else ())
        finally:
            ray.shutdown()


@dataclass(frozen=True)
class Put:
    """What is shared, where Ray keeps it."""

    reference: Any

    def contents(self) -> tuple[Any, ...]:
        """By a worker."""
        import ray

        found: tuple[Any, ...] = ray.get(self.reference)
        return found


@dataclass(frozen=True)
class _OnRay:
    function: Callable[..., Any]
    shared: Any

    def outcomes(self, errands: Iterable[Errand]) -> Generator[Outcome, None, None]:
        from joblib import Parallel, delayed, parallel_config

        calls = [delayed(carried_out)(self.function, errand, self.shared) for errand in errands]
        options = {"batch_size": 1, "pre_dispatch": "all", "return_as": "generator_unordered"}
        with parallel_config(_backend()):
            stream = Parallel(n_jobs=-1, **options)(calls)
        with abandoned_after(stream):
            for outcome in stream:  # noqa: UP028 - `yield from` would close the stream itself, and joblib warn
                yield outcome


def _backend() -> Any:
    import ray
    from joblib.parallel import ParallelBackendBase

    class Backend(ParallelBackendBase):  # type: ignore[misc]
        """Ray's own for joblib gives no result before the last one is there, and waits for a worker that died."""

        supports_retrieve_callback = True
        references: dict[Any, int]

        def effective_n_jobs(self, n_jobs: int) -> int:  # noqa: ARG002 - all there are
            return max(2, int(ray.cluster_resources().get("CPU", 1)))

        def start_call(self) -> None:
            self.references = {}

        def submit(self, func: Any, callback: Callable[[Any], None]) -> Future[Any]:
            reference = ray.remote(_called).options(num_cpus=1).remote(func)
            number = func.items[0][1][1].number
            self.references[reference] = number
            future: Future[Any] = reference.future()
            future.add_done_callback(lambda done: callback((number, done)))
            return future

        def retrieve_result_callback(self, out: tuple[int, Future[Any]]) -> Any:
            number, done = out
            try:
                results, error = done.result()
            except ray.exceptions.WorkerCrashedError:
                return [(number, Died())]
            if error is not None:
                raise error
            return results

        def abort_everything(self, ensure_ready: bool = True) -> None:  # noqa: ARG002 - nothing has to be made ready
            for reference in self.references:
                ray.cancel(reference)

    return Backend()


def _called(func: Callable[[], Any]) -> tuple[Any, Exception | None]:
    """What the function gives or raises: Ray would wrap an error into one of its own."""
    try:
        return func(), None
    except Exception as error:  # noqa: BLE001 - raised again by whoever waits for the result
        return None, error
