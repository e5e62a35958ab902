"""LabVIEW measurement file `.lvm`: text with a header per file and one per segment, or numbers
alone."""

from __future__ import annotations

import re
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .base import ReadingOptions, RecordingError
from .contents import Array, Contents, in_memory, one_line
from .csv import table_contents
from .file_fields import is_harmless, refuse_unread_fields
from .lvm_axis import channel_clock, channel_starts
from .lvm_fields import LVM_FIELDS
from .recording import ArrayReader
from .text import read_text, sniff

#: What lvm_read makes of a segment beside its keys.
_NO_FIELDS = ("data", "Channel names", "comments", "")
_SEPARATORS = {"Tab": "\t", "Comma": ","}


class LvmReader(ArrayReader):
    """One segment; `X_Columns` No or One. Several segments are refused: their gaps in time would be
    lost.

    Several writes under one heading are read where an X column tells the gaps between them.
    Channels start by `Date`, `Time` and `X0`, in seconds after the earliest `Date` and `Time` of
    the segment.
    """

    format = "lvm"
    suffixes = (".lvm",)
    fields = LVM_FIELDS

    def contents(self, path: Path, _: ExitStack, options: ReadingOptions) -> Contents:
        import lvm_read

        text = read_text(path)
        if not text.startswith("LabVIEW Measurement"):
            return _without_header(path, text, options)
        lines = text.splitlines(keepends=True)
        parsed = lvm_read.read_lines(lines, separator=_separator(path, lines))
        if parsed["Segments"] != 1 or "Channel names" not in parsed[0]:
            raise RecordingError(
                f"{path.name}: has {parsed['Segments']} segments; expected one, with channels"
            )
        header = _header(parsed)
        refuse_unread_fields(path, self.fields, header, "the file", options)
        stated = {key: value for key, value in parsed[0].items() if key not in _NO_FIELDS}
        refuse_unread_fields(path, self.fields, stated, "the segment", options)
        return Contents(_arrays(path, parsed, text, options), header=header)


def _without_header(path: Path, text: str, options: ReadingOptions) -> Contents:
    """Numbers alone, as LabVIEW writes them with "no headers"; names and rate are the
    laboratory's."""
    lines = text[: 1 << 18].split("\n")[:-1]
    start = next((line.strip() for line in lines if line.strip()), "")
    if not re.match(r"[-+\d.,]|nan", start, re.IGNORECASE):
        raise RecordingError(
            f"{path.name}: starts with {one_line(start[:30])!r}; expected "
            f"'LabVIEW Measurement', or numbers alone"
        )
    layout = sniff(path, lines, options)
    if any(map(any, layout.above)):
        raise RecordingError(f"{path.name}: has text above its numbers, but no header of LabVIEW")
    return table_contents(path, text, layout)


def _separator(path: Path, lines: list[str]) -> str:
    """As the file's header names it."""
    for line in lines[:25]:
        if line.startswith("Separator"):
            word = line[len("Separator") :].strip(" \t\r\n,;") or "Tab"
            if word not in _SEPARATORS:
                raise RecordingError(f"{path.name}: Separator is {word!r}; expected Tab or Comma")
            return _SEPARATORS[word]
    return "\t"


def _arrays(path: Path, parsed: dict[Any, Any], text: str, options: ReadingOptions) -> list[Array]:
    segment = parsed[0]
    numbers, count = segment["data"], int(segment["Channels"])
    x_columns = parsed.get("X_Columns", "One")
    if x_columns not in ("No", "One"):
        raise RecordingError(f"{path.name}: X_Columns is {x_columns!r}; expected No or One")
    first = 1 if x_columns == "One" else 0
    names = segment["Channel names"][first : first + count]
    if numbers.ndim != 2 or numbers.shape[1] < first + count or len(names) != count:
        raise RecordingError(
            f"{path.name}: declares {count} channels, its lines hold {numbers.shape[-1] - first}"
        )
    lengths = _lengths(path, parsed, len(numbers), first == 1 or is_harmless("Samples", options))
    columns = [numbers[: lengths[i], first + i] for i in range(count)]
    _refuse_unreadable(path, columns, text)
    starts, zero = channel_starts(path, segment, count, options)
    times = [np.ascontiguousarray(numbers[:length, 0]) if first else None for length in lengths]
    clocks = [channel_clock(path, segment, i, count, times[i], starts[i]) for i in range(count)]
    units = [*segment.get("Y_Unit_Label", []), *[""] * count]
    headers = [{**clock.pop("header", {}), **zero} for clock in clocks]
    return [
        in_memory(
            names[i],
            np.ascontiguousarray(columns[i]),
            unit=units[i],
            header=headers[i],
            **clocks[i],
        )
        for i in range(count)
    ]


def _lengths(path: Path, parsed: dict[Any, Any], rows: int, gaps_known: bool) -> list[int]:
    """Samples of each channel, as declared. Raises `RecordingError` unless the longest is as long
    as the table.

    With one heading for many writes (`Multi_Headings No`) LabVIEW declares the samples of the first
    write only. Each write may have a trigger of its own, so that they are refused unless the gaps
    between them are known.
    """
    count = int(parsed[0]["Channels"])
    declared = [int(samples) for samples in parsed[0].get("Samples", [])[:count]]
    longest = max(declared, default=0)
    if len(declared) != count or longest == 0:
        raise RecordingError(
            f"{path.name}: declares samples {declared} for {count} channels; expected one each"
        )
    if parsed.get("Multi_Headings") == "No" and rows % longest == 0 and min(declared) == longest:
        if rows > longest and not gaps_known:
            raise RecordingError(
                f"{path.name}: holds {rows // longest} writes of {longest} samples under one "
                "heading and no X column, so that the gaps between them are not known; write it "
                "with one X column, or, where the writes follow each other without a gap, "
                'harmless_fields = ["Samples"] under [recordings] of campaign.toml '
                "(--harmless-field Samples of a command)"
            )
        return [rows] * count
    if rows != longest:
        raise RecordingError(
            f"{path.name}: declares {longest} samples and holds {rows}; it is cut or damaged"
        )
    return declared


def _refuse_unreadable(path: Path, columns: list[NDArray[np.float64]], text: str) -> None:
    """lvm_read turns every field that it cannot read into NaN: there must be no more of them than
    the file wrote."""
    missing = sum(int(np.count_nonzero(np.isnan(column))) for column in columns)
    if missing == 0:
        return
    written = text[text.index("X_Value") :].lower().count("nan")
    if missing > written:
        raise RecordingError(
            f"{path.name}: {missing - written} fields are not numbers; a line is cut or damaged"
        )


def _header(parsed: dict[Any, Any]) -> dict[str, str]:
    return {
        key: value
        for key, value in parsed.items()
        if isinstance(key, str) and key and isinstance(value, str)
    }
