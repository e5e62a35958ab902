"""Rows into CSV, Parquet and JSON, batch by batch, so that memory does not grow with the rows.

A batch is a dictionary of columns of one length. A file grows under another name and takes its own
when it is whole.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol, TextIO

from ...files.atomic_write import atomic_file
from ...files.spreadsheet_guard import GuardedCsv

Batch = dict[str, list[Any]]


class _Writer(Protocol):
    """Takes batches of the same columns, and is closed."""

    def add(self, batch: Batch) -> None: ...

    def close(self) -> None: ...


class _Csv:
    def __init__(self, stream: TextIO) -> None:
        self._writer = GuardedCsv(stream, line_end="\n")
        self._header = False

    def add(self, batch: Batch) -> None:
        if not self._header:
            self._writer.write_row(batch)
            self._header = True
        self._writer.write_rows(zip(*batch.values(), strict=True))

    def close(self) -> None:
        pass


class _Json:
    """A list of objects, a row on a line."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._before = "[\n"

    def add(self, batch: Batch) -> None:
        for row in zip(*batch.values(), strict=True):
            finite = (
                None if isinstance(value, float) and not math.isfinite(value) else value
                for value in row
            )
            text = json.dumps(dict(zip(batch, finite, strict=True)), allow_nan=False, default=str)
            self._stream.write(self._before + text)
            self._before = ",\n"

    def close(self) -> None:
        self._stream.write("[]\n" if self._before == "[\n" else "\n]\n")


class _Parquet:
    def __init__(self, path: Path) -> None:
        self._path = path
        self._writer: Any = None

    def add(self, batch: Batch) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        if self._writer is None:
            table = pa.table(batch)
            # A column that is empty in the first batch may hold numbers later; text columns are
            # never numbers.
            fields = [
                f.with_type(pa.float64()) if pa.types.is_null(f.type) else f for f in table.schema
            ]
            self._writer = pq.ParquetWriter(self._path, pa.schema(fields), compression="zstd")
        self._writer.write_table(pa.table(batch, schema=self._writer.schema))

    def close(self) -> None:
        if self._writer is not None:
            self._writer.close()


_TEXT: dict[str, type[_Csv] | type[_Json]] = {".csv": _Csv, ".json": _Json}
ENDINGS = (".csv", ".parquet", ".json")


def check_columns(wanted: Iterable[str], available: Iterable[str]) -> None:
    """Raises `LookupError` for the first wanted column that is not there; it lists those that
    are."""
    columns = list(available)
    for name in wanted:
        if name not in columns:
            raise LookupError(f"no column {name!r}; columns: {', '.join(columns)}")


def write_stream(stream: TextIO, ending: str, batches: Iterable[Batch]) -> int:
    """Write ".csv" or ".json" to an open stream; returns the rows."""
    return _written(_TEXT[ending](stream), batches)


def write_batches(out: Path, batches: Iterable[Batch], *, empty: bool = False) -> int:
    """Write `out` as its ending says; returns the rows.

    Raises `ValueError` for another ending and, unless `empty`, where there are no rows.
    """
    ending = out.suffix.lower()
    if ending not in ENDINGS:
        raise ValueError(
            f"cannot write {out.name!r}; expected a name that ends in {' or '.join(ENDINGS)}"
        )
    with atomic_file(out) as partial, _opened(partial, ending) as writer:
        rows = _written(writer, batches)
        if not rows and not empty:
            raise ValueError(f"nothing to write to {out.name!r}: no row matches")
    return rows


@contextmanager
def _opened(path: Path, ending: str) -> Iterator[_Writer]:
    if ending == ".parquet":
        yield _Parquet(path)
        return
    with path.open("w", encoding="utf-8", newline="") as stream:
        yield _TEXT[ending](stream)


def _written(writer: _Writer, batches: Iterable[Batch]) -> int:
    rows = 0
    try:
        for batch in batches:
            writer.add(batch)
            rows += len(next(iter(batch.values())))
    finally:
        writer.close()
    return rows
