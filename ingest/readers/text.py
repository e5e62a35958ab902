"""Text recordings: decoded strictly, and whole to the last line end."""

from __future__ import annotations

import re
from pathlib import Path

from .base import RecordingError

_UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")
_UTF8_MARK = b"\xef\xbb\xbf"
#: A letter beyond ASCII as UTF-8 has it; Windows-1252 would spell nonsense with these bytes.
_UTF8_LETTER = re.compile(rb"[\xc2-\xdf][\x80-\xbf]|[\xe0-\xef][\x80-\xbf]{2}")


def read_text(path: Path, *, may_lack_last_end: bool = False) -> str:
    """The file's text, line ends as `\\n`. Raises `RecordingError` unless it is whole UTF-8, UTF-16 or Windows-1252.

    UTF-16 is known by its mark. What is no UTF-8 and has no letter of it is Windows-1252, which instruments write for
    `°` and `µ`. A last line without line end may be cut inside its last number, which nothing in the file would show;
    it is refused unless `may_lack_last_end`.
    """
    text = _decoded(path, path.read_bytes())
    if "\0" in text:
        raise RecordingError(f"{path.name}: has a zero byte at {text.index(chr(0))}; expected text")
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    if not text.endswith("\n") and not may_lack_last_end:
        raise RecordingError(
            f"{path.name}: its last line has no line end, so its last number may be cut; "
            "add a line end if the file is whole"
        )
    return text


def _decoded(path: Path, raw: bytes) -> str:
    if raw.startswith(_UTF16_MARKS):
        try:
            return raw.decode("utf-16")
        except UnicodeDecodeError as error:
            raise RecordingError(f"{path.name}: its UTF-16 text is cut or damaged at byte {error.start}") from error
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        damage = f"{path.name}: byte {error.start} (0x{raw[error.start]:02x}) is not UTF-8"
        if raw.startswith(_UTF8_MARK) or _UTF8_LETTER.search(raw):
            raise RecordingError(f"{damage}, and other bytes are; it is damaged: save the file again") from error
        try:
            return raw.decode("cp1252")
        except UnicodeDecodeError:
            raise RecordingError(f"{damage}, nor Windows-1252: save the file again as UTF-8") from error
