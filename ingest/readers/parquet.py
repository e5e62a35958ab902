"""Parquet: columns of a table, read by row group."""

from __future__ import annotations

from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .base import ReadingOptions, RecordingError, refuse_bomb
from .contents import RATE_NAMES, Array, Contents, name_and_unit, to_python
from .recording import ArrayReader

if TYPE_CHECKING:
    import pyarrow as pa
    import pyarrow.parquet as pq


class ParquetReader(ArrayReader):
    """`fs` is schema metadata or a column; a unit is field metadata `unit`, or in the column's name `force [N]`."""

    format = "parquet"
    suffixes = (".parquet", ".pq")

    def contents(self, path: Path, open_files: ExitStack, _: ReadingOptions) -> Contents:
        import pyarrow.parquet as pq

        file = open_files.enter_context(pq.ParquetFile(path, page_checksum_verification=True))
        stated = {to_python(k): to_python(v) for k, v in (file.schema_arrow.metadata or {}).items()}
        rate = next((stated.pop(key) for key in list(stated) if key.lower() in RATE_NAMES), None)
        header = {k: v for k, v in stated.items() if k not in ("pandas", "ARROW:schema")}
        fields = [f for f in file.schema_arrow if not f.name.startswith("__index_level_")]
        return Contents([_array(path, file, f) for f in fields], None if rate is None else _number(path, rate), header)


def _array(path: Path, file: pq.ParquetFile, field: pa.Field) -> Array:
    name, unit = name_and_unit(field.name)
    details = {to_python(k): to_python(v) for k, v in (field.metadata or {}).items()}
    dtype, rows = _dtype(field.type), file.metadata.num_rows
    refuse_bomb(path, name, rows, max(dtype.itemsize, 1))
    bounds = np.cumsum([0, *(file.metadata.row_group(i).num_rows for i in range(file.num_row_groups))])
    take = partial(_take, path, file, field.name, bounds)
    return Array(name, (rows,), dtype, take, unit=details.get("unit", unit))


def _take(
    path: Path, file: pq.ParquetFile, column: str, bounds: NDArray[np.int64], start: int, stop: int
) -> NDArray[Any]:
    """Samples of the row groups that `start:stop` touches."""
    groups = [i for i in range(len(bounds) - 1) if bounds[i] < stop and bounds[i + 1] > start]
    values = file.read_row_groups(groups, columns=[column]).column(column)
    if values.null_count and np.dtype(values.type.to_pandas_dtype()).kind != "f":
        raise RecordingError(f"{path.name}: {column!r} lacks {values.null_count} values; whole numbers cannot say NaN")
    offset = int(bounds[groups[0]]) if groups else start
    return np.array(values.to_numpy()[start - offset : stop - offset])


def _dtype(kind: pa.DataType) -> np.dtype[Any]:
    """The numpy dtype of real numbers; text, dates and structures are objects here."""
    import pyarrow as pa

    real = pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind)
    return np.dtype(kind.to_pandas_dtype()) if real else np.dtype(object)


def _number(path: Path, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise RecordingError(f"{path.name}: sampling rate is {text!r}; expected one number in hertz") from None
