"""NumPy `.npy`: one vector, one matrix of columns, or one array of named fields, read in place."""

from __future__ import annotations

from contextlib import ExitStack
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .base import ReadingOptions, RecordingError
from .contents import Array, Contents
from .field_rules import used
from .recording import ArrayReader
from .stamps import as_time

_LONGEST_HEADER = 1 << 16


class NpyReader(ArrayReader):
    """A matrix (n, k) or (k, n) gives `data_1` to `data_k`, a vector `data`, unless columns are
    named. No pickles."""

    format = "npy"
    suffixes = (".npy",)
    fields = (
        used("descr", "the type of the numbers"),
        used("fortran_order", "the order of rows and columns"),
        used("shape", "rows and columns; names, units and rate are the laboratory's"),
    )

    def contents(self, path: Path, open_files: ExitStack, _: ReadingOptions) -> Contents:
        from numpy.lib import format as npy

        stream = open_files.enter_context(path.open("rb"))
        head = BytesIO(
            stream.read(_LONGEST_HEADER)
        )  # numpy makes room for whatever length a header declares
        version = npy.read_magic(head)
        read_header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
        shape, fortran_order, dtype = read_header(head)
        offset = head.tell()
        if dtype.hasobject:
            raise RecordingError(
                f"{path.name}: holds Python objects, which "
                f"are not read; expected an array of numbers"
            )
        needed, size = (
            offset + dtype.itemsize * int(np.prod(shape, dtype=object)),
            path.stat().st_size,
        )
        if size != needed or min(shape, default=0) < 0:
            raise RecordingError(
                f"{path.name}: has {size} bytes; shape {shape} of {dtype} needs {needed}"
            )

        def rows(first: int, last: int) -> NDArray[Any]:
            """Elements `first:last` in the order of the file."""
            stream.seek(offset + first * dtype.itemsize)
            return np.frombuffer(stream.read((last - first) * dtype.itemsize), dtype)

        return Contents([as_time(array) for array in _arrays(shape, fortran_order, dtype, rows)])


def _arrays(
    shape: tuple[int, ...], fortran_order: bool, dtype: np.dtype[Any], rows: Any
) -> list[Array]:
    if fortran_order:
        shape = shape[::-1]  # a transposed matrix holds the same columns
    if dtype.names is None:
        return [Array("data", shape, dtype, rows, nameless=True)]

    def field(name: str) -> Array:
        def take(start: int, stop: int) -> NDArray[Any]:
            return np.ascontiguousarray(rows(start, stop)[name])

        return Array(name, shape, dtype[name], take)

    return [field(name) for name in dtype.names]
