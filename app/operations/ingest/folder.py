"""Read a campaign folder into the store, or check it, which stores nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from sqlalchemy import select

from ....schema.campaigns import Plan
from ....schema.person_roles import OPERATOR
from ..faults import FieldError
from ..laboratory import Laboratory
from ..machine_paths import scratches_of
from ..operation import FormPage, Operation, Progress
from ..upload_folders import discard
from .request import FolderIngest, FolderReading

if TYPE_CHECKING:
    from .dry_run import DryRun
    from .service import IngestedCampaign


def _knows_plan(request: FolderReading, laboratory: Laboratory) -> None:
    """Raises `FieldError` for a plan that is not in the store, where the folder is read later."""
    if request.plan is None or laboratory.folders is None:
        return
    with laboratory.store.reading() as session:
        if session.scalar(select(Plan.id).where(Plan.name == request.plan)) is None:
            raise FieldError(
                "plan",
                f"The store has no plan {request.plan!r}; leave the field empty, or make the plan "
                "first.",
            )


def folder_name(request: FolderReading) -> str:
    """The last part of the folder's path."""
    return Path(request.path.path).name


def _check(request: FolderReading, laboratory: Laboratory, progress: Progress) -> DryRun:
    from .dry_run import dry_run, written_texts

    folder = request.path.readable(laboratory)
    checked = dry_run(laboratory.store, folder, request, progress, processes=laboratory.processes)
    if request.path.form is not None:
        # the files stay for a correction in the form, and their texts for whoever wants them later
        return replace(checked, written=written_texts(folder))
    if checked.faults:
        for scratch in scratches_of(request):  # nobody can store it
            discard(scratch)
    return checked


_BY_INGEST = "It is asked for as an ingest with `dry_run`."

CHECK: Operation[FolderReading, DryRun] = Operation(
    name="check",
    role=OPERATOR,
    unrecorded=True,
    request=FolderReading,
    run=_check,
    check=_knows_plan,
    help="Check a campaign folder: everything that would be stored and all that is wrong; nothing "
    "is stored.",
    long=True,
    steps="recordings",
    on_this_machine=True,
    keeps_uploads=True,
    job_page="/ingest/checks/{job}",
    label=folder_name,
    form=FormPage("/ingest", "by-path", "", "upload"),
    absent={"command": _BY_INGEST, "json": _BY_INGEST, "form": _BY_INGEST, "python": _BY_INGEST},
)


def _ingest(request: FolderIngest, laboratory: Laboratory, progress: Progress) -> IngestedCampaign:
    from .service import ingest_into

    return ingest_into(
        laboratory.store,
        request.path.readable(laboratory),
        request,
        progress,
        processes=laboratory.processes,
        dry_run=request.dry_run,
    )


INGEST: Operation[FolderIngest, IngestedCampaign] = Operation(
    name="ingest",
    request=FolderIngest,
    run=_ingest,
    check=_knows_plan,
    help="""Read campaign folders into the store, which is made if there is none.

A recording that is already stored is not stored again, so that a second call completes a campaign,
also after the first one was killed. A damaged recording is set aside with its reason, and a
discarded one stays out. Runs of a plan are marked as done, and what does not match the plan is
reported.""",
    example="pyroshock ingest results/rehearsal/ --dry-run\n"
    "pyroshock ingest examples/slow-valve/ --velocity-target-motion plate --db sqlite:///lab.db",
    route=("POST", "/ingest"),
    long=True,
    steps="recordings",
    creates_store=True,
    processes="Set the number of processes that read and extract; small files need only one.",
    on_this_machine=True,
    rehearsal=CHECK,
    label=folder_name,
    form=FormPage("/ingest", "by-path", "/ingest/path", "upload"),
)
