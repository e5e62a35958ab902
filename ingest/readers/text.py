"""Text recordings: decoded strictly, and whole to the last line end."""

from __future__ import annotations

from pathlib import Path

from .base import RecordingError


def read_text(path: Path, *, may_lack_last_end: bool = False) -> str:
    """The file's text, line ends as `\\n`. Raises `RecordingError` unless it is whole UTF-8.

    A last line without line end may be cut inside its last number, which nothing in the file would show; it is
    refused unless `may_lack_last_end`.
    """
    raw = path.read_bytes()
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise RecordingError(f"{path.name}: is UTF-16 text; expected UTF-8: save it again as UTF-8")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise RecordingError(
            f"{path.name}: byte {error.start} (0x{raw[error.start]:02x}) is not UTF-8: save the file again as UTF-8"
        ) from error
    if "\0" in text:
        raise RecordingError(f"{path.name}: has a zero byte at {raw.index(0)}; expected text")
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    if not text.endswith("\n") and not may_lack_last_end:
        raise RecordingError(
            f"{path.name}: its last line has no line end, so its last number may be cut; "
            "add a line end if the file is whole"
        )
    return text
