"""Files as people attach them: pictures that Pillow writes, documents that begin as real ones."""

from __future__ import annotations

import zipfile
from io import BytesIO

from PIL import Image


def picture(kind: str = "JPEG", size: tuple[int, int] = (64, 48), colour: str = "red") -> bytes:
    """A picture of one colour in a format of Pillow."""
    into = BytesIO()
    Image.new("RGB", size, colour).save(into, kind)
    return into.getvalue()


def zipped(**members: bytes) -> bytes:
    """A ZIP file; a double underscore in a name stands for a slash, a single one for a point."""
    into = BytesIO()
    with zipfile.ZipFile(into, "w") as archive:
        for name, content in members.items():
            archive.writestr(name.replace("__", "/").replace("_", "."), content)
    return into.getvalue()


def png_of_size(width: int, height: int) -> bytes:
    """A PNG that declares a size, and has hardly a byte of it."""
    import struct
    import zlib

    def chunk(kind: bytes, data: bytes) -> bytes:
        crc = zlib.crc32(kind + data)
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", crc)

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    data = zlib.compress(bytes(100))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


PDF = b"%PDF-1.7\n1 0 obj << /Type /Catalog >> endobj\n%%EOF\n"
HTML = b"<!doctype html><html><body><script>alert(1)</script></body></html>"
SVG = b'<svg xmlns="http://www.w3.org/2000/svg" onload="alert(1)"></svg>'
