"""Parquet: columns of a table, read by row group."""

from __future__ import annotations

import json
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .base import ReadingOptions, RecordingError, refuse_bomb
from .contents import RATE_NAMES, Array, Contents, in_memory, is_time_name, name_and_unit, to_python
from .field_rules import FieldRule, harmless, used
from .recording import ArrayReader
from .stamps import as_time
from .statements import STATEMENT_RULES

if TYPE_CHECKING:
    import pyarrow as pa
    import pyarrow.parquet as pq


#: Of a frame whose index has no name.
_UNNAMED_INDEX = "__index_level_"
#: What Arrow itself writes beside a column.
_OF_ARROW = frozenset({"PARQUET:field_id"})
PARQUET_FIELDS: tuple[FieldRule, ...] = (
    *STATEMENT_RULES,
    used("sampl*_rate*", "the sampling rate"),
    used("fs_hz", "the sampling rate"),
    used("units", "the unit, as `unit` is"),
    used("pandas", "the index of a frame where it is time"),
    harmless("ARROW:*", "how the library wrote the file"),
    harmless("PARQUET:*", "how the library wrote the file"),
)


class ParquetReader(ArrayReader):
    """`fs` is schema metadata or a column; a unit is field metadata `unit`, or in the column's name
    `force [N]`."""

    format = "parquet"
    suffixes = (".parquet", ".pq")
    fields = PARQUET_FIELDS

    def contents(self, path: Path, open_files: ExitStack, options: ReadingOptions) -> Contents:
        import pyarrow.parquet as pq

        file = open_files.enter_context(pq.ParquetFile(path, page_checksum_verification=True))
        stated = {to_python(k): to_python(v) for k, v in (file.schema_arrow.metadata or {}).items()}
        rate = next((stated.pop(key) for key in list(stated) if key.lower() in RATE_NAMES), None)
        header = {k: v for k, v in stated.items() if k not in ("pandas", "ARROW:schema")}
        columns = [f for f in file.schema_arrow if not f.name.startswith(_UNNAMED_INDEX)]
        arrays = [_array(path, file, field) for field in columns]
        if not any(array.is_time for array in arrays):
            with_rate = rate is not None or options.sampling_rate_hz is not None
            arrays += _index(path, file, stated.get("pandas"), with_rate)
        rate_hz = None if rate is None else _number(path, rate)
        return Contents(arrays, rate_hz, header, statements={"": header}, rules=self.fields)


def _index(path: Path, file: pq.ParquetFile, pandas_says: Any, with_rate: bool) -> list[Array]:
    """The index of a pandas frame where it is time: dates, durations, a range that is named so,
    and, to be held against the rate that is stated, numbers without a name."""
    fields = [f for f in file.schema_arrow if f.name.startswith(_UNNAMED_INDEX)]
    if len(fields) == 1:
        array = replace(_array(path, file, fields[0]), name="time")
        dated = as_time(array) is not array or array.dtype.kind in "mM"
        return [as_time(array)] if dated or (with_rate and array.dtype.kind == "f") else []
    described = json.loads(pandas_says).get("index_columns", []) if pandas_says else []
    ranges = [
        index for index in described if isinstance(index, dict) and index.get("kind") == "range"
    ]
    if len(ranges) != 1 or not is_time_name(str(ranges[0].get("name"))):
        return []
    limits = [int(ranges[0][key]) for key in ("start", "stop", "step")]
    refuse_bomb(path, str(ranges[0]["name"]), len(range(*limits)), 8)
    return [in_memory(str(ranges[0]["name"]), np.arange(*limits, dtype=np.float64))]


def _array(path: Path, file: pq.ParquetFile, field: pa.Field) -> Array:
    name, unit = name_and_unit(field.name)
    details = {to_python(k): to_python(v) for k, v in (field.metadata or {}).items()}
    dtype, rows = _dtype(field.type), file.metadata.num_rows
    refuse_bomb(path, name, rows, max(dtype.itemsize, 1))
    bounds = np.cumsum(
        [0, *(file.metadata.row_group(i).num_rows for i in range(file.num_row_groups))]
    )
    take = partial(_take, path, file, field.name, bounds)
    array = Array(
        name,
        (rows,),
        dtype,
        take,
        unit=details.get("unit", details.get("units", unit)),
        fields={key: value for key, value in details.items() if key not in _OF_ARROW},
        obstacle=None if dtype.kind != "O" else f"is of the type {field.type}; save it as float64",
    )
    return as_time(array)


def _take(
    path: Path, file: pq.ParquetFile, column: str, bounds: NDArray[np.int64], start: int, stop: int
) -> NDArray[Any]:
    """Samples of the row groups that `start:stop` touches."""
    groups = [i for i in range(len(bounds) - 1) if bounds[i] < stop and bounds[i + 1] > start]
    values = file.read_row_groups(groups, columns=[column]).column(column)
    if values.null_count and _dtype(values.type).kind != "f":
        raise RecordingError(
            f"{path.name}: {column!r} lacks {values.null_count} values; whole "
            f"numbers cannot say NaN"
        )
    offset = int(bounds[groups[0]]) if groups else start
    return np.array(values.to_numpy()[start - offset : stop - offset])


def _dtype(kind: pa.DataType) -> np.dtype[Any]:
    """The numpy dtype of real numbers, dates and durations; text, decimals and structures are
    objects here."""
    import pyarrow as pa

    if pa.types.is_timestamp(kind):
        return np.dtype(f"M8[{kind.unit}]")
    if pa.types.is_duration(kind):
        return np.dtype(f"m8[{kind.unit}]")
    real = pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind)
    return np.dtype(kind.to_pandas_dtype()) if real else np.dtype(object)


def _number(path: Path, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise RecordingError(
            f"{path.name}: sampling rate is {text!r}; expected one number in hertz"
        ) from None
