"""NumPy `.npz`: arrays in a zip file, their shapes known from a few bytes each."""

from __future__ import annotations

import math
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .base import ReadingOptions, RecordingError, refuse_bomb
from .contents import Array, Contents, in_memory, lazy_array, to_python
from .recording import ArrayReader
from .stamps import as_time
from .statements import STATEMENT_RULES

if TYPE_CHECKING:
    from zipfile import ZipFile, ZipInfo

_LONGEST_TEXT_BYTES = 4096


class NpzReader(ArrayReader):
    """Never unpickles: object arrays are refused by name."""

    format = "npz"
    suffixes = (".npz",)
    fields = STATEMENT_RULES

    def contents(self, path: Path, open_files: ExitStack, _: ReadingOptions) -> Contents:
        from zipfile import ZipFile

        archive = open_files.enter_context(ZipFile(path))
        members = [m for m in archive.infolist() if m.filename.endswith(".npy")]
        arrays = [_array(path, archive, member) for member in members]
        texts = {a.name: to_python(a.take(0, a.samples)) for a in arrays if _is_text(a)}
        arrays = [as_time(a) for a in arrays if a.name not in texts]
        return Contents(arrays, header=texts, statements={"": texts}, rules=self.fields)


def _array(path: Path, archive: ZipFile, member: ZipInfo) -> Array:
    name = member.filename.removesuffix(".npy")
    shape, dtype, header_bytes = _declared(archive, member)
    samples = math.prod(shape)
    if dtype.hasobject:
        return in_memory(name, np.empty(0, dtype=object))
    refuse_bomb(path, name, samples, dtype.itemsize)
    if member.file_size != header_bytes + samples * dtype.itemsize:
        raise RecordingError(
            f"{path.name}: {name!r} holds {member.file_size - header_bytes} bytes; "
            f"shape {shape} of {dtype} needs {samples * dtype.itemsize}"
        )
    return Array(name, shape, dtype, lazy_array(partial(_load, archive, member)))


def _declared(archive: ZipFile, member: ZipInfo) -> tuple[tuple[int, ...], np.dtype[Any], int]:
    """Shape, dtype and header length of a `.npy` member, without its samples."""
    from numpy.lib import format as npy

    with archive.open(member) as stream:
        version = npy.read_magic(stream)
        read_header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
        shape, _, dtype = read_header(stream)
        return shape, dtype, stream.tell()


def _load(archive: ZipFile, member: ZipInfo) -> NDArray[Any]:
    from numpy.lib import format as npy

    with archive.open(member) as stream:
        values: NDArray[Any] = npy.read_array(stream, allow_pickle=False)
        stream.read(1)  # the checksum is compared at the member's end
    return values


def _is_text(array: Array) -> bool:
    return (
        array.dtype.kind in "US" and 0 < array.samples * array.dtype.itemsize <= _LONGEST_TEXT_BYTES
    )
