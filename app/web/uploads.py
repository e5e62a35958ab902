"""An uploaded campaign, as its files or as one ZIP, into a scratch folder.

A name is what a stranger chose. What leaves the folder, hides, or unpacks to far more than was sent
is refused before anything is written (zip slip, CWE-22; zip bomb, CWE-409).
"""

from __future__ import annotations

import stat
import zipfile
from collections.abc import Sequence
from pathlib import Path, PurePosixPath
from typing import IO, Any

from fastapi.concurrency import run_in_threadpool
from starlette.datastructures import UploadFile
from starlette.requests import Request

from ..jobs.queue import JobView
from ..operations.faults import read
from ..operations.fields import without_presentation
from ..operations.form import read_form
from ..operations.ingest.describe import DESCRIBE, Description
from ..operations.ingest.folder import INGEST
from ..operations.laboratory import Laboratory
from ..operations.machine_paths import CARD, MachinePath
from ..operations.upload_folders import discard, make_scratch
from .jobs import Jobs, ask_operation
from .settings import Settings

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

    Returns the folder that holds the campaign.toml; where there is none, the folder that holds
    everything. Raises `UploadError`.
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
    cards = sorted(target.rglob(CARD), key=lambda path: len(path.parts))
    if not cards:
        if not any(path.suffix.lower() in _recorded_suffixes() for path in target.rglob("*")):
            raise UploadError(
                f"no {CARD} and no recording among the files; choose the campaign's folder, or "
                "the folder of its recordings"
            )
        return _common_folder(target)
    if len(cards) > 1 and len(cards[0].parts) == len(cards[1].parts):
        raise UploadError(f"{len(cards)} campaigns among the files; upload one at a time")
    return cards[0].parent


def _recorded_suffixes() -> set[str]:
    from ...ingest.readers import all_readers

    return {suffix for reader in all_readers() for suffix in reader.suffixes}


def _common_folder(target: Path) -> Path:
    """The innermost folder that holds all files: recordings that nobody has described yet."""
    folder = target
    while True:
        inside = [path for path in folder.iterdir() if not path.name.startswith("__MACOSX")]
        if len(inside) != 1 or not inside[0].is_dir():
            return folder
        # a folder of recordings below the campaign's own stays below it
        if inside[0].name.lower() in _PLAIN_FOLDERS and folder != target:
            return folder
        folder = inside[0]


#: What folders of recordings within a campaign's folder are called.
_PLAIN_FOLDERS = ("recordings", "data", "raw", "measurements")


def upload_form() -> dict[str, Any]:
    """The body of such a form in the OpenAPI description."""
    schema = without_presentation(INGEST.request.model_json_schema(mode="validation"))
    fields = {name: part for name, part in schema["properties"].items() if name != "path"}
    files = {"type": "array", "items": {"type": "string", "format": "binary"}}
    body = {"type": "object", "required": ["files"], "properties": {"files": files, **fields}}
    return {"requestBody": {"required": True, "content": {"multipart/form-data": {"schema": body}}}}


def _kept_for_form(scratch: Path, folder: Path) -> tuple[Path, Path]:
    """An upload under the name of one that stays, and the folder within it."""
    scratch_folder = make_scratch(dry_run=True)
    scratch_folder.rmdir()
    scratch.rename(scratch_folder)
    return scratch_folder, scratch_folder / folder.relative_to(scratch)


async def asked_of_upload(
    http: Request, laboratory: Laboratory, jobs: Jobs, settings: Settings
) -> JobView:
    """The job of an ingest whose form brings the `files` in place of the path; other controls are
    its fields. Recordings without a campaign.toml are read for the form of a campaign.

    Raises `UploadError`, `RequestError` and `FieldError`, and nothing is kept.
    """
    async with http.form(max_files=MOST_FILES) as form:
        texts: dict[str, list[str]] = {}
        for name, text in form.multi_items():
            if isinstance(text, str):
                texts.setdefault(name, []).append(text)
        sent = [
            (upload.filename or "", upload.file)
            for upload in form.getlist("files")
            if isinstance(upload, UploadFile)
        ]
        files = [file for file in sent if file[0]]
        is_dry_run = bool(texts.get("dry_run"))
        scratch = make_scratch(dry_run=is_dry_run)
        try:
            folder = await run_in_threadpool(unpacked, files, scratch, settings.max_upload_bytes)
            if not (folder / CARD).is_file():
                if not is_dry_run:  # its form keeps the files, as a check does
                    scratch, folder = _kept_for_form(scratch, folder)
                path = MachinePath(path=folder, scratch=scratch)
                described = read(Description, {"path": path}, "network")
                return await run_in_threadpool(ask_operation, DESCRIBE, described, laboratory, jobs)
            read_already = {"path": MachinePath(path=folder, scratch=scratch)}
            request = read_form(INGEST, texts, files=read_already)
            return await run_in_threadpool(ask_operation, INGEST, request, laboratory, jobs)
        except BaseException:  # an interruption, too, leaves no upload behind; it is raised again
            discard(scratch)
            raise
