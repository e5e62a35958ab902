"""An uploaded campaign, as its files or as one ZIP, into a scratch folder; and the folders of this
machine that may be ingested by their path.

A name is what a stranger chose. What leaves the folder, hides, or unpacks to far more than was sent
is refused before anything is written (zip slip, CWE-22; zip bomb, CWE-409).
"""

from __future__ import annotations

import stat
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path, PurePosixPath
from typing import IO, cast

from fastapi.concurrency import run_in_threadpool
from sqlalchemy import select
from starlette.datastructures import UploadFile
from starlette.requests import Request

from ...ingest.extraction.settings import ExtractionSettings, Segmentation
from ...schema.campaigns import Plan
from ...schema.session import Store
from ..jobs.job_kinds.ingest import CHECK, INGEST, IngestArguments, discard, make_scratch
from ..jobs.queue import JobView, this_host
from ..operations.faults import FieldError
from .jobs import Jobs
from .settings import Settings

FILE = "campaign.toml"
#: A tree of a million files is not walked through for a list of suggestions.
_DEPTH, _MOST = 3, 200


class PathError(ValueError):
    """A path is not one that may be read; nothing of it is told but what was given. `field`: of the
    form."""

    field = "path"


def confined(path: str, roots: Sequence[Path]) -> Path:
    """The folder behind a path, links followed, if it lies below one of `roots` and holds a
    campaign.

    Raises `PathError` otherwise, in the same words whether or not there is something outside.
    """
    if not roots:
        raise PathError(
            "no folder may be read: start with pyroshock serve --data "
            "FOLDER, or upload the campaign"
        )
    if "\0" in path:
        raise PathError(f"{path!r} is no path")
    for root in (root_path.resolve() for root_path in roots):
        try:
            resolved = (
                root / path
            ).resolve()  # a path that begins at the root of the disk stands for itself
        except (OSError, RuntimeError):
            continue
        if resolved.is_relative_to(root) and (resolved / FILE).is_file():
            return resolved
    root_names = ", ".join(str(root) for root in roots)
    raise PathError(f"{path!r} is no campaign folder (one with a {FILE}) below {root_names}")


def campaigns_below(roots: Sequence[Path]) -> list[str]:
    """Paths of campaign folders below `roots`, as `confined` takes them; the first 200."""
    campaigns = []
    for root in roots:
        for folder in _walked(root.resolve(), _DEPTH):
            campaigns.append(str(folder))
            if len(campaigns) == _MOST:
                return campaigns
    return campaigns


def _walked(folder: Path, depth: int) -> Iterator[Path]:
    try:
        if (folder / FILE).is_file():
            yield folder
            return
        below = (
            sorted(child for child in folder.iterdir() if child.is_dir() and not child.is_symlink())
            if depth
            else []
        )
    except OSError:
        return
    for child in below:
        if not child.name.startswith("."):
            yield from _walked(child, depth - 1)


MOST_FILES, LONGEST_PATH, DEEPEST = 20_000, 400, 8
#: Recordings pack to a third, text to a tenth; a bomb to a thousandth.
MOST_TIMES, SMALL_BYTES = 100, 10_000_000


class UploadError(ValueError):
    """An upload is refused, and nothing of it was kept; the message names the file and what was
    expected.

    `field`: of the form.
    """

    field = "files"


def unpacked(files: Sequence[tuple[str, IO[bytes]]], target: Path, most_bytes: int) -> Path:
    """Files as a browser sends them (name or path within the folder, content), written below
    `target`.

    Returns the folder that holds the campaign.toml. Raises `UploadError`.
    """
    if not files:
        raise UploadError("no file was sent; choose the campaign's folder, or its ZIP")
    if len(files) == 1 and files[0][0].lower().endswith(".zip"):
        _unzipped(files[0][1], target, most_bytes)
    else:
        _written(files, target, most_bytes)
    return _campaign(target)


def safe_path(name: str) -> PurePosixPath:
    """A relative path within a folder. Raises `UploadError` for any other."""
    path = PurePosixPath(name.replace("\\", "/"))
    bad = not name or len(name) > LONGEST_PATH or len(path.parts) > DEEPEST or path.is_absolute()
    if bad or any(_is_bad(part) for part in path.parts) or not path.parts:
        raise UploadError(f"{name!r:.120} is no file name within a campaign's folder")
    return path


def _is_bad(part: str) -> bool:
    # 255 bytes are what every file system takes
    too_long = len(part.encode("utf-8", "replace")) > 255
    odd = ":" in part or not part.isprintable() or part != part.strip()
    return part == ".." or too_long or odd or part.endswith(".")


def _written(files: Sequence[tuple[str, IO[bytes]]], target: Path, most_bytes: int) -> None:
    paths = _distinct([safe_path(name) for name, _ in files])
    remaining_bytes = most_bytes
    for path, (_, content) in zip(paths, files, strict=True):
        remaining_bytes = copy_file(content, target / path, remaining_bytes)


def _unzipped(content: IO[bytes], target: Path, most_bytes: int) -> None:
    try:
        with zipfile.ZipFile(content) as archive:
            members = [member for member in archive.infolist() if not member.is_dir()]
            paths = _distinct([_member_path(member) for member in members])
            packed, large = (
                sum(getattr(m, name) for m in members) for name in ("compress_size", "file_size")
            )
            if large > most_bytes or large > max(SMALL_BYTES, MOST_TIMES * packed):
                raise UploadError(
                    f"the ZIP unpacks to {large:,} bytes from "
                    f"{packed:,}; expected a campaign's recordings"
                )
            remaining_bytes = most_bytes
            for path, member in zip(paths, members, strict=True):
                with archive.open(member) as packed_file:
                    remaining_bytes = copy_file(packed_file, target / path, remaining_bytes)
    except UploadError:
        raise
    # zipfile, of a damaged archive: BadZipFile, NotImplementedError (another compression),
    # RuntimeError (a password), EOFError, zlib.error, ValueError (a place before the file),
    # IndexError, struct.error, OSError (too long a name).
    except Exception as error:
        raise UploadError(f"the ZIP cannot be read: {' '.join(str(error).split()):.200}") from error


def _member_path(member: zipfile.ZipInfo) -> PurePosixPath:
    kind = stat.S_IFMT(member.external_attr >> 16)
    if kind not in (0, stat.S_IFREG):
        raise UploadError(
            f"{member.filename!r:.120} in the ZIP is a link or a device; expected files"
        )
    return safe_path(member.filename)


def _distinct(paths: Sequence[PurePosixPath]) -> Sequence[PurePosixPath]:
    """Also where letters' case does not count, and no file is a folder of another's."""
    if len(paths) > MOST_FILES:
        raise UploadError(
            f"{len(paths):,} files; more than {MOST_FILES:,} go by pyroshock ingest FOLDER"
        )
    seen = {str(path).casefold() for path in paths}
    folders = {str(parent).casefold() for path in paths for parent in path.parents}
    if len(seen) != len(paths) or seen & folders:
        raise UploadError("two of the files have the same name")
    return paths


def copy_file(content: IO[bytes], path: Path, remaining_bytes: int) -> int:
    """Write `content` to the new file `path`; how many bytes may still come.

    The declared size may be wrong, hence they are counted. Raises `UploadError` where it is more
    than may come.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("xb") as out:
        while block := content.read(1 << 20):
            remaining_bytes -= len(block)
            if remaining_bytes < 0:
                raise UploadError(
                    "the files are larger than may be uploaded; pyroshock ingest FOLDER takes them"
                )
            out.write(block)
    return remaining_bytes


def _campaign(target: Path) -> Path:
    cards = sorted(target.rglob(FILE), key=lambda path: len(path.parts))
    if not cards:
        raise UploadError(f"no {FILE} among the files; it stands in the campaign's folder")
    if len(cards) > 1 and len(cards[0].parts) == len(cards[1].parts):
        raise UploadError(f"{len(cards)} campaigns among the files; upload one at a time")
    return cards[0].parent


def ingest_job(
    jobs: Jobs,
    store: Store,
    folder: Path,
    settings: ExtractionSettings,
    plan: str | None = None,
    scratch: Path | None = None,
    *,
    dry_run: bool = False,
) -> JobView:
    """Queue the ingest of `folder`, or its dry run; the result of an ingest is `command-line.md`'s
    JSON.

    `scratch` is removed however the ingest ends; that of a dry run is kept until somebody stores or
    discards it.
    """
    arguments = IngestArguments(
        str(folder), settings.as_json(), plan, None if scratch is None else str(scratch)
    )
    kind, label = (
        (CHECK, f"Check of {folder.name}") if dry_run else (INGEST, f"Ingest of {folder.name}")
    )
    return jobs.ask(store, kind, label, arguments, host=this_host())


async def uploaded(request: Request, store: Store, jobs: Jobs, settings: Settings) -> JobView:
    """The job for what a form brings: `files`, `plan`, settings of the extraction, and whether it
    is a `dry_run`.

    Raises `UploadError` and `FieldError`, and nothing is kept.
    """
    async with request.form(max_files=MOST_FILES) as form:
        plan, segmentation, threshold = (
            str(form.get(name) or "") for name in ("plan", "segmentation", "threshold")
        )
        chosen = extraction_settings(segmentation or "walk", threshold)
        plan_name = await run_in_threadpool(known_plan, store, plan)
        sent = [
            (upload.filename or "", upload.file)
            for upload in form.getlist("files")
            if isinstance(upload, UploadFile)
        ]
        files = [file for file in sent if file[0]]
        dry_run = bool(form.get("dry_run"))
        scratch = make_scratch(dry_run=dry_run)
        try:
            folder = await run_in_threadpool(unpacked, files, scratch, settings.max_upload_bytes)
            return ingest_job(jobs, store, folder, chosen, plan_name, scratch, dry_run=dry_run)
        except BaseException:  # an interruption, too, leaves no upload behind; it is raised again
            discard(scratch)
            raise


def extraction_settings(segmentation: str, threshold: str) -> ExtractionSettings:
    """Settings of a form's texts; an empty threshold is the usual one. Raises `FieldError` with the
    field."""
    usual = ExtractionSettings()
    try:
        share = float(threshold) if threshold.strip() else usual.threshold
    except ValueError as error:
        expected = "expected a share of the peak such as 0.005"
        raise FieldError(
            "threshold", f"threshold {threshold!r} is no number; {expected}"
        ) from error
    try:
        return ExtractionSettings(segmentation=cast(Segmentation, segmentation), threshold=share)
    except ValueError as error:
        raise FieldError(str(error).partition(" ")[0], str(error)) from error


def known_plan(store: Store, name: str) -> str | None:
    """The plan that a form names, None for an empty text. Raises `FieldError` for one that is not
    in the store."""
    wanted = name.strip()
    if not wanted:
        return None
    if (
        store.read(lambda session: session.scalar(select(Plan.id).where(Plan.name == wanted)))
        is None
    ):
        raise FieldError(
            "plan",
            f"The store has no plan {wanted!r}; leave the field empty, or make the plan first.",
        )
    return wanted
