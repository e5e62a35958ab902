"""Campaigns out of the store into a file of this machine, and back: each a job."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

from sqlalchemy import select

from ....schema.provenance import Tombstone
from ....training.registry.model_storage import storage_for
from ..kind import Ending, JobForm, JobResult, Kind, NotHereError, RunningJob, ending_of
from .ingest import discard, is_scratch


def archive_folder(db: str) -> Path:
    """Where this machine keeps archives of the store at `db`: beside the folder of its models."""
    models = storage_for(db, {}).folder
    return models.with_name(models.name.removesuffix("-models") + "-archives").absolute()


def kept_archive(db: str, path: str | None) -> Path | None:
    """The file of a tombstone, where it lies in that folder; another file is never read."""
    if path is None:
        return None
    file = Path(path)
    return (
        file if file.parent.resolve() == archive_folder(db).resolve() and file.is_file() else None
    )


@dataclass(frozen=True)
class ArchiveArguments:
    """The campaign that leaves the store, and why."""

    campaign: str
    reason: str


def _archive(work: RunningJob, arguments: ArchiveArguments) -> Ending:
    from ...operations.ingest.archiving import archive_campaign

    folder = archive_folder(work.db)
    folder.mkdir(parents=True, exist_ok=True)
    out = folder / f"{quote(arguments.campaign, safe='')[:150]}-{work.job}.pyroshock"
    if not work.store.read(
        lambda session: _is_archived(session, out)
    ):  # an earlier attempt may have done it
        archive_campaign(
            work.store, work.db, arguments.campaign, out, arguments.reason, _steps(work, "rows")
        )
    return ending_of(
        JobResult(
            "/deleted", f"Campaign {arguments.campaign} was archived in {out}.", {"file": str(out)}
        )
    )


def _is_archived(session: Any, out: Path) -> bool:
    return (
        session.scalar(select(Tombstone.id).where(Tombstone.archive_path == str(out.resolve())))
        is not None
    )


def _steps(work: RunningJob, noun: str) -> Any:
    """Progress of an export as the row of a job tells it."""

    def step(done: int, total: int, *what: Any) -> None:
        work.step(done, total, " ".join(map(str, what)) or noun)

    return step


def _archive_form(arguments: ArchiveArguments) -> JobForm:
    address = f"/campaigns/{quote(arguments.campaign, safe='')}/archive"
    return JobForm(address, "removal", {"reason": arguments.reason})


ARCHIVE = Kind("archive", ArchiveArguments, _archive, form=_archive_form)


@dataclass(frozen=True)
class RestoreArguments:
    """A file of the archive folder, or one in the `scratch` of an upload."""

    file: str
    scratch: str | None = None


def _restore(work: RunningJob, arguments: RestoreArguments) -> Ending:
    from ...operations.ingest.archiving import restore_campaign

    file = Path(arguments.file)
    if arguments.scratch is not None:
        allowed = (
            is_scratch(Path(arguments.scratch))
            and file.parent.resolve() == Path(arguments.scratch).resolve()
        )
    else:
        allowed = kept_archive(work.db, arguments.file) is not None
    if not allowed:
        raise NotHereError(f"this worker may not read {file}, or it is not there any more")

    def restored() -> JobResult:
        stone = restore_campaign(work.store, file)
        campaign = stone["campaign"]
        words = f"Campaign {campaign} is in the store again, {sum(stone['added'].values())} rows."
        return JobResult(
            f"/campaigns/{quote(campaign, safe='')}", " ".join([words, *stone["notes"]]), stone
        )

    return restored


def _after_restore(arguments: RestoreArguments) -> None:
    if arguments.scratch is not None:
        discard(Path(arguments.scratch))


#: The page has the buttons of the kept archives, and the form for another file.
RESTORE = Kind("restore", RestoreArguments, _restore, _after_restore, lambda _: JobForm("/deleted"))
