"""Structures of a MATLAB 5 file: the numbers of their fields, walked before anything is allocated,
without the general reader's trust in nested counts.

MathWorks, "MAT-File Format" (level 5): a 128-byte header, then elements, each an 8-byte tag (type,
byte count) and its bytes; a compressed element is a zlib stream of one other element. A matrix
element holds flags, dimensions, name and then the numbers, each again with a tag; a structure holds
flags, dimensions and name, the length of a field's name, the names, and then one matrix element a
field.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from .base import RecordingError, refuse_bomb
from .contents import Array, in_memory

_HEADER_BYTES = 128
MATRIX, COMPRESSED = 14, 15
#: Enough for the tags, dimensions and name (at most 63 characters) that precede the numbers.
HEAD_BYTES = 1024
_TYPE_BYTES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
_MAT5_ELEMENTS_CHAR_CLASS, _NUMERIC_CLASSES = 4, range(6, 16)
_COMPLEX_FLAG = 0x0800
_UTF8 = 16


def byte_order(path: Path) -> str:
    """`<` or `>` of a MATLAB 5 file. Raises `RecordingError` for anything else."""
    with path.open("rb") as file:
        header = file.read(_HEADER_BYTES)
    order = {b"IM": "<", b"MI": ">"}.get(header[126:128])
    # With a zero among the first four bytes scipy reads version 4, whatever the rest says.
    if order is None or 0 in header[:4] or struct.unpack(f"{order}H", header[124:126])[0] != 0x0100:
        raise RecordingError(
            f"{path.name}: is not a MATLAB file of version 5 or 7.3; save it with -v7 or -v7.3"
        )
    return order


def refuse_damaged(path: Path) -> set[str]:
    """The names of complex variables, which scipy's listing does not tell.

    Raises `RecordingError` unless every element lies whole in the file and holds as much as it
    declares.
    """
    order, size = byte_order(path), path.stat().st_size
    complex_names = set()
    with path.open("rb") as file:
        for kind, start, count in elements(path, file, order, size):
            file.seek(start - 8 if kind == MATRIX else start)
            head = file.read(min(count + 8, HEAD_BYTES))
            if kind == COMPRESSED:
                head = zlib.decompressobj().decompress(head, HEAD_BYTES)
            name, is_complex = _refuse_false_count(path, head, order)
            if is_complex:
                complex_names.add(name)
    return complex_names


def elements(path: Path, file: BinaryIO, order: str, size: int) -> Iterator[tuple[int, int, int]]:
    """(type, first byte, byte count) of the top elements."""
    position = _HEADER_BYTES
    while position < size:
        file.seek(position)
        start = file.read(8)
        kind, count = struct.unpack(f"{order}II", start) if len(start) == 8 else (0, 0)
        if kind not in (MATRIX, COMPRESSED) or count == 0:
            raise RecordingError(
                f"{path.name}: no variable starts at byte "
                f"{position} of {size}; it is cut or damaged"
            )
        end = position + 8 + count
        if end > size:
            raise RecordingError(
                f"{path.name}: is cut: {size} bytes, and a variable ends at byte {end}"
            )
        yield kind, position + 8, count
        position = end


def _refuse_false_count(path: Path, head: bytes, order: str) -> tuple[str, bool]:
    """Name of a matrix and whether it is complex, once its byte count agrees with its dimensions.

    `head` starts with the matrix's own tag.
    """
    if len(head) < 16 or struct.unpack(f"{order}I", head[:4])[0] != MATRIX:
        raise RecordingError(f"{path.name}: a variable does not start as a matrix; it is damaged")
    flag_bytes, position = _element_bytes(path, head, 8, order)
    flags = struct.unpack(f"{order}I", flag_bytes[:4])[0]
    dimensions, position = _element_bytes(path, head, position, order)
    name_bytes, position = _element_bytes(path, head, position, order)
    name = name_bytes.decode("latin1")
    if flags & 0xFF == _MAT5_ELEMENTS_CHAR_CLASS or flags & 0xFF in _NUMERIC_CLASSES:
        shape = struct.unpack(f"{order}{len(dimensions) // 4}i", dimensions)
        if len(shape) < 2:
            raise RecordingError(
                f"{path.name}: {name!r} has {len(shape)} dimensions; expected two or more"
            )  # scipy crashes
        kind, count, _, _ = tag(head, position, order)
        samples, width = math.prod(shape), _TYPE_BYTES.get(kind, 0)
        refuse_bomb(path, name, samples, max(width, 1))
        is_utf8 = (
            flags & 0xFF == _MAT5_ELEMENTS_CHAR_CLASS and kind == _UTF8
        )  # one to four bytes per character
        most = samples * (4 if is_utf8 else width)
        if width == 0 or min(shape, default=0) < 0 or not samples * width <= count <= most:
            # An unknown type would crash scipy, not merely fail.
            raise RecordingError(
                f"{path.name}: {name!r} declares {samples} samples of {width} "
                f"bytes and holds {count} bytes"
            )
    return name, bool(flags & _COMPLEX_FLAG)


def _element_bytes(path: Path, head: bytes, position: int, order: str) -> tuple[bytes, int]:
    """The bytes of a part that precedes the numbers, and where the next begins: scipy believes any
    count there."""
    _, count, array_name, after = tag(head, position, order)
    if len(array_name) != count:
        raise RecordingError(
            f"{path.name}: a variable declares {count} bytes before its numbers; it is damaged"
        )
    return array_name, after


def tag(head: bytes, position: int, order: str) -> tuple[int, int, bytes, int]:
    """(type, byte count, bytes as far as `head` has them, position of the next tag); small elements
    share the tag."""
    first, second = struct.unpack_from(f"{order}II", head, position)
    if first >> 16:
        count = first >> 16
        return first & 0xFFFF, count, head[position + 4 : position + 4 + count], position + 8
    start = position + 8
    return first, second, head[start : start + second], start + (second + 7) // 8 * 8


_STRUCT_CLASS, _CHAR_CLASS = 2, 4
#: MATLAB class of numbers -> dtype, and type of their bytes in the file -> dtype.
_CLASSES = {
    6: "f8",
    7: "f4",
    8: "i1",
    9: "u1",
    10: "i2",
    11: "u2",
    12: "i4",
    13: "u4",
    14: "i8",
    15: "u8",
}
_TYPES = {
    1: "i1",
    2: "u1",
    3: "i2",
    4: "u2",
    5: "i4",
    6: "u4",
    7: "f4",
    9: "f8",
    12: "i8",
    13: "u8",
}
_COMPLEX, _LOGICAL = 0x0800, 0x0200
_DEEPEST, _MOST_FIELDS = 8, 4096
_INT32 = 5


Texts = dict[str, dict[str, str]]


def struct_arrays(path: Path) -> tuple[dict[str, list[Array]], Texts]:
    """By variable, the fields of every structure of one element, at any depth, as arrays of the
    group `variable/...`; and its texts by group and name.

    A field that holds something else than real numbers cannot be a channel. Raises `RecordingError`
    where a nested count is false.
    """
    order, size, arrays_by_name = byte_order(path), path.stat().st_size, dict[str, list[Array]]()
    texts: Texts = {}
    with path.open("rb") as file:
        for kind, start, count in elements(path, file, order, size):
            file.seek(start - 8 if kind == MATRIX else start)
            head = file.read(min(count + 8, HEAD_BYTES))
            if kind == COMPRESSED:
                head = zlib.decompressobj().decompress(head, 24)
            if len(head) < 24 or struct.unpack(f"{order}I", head[16:20])[0] & 0xFF != _STRUCT_CLASS:
                continue
            declared = struct.unpack(f"{order}I", head[4:8])[0]
            refuse_bomb(path, "a structure", declared, 1)
            file.seek(start if kind == COMPRESSED else start - 8)
            body = file.read(count if kind == COMPRESSED else count + 8)
            if kind == COMPRESSED:
                unpacked = zlib.decompressobj()
                body = unpacked.decompress(body, declared + 8)
                if not unpacked.eof and unpacked.decompress(unpacked.unconsumed_tail, 1):
                    raise _damaged(path)
            if len(body) < declared + 8:
                raise _damaged(path)
            try:
                name, arrays = _structure(path, body[8 : 8 + declared], order, "", 0, texts)
            except struct.error:
                raise _damaged(path) from None
            if arrays:
                arrays_by_name[name] = arrays
    return arrays_by_name, texts


def _damaged(path: Path) -> RecordingError:
    return RecordingError(
        f"{path.name}: a structure does not hold what it declares; it is cut or damaged"
    )


def _part(path: Path, body: bytes, position: int, order: str) -> tuple[int, bytes, int]:
    """(type, bytes, position of the next part). Raises `RecordingError` where `body` ends before
    the part does."""
    if position + 8 > len(body):
        raise _damaged(path)
    kind, count, content, after = tag(body, position, order)
    if len(content) != count:
        raise _damaged(path)
    return kind, content, after


def _head(path: Path, body: bytes, order: str) -> tuple[int, tuple[int, ...], str, int]:
    """(flags and class, shape, name, position of what follows) of a matrix element without its
    tag."""
    _, flags, position = _part(path, body, 0, order)
    _, dimensions, position = _part(path, body, position, order)
    _, name, position = _part(path, body, position, order)
    shape = struct.unpack(f"{order}{len(dimensions) // 4}i", dimensions[: len(dimensions) // 4 * 4])
    if len(flags) < 4 or len(shape) < 2 or min(shape) < 0:
        raise _damaged(path)
    return struct.unpack(f"{order}I", flags[:4])[0], shape, name.decode("latin1"), position


def _structure(
    path: Path, body: bytes, order: str, group: str, depth: int, texts: Texts
) -> tuple[str, list[Array]]:
    """Name and arrays of one structure; none of a row of structures, whose fields would be many of
    one name."""
    _, shape, name, position = _head(path, body, order)
    if math.prod(shape) != 1 or depth >= _DEEPEST:
        return name, []
    group = group or name
    kind, width_bytes, position = _part(path, body, position, order)
    _, names, position = _part(path, body, position, order)
    width = (
        struct.unpack(f"{order}i", width_bytes[:4])[0]
        if kind == _INT32 and len(width_bytes) >= 4
        else 0
    )
    if width < 1 or len(names) % width or len(names) // width > _MOST_FIELDS:
        raise _damaged(path)
    arrays: list[Array] = []
    for start in range(0, len(names), width):
        label = names[start : start + width].split(b"\0")[0].decode("latin1")
        kind, field, position = _part(path, body, position, order)
        if kind != MATRIX:
            raise _damaged(path)
        arrays += _field(path, field, order, group, label, depth, texts)
    return name, arrays


def _field(
    path: Path, field: bytes, order: str, group: str, label: str, depth: int, texts: Texts
) -> list[Array]:
    if not field:
        return [in_memory(label, np.empty(0), group=group)]
    flags, shape, _, position = _head(path, field, order)
    kind = flags & 0xFF
    if kind == _STRUCT_CLASS:
        return _structure(path, field, order, f"{group}/{label}", depth + 1, texts)[1]
    if kind == _CHAR_CLASS:
        text = _text(path, field, position, order)
        if text is not None:
            texts.setdefault(group, {})[label] = text
        return []
    if kind not in _CLASSES or flags & (_COMPLEX | _LOGICAL):
        return [
            in_memory(
                label, np.empty(0, dtype=complex if flags & _COMPLEX else object), group=group
            )
        ]
    stored, content, _ = _part(path, field, position, order)
    dtype = np.dtype(f"{order}{_TYPES.get(stored, 'V0')}")
    if dtype.itemsize == 0 or len(content) != math.prod(shape) * dtype.itemsize:
        raise _damaged(path)
    values: Any = np.frombuffer(content, dtype).astype(_CLASSES[kind])
    return [in_memory(label, values.reshape(shape, order="F"), group=group)]


_LONGEST_TEXT_BYTES = 8192
_ENCODINGS = {1: "latin1", 2: "latin1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}


def _text(path: Path, field: bytes, position: int, order: str) -> str | None:
    """A char array as one line; None for a long one, or of signs of an unknown type."""
    stored, content, _ = _part(path, field, position, order)
    encoding = _ENCODINGS.get(stored)
    if encoding is None or len(content) > _LONGEST_TEXT_BYTES:
        return None
    if encoding.startswith("utf-") and encoding != "utf-8":
        encoding += "-le" if order == "<" else "-be"
    return content.decode(encoding, "replace").strip()
