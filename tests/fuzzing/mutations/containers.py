"""Damage inside of containers whose checksums and lengths are made right again, so that a reader
looks further."""

from __future__ import annotations

import io
import struct
import warnings
import zipfile
import zlib
from collections.abc import Sequence
from random import Random

from fuzzing.mutations import binary

_COMPRESSED = 15
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)


def inside_zip(data: bytes, rng: Random, others: Sequence[bytes]) -> bytes:
    """A member damaged, renamed, doubled or left out, and zipped anew."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = [(m.filename, archive.read(m)) for m in archive.infolist()[:20]]
    except Exception:  # noqa: BLE001 - what is no ZIP any more is damaged as bytes
        return binary.damaged(data, rng, others)
    if members:
        at = rng.randrange(len(members))
        name, content = members[at]
        names = (
            name,
            name,
            "",
            "fs.npy",
            "time.npy",
            "x" * 300 + ".npy",
            "é\n.npy",
            "../x.npy",
            name.upper(),
        )
        changed = [(rng.choice(names), _npy(content, rng))]
        members[at : at + 1] = rng.choice((changed, changed, changed, changed * 2, []))
    out = io.BytesIO()
    with warnings.catch_warnings(), zipfile.ZipFile(out, "w", rng.choice(_METHODS)) as archive:
        warnings.simplefilter("ignore")  # of one name twice, which is meant
        for name, content in dict.fromkeys(members):
            archive.writestr(zipfile.ZipInfo(name), content)
    return out.getvalue()


def _npy(content: bytes, rng: Random) -> bytes:
    """The header's text with other words in their place, or any damage."""
    words = (
        b"<f8",
        b"<f4",
        b"|O",
        b"|b1",
        b"<U4",
        b"|S4",
        b">i2",
        b"<c16",
        b"<f16",
        b"<M8[s]",
        b"True",
        b"False",
    )
    sizes = (
        b"(96,)",
        b"(96, 1)",
        b"()",
        b"(0,)",
        b"(1,)",
        b"(-1,)",
        b"(9999999999999,)",
        b"(2, 48)",
        b"96",
        b"(" * 99,
    )
    for group in (words, sizes):
        old = next((word for word in group if word in content[:128]), None)
        if old is not None and rng.random() < 0.6:
            return content.replace(old, rng.choice(group), 1)
    return binary.damaged(content, rng, ())


def inside_mat(data: bytes, rng: Random, others: Sequence[bytes]) -> bytes:
    """One variable of a MATLAB 5 file damaged, under a right byte count, compressed or not."""
    elements = _elements(data)
    if not elements:
        return binary.damaged(data, rng, others)
    at = rng.randrange(len(elements))
    kind, body = elements[at]
    body = binary.damaged(_unpacked(kind, body), rng, ())
    if rng.random() < 0.5 or kind == _COMPRESSED:
        kind, body = _COMPRESSED, zlib.compress(struct.pack("<II", 14, len(body)) + body)
    elements[at : at + 1] = rng.choice(([(kind, body)], [(kind, body)], [(kind, body)] * 2))
    return data[:128] + b"".join(
        struct.pack("<II", kind, len(body)) + body for kind, body in elements
    )


def _elements(data: bytes) -> list[tuple[int, bytes]]:
    found, at = [], 128
    while at + 8 <= len(data):
        kind, size = struct.unpack_from("<II", data, at)
        found.append((kind, data[at + 8 : at + 8 + size]))
        at += 8 + size
    return found


def _unpacked(kind: int, body: bytes) -> bytes:
    if kind != _COMPRESSED:
        return body
    try:
        return zlib.decompressobj().decompress(body, binary.LONGEST)[8:]
    except zlib.error:
        return body
