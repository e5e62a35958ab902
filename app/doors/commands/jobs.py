"""`work` and `jobs`: a worker for long work, and a look at the queue."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from ..command_line.common import (
    data_option,
    db_option,
    format_cell,
    json_option,
    note,
    open_command_store,
    write_json,
)
from ..command_line.listed import Listing, listing_options
from ..command_line.nouns import noun_group
from ..command_line.options import confirm_deletion, deletion_options

#: Shorter, and a busy machine loses jobs that it is at work on.
_SHORTEST_LEASE_S = 1.0


@click.command()
@db_option
@click.option(
    "--once", is_flag=True, help="End when no job waits and no dead worker has left a job."
)
@click.option(
    "--lease",
    default="30s",
    show_default=True,
    metavar="SECONDS",
    help="Give the job of a worker that was silent for this time to the next worker.",
)
@data_option
def work(db: str, once: bool, lease: str, folders: tuple[Path, ...]) -> None:
    """Do the long work that was asked for (see `pyroshock jobs`): ingests, diagnoses, trainings and
    tunings.

    Start it on any machine that reaches the store, as many times as jobs are to run at once. Ctrl-C
    gives the current job back. A worker that is killed loses its job to the next one after --lease,
    and the job begins again.

    \b
    Example:
        pyroshock work --once
    """
    with open_command_store(db, create=True) as store:
        from ...jobs.worker import Worker

        worker = Worker(
            store, db, lease_s=_lease_s(lease), folders=folders or (Path.cwd(),), tell=note
        )
        note(f"pyroshock: {worker.hand.name} works")
        with _ended_as_by_hand():
            had = worker.run(once=once)
    note(f"{had} job{'' if had == 1 else 's'}")


@contextmanager
def _ended_as_by_hand() -> Iterator[None]:
    """A service manager's SIGTERM is Ctrl-C: what is in hand goes back."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _lease_s(text: str) -> float:
    from ...common.frames import parse_quantity

    seconds = parse_quantity(text, "s", "--lease")
    if not seconds >= _SHORTEST_LEASE_S:
        raise ValueError(f"--lease is {text}; expected {_SHORTEST_LEASE_S:g}s or more")
    return seconds


@click.command()
@db_option
@listing_options
@click.option(
    "--last",
    type=click.IntRange(1),
    default=20,
    show_default=True,
    help="List at most this number of jobs, the newest first.",
)
def list_(db: str, listing: Listing, last: int) -> None:
    """List the long work: which jobs wait, which run and where, and with which result they ended.

    \b
    Example:
        pyroshock jobs --last 50
    """
    with open_command_store(db) as store:
        from ...jobs.queue import list_jobs

        jobs = list_jobs(store, last)
    by_key = {job.key: job for job in jobs}
    listing.show([job.as_json() for job in jobs], "no jobs", lambda row: _row(by_key[row["id"]]))


def _row(job: Any) -> dict[str, Any]:
    progress = f"{job.done} of {job.total}" if job.total else None
    return {
        "id": job.key,
        "state": job.state,
        "what": job.label,
        "progress": progress,
        "worker": job.worker,
        "attempt": job.attempt or None,
        "told": " ".join((job.error or job.words or job.what or "").split()) or None,
    }


@click.command()
@click.argument("job", type=click.IntRange(1))
@db_option
@json_option
def show(job: int, db: str, json_to: str | None) -> None:
    """Show the job with number JOB: its state, its times, and its result or the error that ended
    it.

    \b
    Example:
        pyroshock jobs show 1
    """
    with open_command_store(db) as store:
        from ...jobs.queue import get_job

        row = get_job(store, job).as_json()
    if json_to is not None:
        write_json(row, json_to)
        return
    for key, value in row.items():
        click.echo(f"{key:24} {format_cell(value)}")


@click.command()
@click.argument("job", type=click.IntRange(1))
@db_option
@deletion_options
def delete(job: int, db: str, dry_run: bool) -> None:
    """Delete the job with number JOB from the list. What it has stored stays. A job that has not
    ended is refused.

    \b
    Example:
        pyroshock jobs stop 1
        pyroshock jobs delete 1 --yes
    """
    with open_command_store(db) as store:
        from ...jobs.queue import delete_job, ended_job

        what = f"job {job}, {ended_job(store, job).label}"
        if dry_run:
            note(f"{what}: can be deleted; nothing was deleted")
            return
        confirm_deletion(what)
        delete_job(store, job)
    note(f"{what}: deleted")


@click.command()
@click.argument("job", type=click.IntRange(1))
@db_option
def stop(job: int, db: str) -> None:
    """Ask JOB to end: at once if it waits, at its next step if it runs. What it has stored is
    complete.

    \b
    Example:
        pyroshock jobs stop 1
    """
    with open_command_store(db) as store:
        from ...jobs.claims import stop as stop_job

        job_record = stop_job(store, job)
    note(
        f"job {job}, {job_record.label}: "
        + (job_record.state if job_record.ended else "asked to stop")
    )


jobs = noun_group(
    list_,
    {"show": show, "stop": stop, "delete": delete},
    """List the long work; show, stop or delete a job. Without a command, list the jobs.

    \b
    Example:
        pyroshock jobs --last 50
    """,
)
