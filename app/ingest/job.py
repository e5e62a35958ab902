"""Campaign folders of the worker's machine into the store, and pulses extracted again; both find what is stored
already, so that a repeat adds what is missing.

Folders of uploads are made here, and only what was made here is ever removed, whatever a job's row says.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from ..jobs.kind import Ending, Kind, NotHereError, Result, RunningJob, ending_of

if TYPE_CHECKING:
    from ...ingest.plan_link import PlanLinks
    from ...ingest.report import IngestReport


_PREFIX = "pyroshock-upload-"


def make_scratch() -> Path:
    """A folder that nobody else can read; it outlives this process, so that another can take up what is in it."""
    return Path(tempfile.mkdtemp(prefix=_PREFIX))


def is_scratch(path: Path) -> bool:
    """Whether `path` is such a folder of this machine."""
    here = Path(tempfile.gettempdir()).resolve()
    return path.parent.resolve() == here and path.name.startswith(_PREFIX) and not path.is_symlink()


def discard(path: Path) -> None:
    """Remove such a folder, whatever state it is in; another path is left alone."""
    if is_scratch(path):
        shutil.rmtree(path, ignore_errors=True)


@dataclass(frozen=True)
class IngestArguments:
    """`settings` as `ExtractionSettings.as_json`; `scratch` is an upload's own folder, gone once the job is over."""

    folder: str
    settings: Mapping[str, Any]
    plan: str | None = None
    scratch: str | None = None


def _ingest_do(work: RunningJob, arguments: IngestArguments) -> Ending:
    from ...ingest.load import ingest_folder
    from ...ingest.plan_link import link_to_plan
    from ...ingest.settings import ExtractionSettings
    from .service import training_notes

    folder = _readable(work, arguments)
    report = ingest_folder(work.store, folder, ExtractionSettings(**arguments.settings), progress=work.step)
    links = link_to_plan(work.store, report.campaign, arguments.plan)
    report.findings += training_notes(work.store, report.campaign)
    if links is not None:
        report.findings += links.as_findings()
    data = report.as_json()
    return ending_of(Result(f"/campaigns/{quote(report.campaign, safe='')}", _words(report, links), data))


def _readable(work: RunningJob, arguments: IngestArguments) -> Path:
    """The folder, where it lies in an upload or below what this worker may read."""
    folder = Path(arguments.folder).resolve()
    if arguments.scratch is not None:
        roots: tuple[Path, ...] = (Path(arguments.scratch),) if is_scratch(Path(arguments.scratch)) else ()
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


INGEST = Kind("ingest", IngestArguments, _ingest_do, _after, lambda _: "/ingest")


@dataclass(frozen=True)
class ExtractArguments:
    """`settings` as `ExtractionSettings.as_json`; what is left out is as usual."""

    campaign: str
    settings: Mapping[str, Any] = field(default_factory=dict)


def _do(work: RunningJob, arguments: ExtractArguments) -> Ending:
    from ...ingest.reextraction import reextract
    from ...ingest.settings import ExtractionSettings

    report = reextract(work.store, arguments.campaign, ExtractionSettings(**arguments.settings), work.step)
    skipped_text = f"; {len(report.skipped)} recordings left as they were" if report.skipped else ""
    words = f"{report.added} pulses cut, {report.reused} earlier ones put back in use{skipped_text}"
    return ending_of(Result(f"/campaigns/{quote(arguments.campaign, safe='')}", words, report.as_json()))


EXTRACT = Kind(
    "extract", ExtractArguments, _do, form=lambda arguments: f"/campaigns/{quote(arguments.campaign, safe='')}"
)
