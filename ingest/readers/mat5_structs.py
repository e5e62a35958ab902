"""Structures of a MATLAB 5 file: the numbers of their fields, without the general reader's trust in nested counts.

MathWorks, "MAT-File Format" (level 5): a structure holds flags, dimensions and name, the length of a field's name, the
names, and then one matrix element a field.
"""

from __future__ import annotations

import math
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from .base import RecordingError, refuse_bomb
from .contents import Array, held
from .mat5_elements import COMPRESSED, HEAD_BYTES, MATRIX, byte_order, elements, tag

_STRUCT_CLASS, _CHAR_CLASS = 2, 4
#: MATLAB class of numbers -> dtype, and type of their bytes in the file -> dtype.
_CLASSES = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8"}
_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_COMPLEX, _LOGICAL = 0x0800, 0x0200
_DEEPEST, _MOST_FIELDS = 8, 4096
_INT32 = 5


def struct_arrays(path: Path) -> dict[str, list[Array]]:
    """By variable, the fields of every structure of one element, at any depth, as arrays of the group `variable/...`.

    Text is left out; a field that holds something else than real numbers cannot be a channel. Raises `RecordingError`
    where a nested count is false.
    """
    order, size, arrays_by_name = byte_order(path), path.stat().st_size, dict[str, list[Array]]()
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
                name, arrays = _structure(path, body[8 : 8 + declared], order, "", 0)
            except struct.error:
                raise _damaged(path) from None
            if arrays:
                arrays_by_name[name] = arrays
    return arrays_by_name


def _damaged(path: Path) -> RecordingError:
    return RecordingError(f"{path.name}: a structure does not hold what it declares; it is cut or damaged")


def _part(path: Path, body: bytes, position: int, order: str) -> tuple[int, bytes, int]:
    """(type, bytes, position of the next part). Raises `RecordingError` where `body` ends before the part does."""
    if position + 8 > len(body):
        raise _damaged(path)
    kind, count, content, after = tag(body, position, order)
    if len(content) != count:
        raise _damaged(path)
    return kind, content, after


def _head(path: Path, body: bytes, order: str) -> tuple[int, tuple[int, ...], str, int]:
    """(flags and class, shape, name, position of what follows) of a matrix element without its tag."""
    _, flags, position = _part(path, body, 0, order)
    _, dimensions, position = _part(path, body, position, order)
    _, name, position = _part(path, body, position, order)
    shape = struct.unpack(f"{order}{len(dimensions) // 4}i", dimensions[: len(dimensions) // 4 * 4])
    if len(flags) < 4 or len(shape) < 2 or min(shape) < 0:
        raise _damaged(path)
    return struct.unpack(f"{order}I", flags[:4])[0], shape, name.decode("latin1"), position


def _structure(path: Path, body: bytes, order: str, group: str, depth: int) -> tuple[str, list[Array]]:
    """Name and arrays of one structure; none of a row of structures, whose fields would be many of one name."""
    _, shape, name, position = _head(path, body, order)
    if math.prod(shape) != 1 or depth >= _DEEPEST:
        return name, []
    group = group or name
    kind, width_bytes, position = _part(path, body, position, order)
    _, names, position = _part(path, body, position, order)
    width = struct.unpack(f"{order}i", width_bytes[:4])[0] if kind == _INT32 and len(width_bytes) >= 4 else 0
    if width < 1 or len(names) % width or len(names) // width > _MOST_FIELDS:
        raise _damaged(path)
    arrays: list[Array] = []
    for start in range(0, len(names), width):
        label = names[start : start + width].split(b"\0")[0].decode("latin1")
        kind, field, position = _part(path, body, position, order)
        if kind != MATRIX:
            raise _damaged(path)
        arrays += _field(path, field, order, group, label, depth)
    return name, arrays


def _field(path: Path, field: bytes, order: str, group: str, label: str, depth: int) -> list[Array]:
    if not field:
        return [held(label, np.empty(0), group=group)]
    flags, shape, _, position = _head(path, field, order)
    kind = flags & 0xFF
    if kind == _STRUCT_CLASS:
        return _structure(path, field, order, f"{group}/{label}", depth + 1)[1]
    if kind == _CHAR_CLASS:
        return []
    if kind not in _CLASSES or flags & (_COMPLEX | _LOGICAL):
        return [held(label, np.empty(0, dtype=complex if flags & _COMPLEX else object), group=group)]
    stored, content, _ = _part(path, field, position, order)
    dtype = np.dtype(f"{order}{_TYPES.get(stored, 'V0')}")
    if dtype.itemsize == 0 or len(content) != math.prod(shape) * dtype.itemsize:
        raise _damaged(path)
    values: Any = np.frombuffer(content, dtype).astype(_CLASSES[kind])
    return [held(label, values.reshape(shape, order="F"), group=group)]
