"""What a file is, by its bytes and not by its name: pictures with their size, documents, text.

Nothing is decoded or unpacked: of a picture its header is read, of a ZIP file its list of names.
Whatever can hold a script that a browser runs (HTML, SVG, XML) is no kind that is known here.
"""

from __future__ import annotations

import re
import struct
import zipfile
from dataclasses import dataclass
from io import BytesIO

#: Names within a ZIP file that such a list may have: a longer list is read no further.
_MOST_NAMES = 20_000
_OFFICE = "application/vnd.openxmlformats-officedocument."
#: A name within an Office file -> the media type.
_OFFICE_PARTS = {
    "word/document.xml": f"{_OFFICE}wordprocessingml.document",
    "xl/workbook.xml": f"{_OFFICE}spreadsheetml.sheet",
    "ppt/presentation.xml": f"{_OFFICE}presentationml.presentation",
}
_OPEN_DOCUMENTS = tuple(
    f"application/vnd.oasis.opendocument.{kind}" for kind in ("text", "spreadsheet", "presentation")
)
#: Signs that no text has, in any encoding of one byte a letter.
_NO_TEXT = re.compile(rb"[\x00-\x08\x0e-\x1a\x1c-\x1f\x7f]")
#: How a document begins that a browser may run (HTML, SVG, XML with a style sheet).
_MARKUP = re.compile(r"\s*<[!?a-z]", re.IGNORECASE)
#: The first bytes of a file tell its kind; the names below tell it in words.
_KNOWN = (
    "JPEG, PNG, GIF and WebP pictures, PDF, text, CSV and Markdown, Word, Excel, PowerPoint and "
    "OpenDocument files, and ZIP"
)


@dataclass(frozen=True)
class MediaType:
    """The media type of a file; width and height in pixels of a picture."""

    name: str
    width_px: int | None = None
    height_px: int | None = None

    @property
    def pixels(self) -> int:
        """All pixels of a picture; 0 of anything else."""
        return (self.width_px or 0) * (self.height_px or 0)


class MediaTypeError(ValueError):
    """The bytes are of no kind that is known; the message says what was expected."""


def media_type_of(content: bytes) -> MediaType:
    """What the bytes of a file are.

    Parameters:
        content: The whole file.

    Returns:
        The media type; of a picture with its size, as its header says.

    Raises:
        MediaTypeError: For an empty file, markup that a browser may run, a picture without a size,
            and anything that is not known.

    Source:
        WHATWG, MIME Sniffing Standard, sections 6 and 7 (the first bytes of each kind).
    """
    if not content:
        raise MediaTypeError("it is empty")
    for begins, name, size_of in _PICTURES:
        if content.startswith(begins) and (name != "image/webp" or content[8:12] == b"WEBP"):
            return _picture(name, size_of(content))
    if content.startswith(b"%PDF-"):
        return MediaType("application/pdf")
    if content.startswith(b"PK\x03\x04"):
        return MediaType(_zipped(content))
    text = _text_of(content)
    if text is None:
        raise MediaTypeError(f"it is of no kind that is known; expected {_KNOWN}")
    if _MARKUP.match(text):
        raise MediaTypeError(
            "it is HTML, SVG or XML, in which a browser may run a script; print it to PDF, "
            "or put it into a ZIP file"
        )
    return MediaType("text/plain")


def _picture(name: str, size: tuple[int, int] | None) -> MediaType:
    if size is None or min(size) < 1:
        raise MediaTypeError(
            f"it begins as {name.removeprefix('image/').upper()} and is no whole picture; "
            "save it anew"
        )
    return MediaType(name, *size)


def _png_size(content: bytes) -> tuple[int, int] | None:
    """The chunk IHDR is the first (ISO/IEC 15948, 5.6)."""
    if content[12:16] != b"IHDR" or len(content) < 24:
        return None
    width, height = struct.unpack(">II", content[16:24])
    # PNG allows 2^31 - 1; the store keeps what an integer of four bytes holds
    return (width, height) if max(width, height) < 2**31 else None


def _gif_size(content: bytes) -> tuple[int, int] | None:
    return struct.unpack("<HH", content[6:10]) if len(content) >= 10 else None


#: Markers of JPEG that stand alone, and frames (ITU-T T.81, table B.1): C4, C8 and CC are none.
_ALONE = frozenset({0x01, *range(0xD0, 0xD8)})
_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}


def _jpeg_size(content: bytes) -> tuple[int, int] | None:
    """Height and width of the first frame; the segments before it are passed by their lengths."""
    at = 2
    while at + 9 <= len(content):
        if content[at] != 0xFF:
            return None
        marker = content[at + 1]
        if marker == 0xFF or marker in _ALONE:
            at += 1 if marker == 0xFF else 2
            continue
        if marker in _FRAMES:
            height, width = struct.unpack(">HH", content[at + 5 : at + 9])
            return width, height
        (length,) = struct.unpack(">H", content[at + 2 : at + 4])
        if length < 2 or marker in (0xD8, 0xD9, 0xDA):
            return None
        at += 2 + length
    return None


def _webp_size(content: bytes) -> tuple[int, int] | None:
    """By the kind of the first chunk: with features, lossy, lossless (RFC 9649, section 2)."""
    kind, head = content[12:16], content[20:30]
    if len(head) < 10:
        return None
    if kind == b"VP8X":
        return (
            int.from_bytes(head[4:7], "little") + 1,
            int.from_bytes(head[7:10], "little") + 1,
        )
    if kind == b"VP8 " and head[3:6] == b"\x9d\x01\x2a":
        width, height = struct.unpack("<HH", head[6:10])
        return width & 0x3FFF, height & 0x3FFF
    if kind == b"VP8L" and head[0] == 0x2F:
        bits = int.from_bytes(head[1:5], "little")
        return (bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1
    return None


_PICTURES = (
    (b"\xff\xd8\xff", "image/jpeg", _jpeg_size),
    (b"\x89PNG\r\n\x1a\n", "image/png", _png_size),
    (b"GIF87a", "image/gif", _gif_size),
    (b"GIF89a", "image/gif", _gif_size),
    (b"RIFF", "image/webp", _webp_size),
)


def _zipped(content: bytes) -> str:
    """A ZIP file by the names in it; nothing is unpacked but the word by which an OpenDocument
    file says what it is, which is not packed."""
    try:
        with zipfile.ZipFile(BytesIO(content)) as archive:
            names = archive.namelist()[:_MOST_NAMES]
            first = archive.infolist()[0] if names else None
    # zipfile raises these of a list that is damaged or made up: besides BadZipFile, of a field
    # that is too short, a name that is no text, and a place outside of the file
    except (zipfile.BadZipFile, struct.error, ValueError, NotImplementedError, OSError) as error:
        raise MediaTypeError(f"it begins as ZIP and cannot be read as one: {error}") from error
    if first is not None and first.filename == "mimetype":
        # OpenDocument 1.3, part 2, 3.3: the first entry, stored as it is, behind a head of 38 bytes
        word = content[38 : 38 + first.file_size if first.file_size < 100 else 38]
        stated = word.decode("ascii", "replace")
        if stated in _OPEN_DOCUMENTS:
            return stated
    return next((kind for name, kind in _OFFICE_PARTS.items() if name in names), "application/zip")


def _text_of(content: bytes) -> str | None:
    """The first letters of a text in UTF-8, UTF-16 with its mark, or one byte a letter; None of
    what is no text."""
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        try:
            return content.decode("utf-16")[:1000]
        except UnicodeDecodeError:  # two bytes that look like a mark begin other files, too
            return None
    if _NO_TEXT.search(content):
        return None
    return content[:4000].removeprefix(b"\xef\xbb\xbf").decode("utf-8", "replace")[:1000]
