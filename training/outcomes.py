"""What comes of trainings, one after the other or in processes of their own."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context, parent_process
from threading import Thread

from .fitting import Failure, Ground, attempted
from .records import Trained
from .tasks import Task

Outcome = Trained | Failure
Step = Callable[[int, int, str], None]


def outcomes(
    tasks: Sequence[Task], ground: Ground, jobs: int, step: Step, tell: Callable[[str], None]
) -> Iterator[tuple[Task, Outcome]]:
    """Each task with what came of it, as it is finished. Raises `ValueError` where a process was killed."""
    if jobs == 1:
        for done, task in enumerate(tasks):
            step(done, len(tasks), f"{task.model}, {task.split}")
            yield task, attempted(task, ground, tell)
    elif tasks:
        yield from _at_once(tasks, ground, jobs, step)
    step(len(tasks), len(tasks), "")


def _at_once(tasks: Sequence[Task], ground: Ground, jobs: int, step: Step) -> Iterator[tuple[Task, Outcome]]:
    context = get_context("spawn")  # a fork would inherit locks of torch's and MLflow's threads
    with ProcessPoolExecutor(jobs, mp_context=context, initializer=_begin, initargs=(ground,)) as pool:
        running: dict[Future[Outcome], Task] = {pool.submit(_outcome, task): task for task in tasks}
        try:
            while running:
                done = len(tasks) - len(running)
                step(done, len(tasks), ", ".join(task.model for task in list(running.values())[:jobs]))
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    yield running.pop(future), future.result()
        except BrokenProcessPool as error:
            raise ValueError("a training process was killed, for memory perhaps; repeat with --jobs 1") from error
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


_ground: Ground | None = None


def _begin(ground: Ground) -> None:
    """What every process of the pool keeps: the dataset; and one thread, for the pool has all cores at work."""
    global _ground
    _ground = ground
    _end_with_parent()
    _use_one_thread()


def _use_one_thread() -> None:
    import scipy.linalg  # noqa: F401 - brings a BLAS of its own, which is limited only where it is loaded
    from threadpoolctl import threadpool_limits

    os.environ["OMP_NUM_THREADS"] = "1"  # of libraries that are loaded later
    threadpool_limits(limits=1)


def _end_with_parent() -> None:
    """A killed parent cannot tell its pool to stop, and nobody would take what it still trains."""
    parent = parent_process()
    if parent is not None:
        Thread(target=_wait_and_exit, args=(parent.join,), daemon=True).start()


def _wait_and_exit(wait_for: Callable[[], None]) -> None:
    wait_for()
    os._exit(1)


def _outcome(task: Task) -> Outcome:
    assert _ground is not None
    return attempted(task, _ground)
