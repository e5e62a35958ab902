"""The words of a PDF that ReportLab wrote, as far as they are ASCII: enough to see that a report
holds its parts."""

from __future__ import annotations

import base64
import re
import zlib

_STREAM = re.compile(
    rb"/Filter \[ /ASCII85Decode /FlateDecode \][^>]*>>\s*stream\r?\n(.*?)endstream", re.DOTALL
)
_SHOWN = re.compile(rb"\(((?:[^()\\]|\\.)*)\) Tj", re.DOTALL)


def pdf_text(pdf: bytes) -> str:
    """All that is shown, the lines joined by spaces."""
    shown = [word for stream in contents(pdf) for word in _SHOWN.findall(stream)]
    return " ".join(_unescaped(word) for word in shown)


def contents(pdf: bytes) -> list[bytes]:
    """The streams, unpacked."""
    return [
        zlib.decompress(base64.a85decode(b"<~" + packed.strip(), adobe=True))
        for packed in _STREAM.findall(pdf)
    ]


def pages(pdf: bytes) -> int:
    """How many there are."""
    return len(re.findall(rb"/Type /Page\b(?!s)", pdf))


def _unescaped(word: bytes) -> str:
    octal = re.sub(rb"\\([0-7]{3})", lambda found: bytes([int(found[1], 8)]), word)
    return re.sub(rb"\\(.)", rb"\1", octal).decode("latin-1")
