"""`work`: a worker for the long work that was asked for."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator

from ...schema.person_roles import ADMINISTRATOR
from ..operations.fields import Presentation, Texts, quantity, request_field
from ..operations.laboratory import Laboratory
from ..operations.operation import Operation, Outcome, Progress, Request

#: Shorter, and a busy machine loses jobs that it is at work on.
_SHORTEST_LEASE_S = 1.0
_ENDLESS = "It does jobs until it is stopped, on the machine where it was started."


def _long_enough(seconds: float) -> float:
    if not seconds >= _SHORTEST_LEASE_S:
        raise ValueError(f"lease is {seconds:g}s; expected {_SHORTEST_LEASE_S:g}s or more")
    return seconds


def _existing(folders: tuple[str, ...]) -> tuple[str, ...]:
    for folder in folders:
        if not Path(folder).is_dir():
            raise ValueError(f"folders is '{folder}'; expected a folder that exists")
    return folders


class WorkerStart(Request):
    """How a worker works."""

    once: bool = request_field(
        False, help="End when no job waits and no dead worker has left a job."
    )
    lease: Annotated[quantity("s"), AfterValidator(_long_enough)] = request_field(  # type: ignore[valid-type]
        30.0,
        help="Give the job of a worker that was silent for this time to the next worker. "
        "[default: 30s]",
        example="30s",
        presentation=Presentation(metavar="SECONDS"),
    )
    folders: Annotated[Texts, AfterValidator(_existing)] = request_field(
        (),
        help="Allow campaigns below this folder to be ingested by their path. The option can be "
        "repeated. [default: the current folder]",
        presentation=Presentation(metavar="DIRECTORY", option="data"),
    )


def _work(request: WorkerStart, laboratory: Laboratory, _: Progress) -> Outcome:
    from .worker import Worker

    worker = Worker(
        laboratory.store,
        laboratory.db,
        lease_s=request.lease,
        folders=tuple(map(Path, request.folders)) or (Path.cwd(),),
        tell=laboratory.tell,
    )
    laboratory.tell(f"pyroshock: {worker.hand.name} works")
    with _ended_as_by_hand():
        count = worker.run(once=request.once)
    return Outcome((f"{count} job{'' if count == 1 else 's'}",), {"jobs": count})


@contextmanager
def _ended_as_by_hand() -> Iterator[None]:
    """A service manager's SIGTERM is Ctrl-C: what is in hand goes back."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


WORK: Operation[WorkerStart, Outcome] = Operation(
    name="work",
    role=ADMINISTRATOR,
    unrecorded=True,
    request=WorkerStart,
    run=_work,
    help="""Do the long work that was asked for (see `pyroshock jobs`): ingests, diagnoses,
trainings and tunings.

Start it on any machine that reaches the store, as many times as jobs are to run at once. Ctrl-C
gives the current job back. A worker that is killed loses its job to the next one after --lease, and
the job begins again.""",
    example="pyroshock work --once",
    steps="",
    creates_store=True,
    absent=dict.fromkeys(("json", "form", "python"), _ENDLESS),
)
