"""The files that pages are made of: compressed once, and kept by the browser.

A page names a file with the digest of its content. The browser asks for such an address once and
never again, and a new version of the file has another address.
"""

from __future__ import annotations

import gzip
import hashlib
import mimetypes
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from starlette.requests import Request
from starlette.responses import Response

FOLDER = Path(__file__).parent / "static"
#: A year, the longest that RFC 9111 knows.
_FOR_EVER = "public, max-age=31536000, immutable"
#: To be asked again with the digest, which a short answer confirms.
_ASK_AGAIN = "no-cache"


@dataclass(frozen=True)
class StaticFile:
    """A file as it is sent."""

    content: bytes
    compressed: bytes
    media_type: str
    digest: str


def static_file(content: bytes, name: str) -> StaticFile:
    """A file of this content; the ending of `name` tells its type."""
    media_type = mimetypes.guess_type(name)[0] or "application/octet-stream"
    return StaticFile(
        content,
        gzip.compress(content, 9, mtime=0),
        media_type,
        hashlib.sha256(content).hexdigest()[:16],
    )


@cache
def static_files() -> dict[str, StaticFile]:
    """All files of the folder by name."""
    return {
        path.name: static_file(path.read_bytes(), path.name) for path in sorted(FOLDER.iterdir())
    }


def static_address(name: str) -> str:
    """The address of a file's present content. Raises `KeyError` for one that is not there."""
    return f"/static/{name}?v={static_files()[name].digest}"


def send_static(request: Request, file: StaticFile) -> Response:
    """The file, compressed where the browser reads that; 304 where it has it."""
    tag = f'"{file.digest}"'
    headers = {
        "etag": tag,
        "vary": "accept-encoding",
        "cache-control": _FOR_EVER if request.query_params.get("v") == file.digest else _ASK_AGAIN,
    }
    if tag in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    content = file.content
    if "gzip" in request.headers.get("accept-encoding", ""):
        content, headers["content-encoding"] = file.compressed, "gzip"
    return Response(content, media_type=file.media_type, headers=headers)
