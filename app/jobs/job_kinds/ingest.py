"""Campaign folders of the worker's machine into the store, and pulses extracted again; both find
what is stored already, so that a repeat adds what is missing.

Folders of uploads are made here, and only what was made here is ever removed, whatever a job's row
says.
"""

from __future__ import annotations

import shutil
import tempfile
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote, urlencode

from ..kind import Ending, JobForm, JobResult, Kind, NotHereError, RunningJob, ending_of

if TYPE_CHECKING:
    from ....ingest.storing.plan_link import PlanLinks
    from ....ingest.storing.report import IngestReport


_UPLOAD, _CHECKED = "pyroshock-upload-", "pyroshock-checked-"
#: A checked upload that nobody stored or discarded is removed after a day.
_KEPT_S = 24 * 3600.0


def make_scratch(*, dry_run: bool = False) -> Path:
    """A folder that nobody else can read; it outlives this process, so that another can take up
    what is in it.

    That of a dry run stays until it is stored or discarded; those of which nobody wanted anything
    for a day go now.
    """
    if dry_run:
        for old in Path(tempfile.gettempdir()).glob(f"{_CHECKED}*"):
            with suppress(OSError):  # another process removes it at the same time
                if time.time() - old.stat().st_mtime > _KEPT_S:
                    discard(old)
    return Path(tempfile.mkdtemp(prefix=_CHECKED if dry_run else _UPLOAD))


def is_scratch(path: Path) -> bool:
    """Whether `path` is such a folder of this machine."""
    here = Path(tempfile.gettempdir()).resolve()
    return (
        path.parent.resolve() == here
        and path.name.startswith((_UPLOAD, _CHECKED))
        and not path.is_symlink()
    )


def discard(path: Path) -> None:
    """Remove such a folder, whatever state it is in; another path is left alone."""
    if is_scratch(path):
        shutil.rmtree(path, ignore_errors=True)


def take_checked(arguments: IngestArguments) -> IngestArguments:
    """The arguments that store what a dry run has checked; its upload now goes when the ingest is
    over.

    Raises `LookupError` where the upload was stored or discarded meanwhile.
    """
    if arguments.scratch is None:
        return arguments
    checked = Path(arguments.scratch)
    kept = checked.with_name(checked.name.replace(_CHECKED, _UPLOAD, 1))
    try:
        if not is_scratch(checked) or kept == checked:
            raise FileNotFoundError(checked)
        checked.rename(kept)
    except OSError as error:
        raise LookupError(
            "the checked files were stored or discarded already; upload the folder again"
        ) from error
    return replace(
        arguments, folder=str(kept / Path(arguments.folder).relative_to(checked)), scratch=str(kept)
    )


@dataclass(frozen=True)
class IngestArguments:
    """`settings` as `ExtractionSettings.as_json`; `scratch` is an upload's own folder, gone once
    the job is over."""

    folder: str
    settings: Mapping[str, Any]
    plan: str | None = None
    scratch: str | None = None


def _ingest_do(work: RunningJob, arguments: IngestArguments) -> Ending:
    from ....ingest.extraction.settings import ExtractionSettings
    from ....ingest.load import ingest_folder
    from ....ingest.storing.plan_link import link_to_plan
    from ...operations.ingest.service import training_notes

    folder = _readable(work, arguments)
    report = ingest_folder(
        work.store, folder, ExtractionSettings(**arguments.settings), progress=work.step
    )
    links = link_to_plan(work.store, report.campaign, arguments.plan)
    report.findings += training_notes(work.store, report.campaign)
    if links is not None:
        report.findings += links.as_findings()
    data = report.as_json()
    return ending_of(
        JobResult(f"/campaigns/{quote(report.campaign, safe='')}", _words(report, links), data)
    )


def _readable(work: RunningJob, arguments: IngestArguments) -> Path:
    """The folder, where it lies in an upload or below what this worker may read."""
    folder = Path(arguments.folder).resolve()
    if arguments.scratch is not None:
        roots: tuple[Path, ...] = (
            (Path(arguments.scratch),) if is_scratch(Path(arguments.scratch)) else ()
        )
    else:
        roots = work.folders
    if not any(folder.is_relative_to(root.resolve()) for root in roots):
        raise NotHereError(f"this one may not read {folder} (pyroshock work --data FOLDER)")
    if not folder.is_dir():
        again = "upload it again" if arguments.scratch else "give it as it is called now"
        raise LookupError(f"no folder {str(folder)!r} any more; {again}")
    return folder


def _words(report: IngestReport, links: PlanLinks | None) -> str:
    aside = f"; {len(report.set_aside)} recordings set aside" if report.set_aside else ""
    linked = f"; plan {links.plan}: {links.done} runs done" if links is not None else ""
    return f"{report.campaign}: added {report.added_words}{aside}{linked}"


def _after(arguments: IngestArguments) -> None:
    if arguments.scratch is not None:
        discard(Path(arguments.scratch))


def _ingest_form(arguments: IngestArguments) -> JobForm:
    fields: dict[str, str | list[str]] = {
        name: str(arguments.settings[name])
        for name in ("segmentation", "threshold")
        if name in arguments.settings
    }
    fields["plan"] = arguments.plan or ""
    if arguments.scratch is not None:  # the files are chosen again: a page cannot
        return JobForm("/ingest", "upload", fields)
    return JobForm("/ingest", "by-path", {"path": arguments.folder, **fields})


INGEST = Kind("ingest", IngestArguments, _ingest_do, _after, _ingest_form)


def _check_do(work: RunningJob, arguments: IngestArguments) -> Ending:
    from ....ingest.extraction.settings import ExtractionSettings
    from ...operations.ingest.dry_run import dry_run
    from ...operations.ingest.service import IngestOptions

    folder = _readable(work, arguments)
    options = IngestOptions(
        ExtractionSettings(**arguments.settings), plan=arguments.plan, dry_run=True
    )
    checked = dry_run(work.store, folder, options, work.step)
    if checked.faults:
        _after(arguments)  # nobody can store it
    return ending_of(JobResult(f"/ingest/checks/{work.job}", checked.sentence, checked.as_json()))


#: Its upload stays, so that it can be stored.
CHECK = Kind("check", IngestArguments, _check_do, form=_ingest_form)


@dataclass(frozen=True)
class ExtractArguments:
    """`settings` as `ExtractionSettings.as_json`; what is left out is as usual."""

    campaign: str
    settings: Mapping[str, Any] = field(default_factory=dict)


def _do(work: RunningJob, arguments: ExtractArguments) -> Ending:
    from ....ingest.extraction.settings import ExtractionSettings
    from ....ingest.storing.reextraction import reextract

    report = reextract(
        work.store, arguments.campaign, ExtractionSettings(**arguments.settings), work.step
    )
    skipped_text = f"; {len(report.skipped)} recordings left as they were" if report.skipped else ""
    words = (
        f"{report.added} pulses extracted, {report.reused} earlier ones put back "
        f"in use{skipped_text}"
    )
    return ending_of(
        JobResult(f"/campaigns/{quote(arguments.campaign, safe='')}", words, report.as_json())
    )


#: Settings that the form of an extraction has; the others are as usual.
FIELDS = ("segmentation", "threshold", "smoothing", "event_share", "separation_s")


def _extract_form(arguments: ExtractArguments) -> JobForm:
    settings = {
        name: arguments.settings[name]
        for name in FIELDS
        if arguments.settings.get(name) is not None
    }
    return JobForm(f"/campaigns/{quote(arguments.campaign, safe='')}/extract?{urlencode(settings)}")


EXTRACT = Kind("extract", ExtractArguments, _do, form=_extract_form)
