"""LabVIEW measurement file `.lvm`: text with a header per file and one per segment, or numbers alone."""

from __future__ import annotations

import re
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .base import ReadingOptions, RecordingError, rate_from_step
from .contents import Array, Contents, in_memory, one_line
from .csv import table_contents
from .recording import ArrayReader
from .text import read_text, sniff

#: LabVIEW prints Delta_X with seven digits.
_PRINTED_STEP = 5e-7
_SEPARATORS = {"Tab": "\t", "Comma": ","}


class LvmReader(ArrayReader):
    """One segment; `X_Columns` No or One. Several segments are refused: their gaps in time would be lost."""

    format = "lvm"
    suffixes = (".lvm",)

    def contents(self, path: Path, _: ExitStack, options: ReadingOptions) -> Contents:
        import lvm_read

        text = read_text(path)
        if not text.startswith("LabVIEW Measurement"):
            return _without_header(path, text, options)
        lines = text.splitlines(keepends=True)
        parsed = lvm_read.read_lines(lines, separator=_separator(path, lines))
        if parsed["Segments"] != 1 or "Channel names" not in parsed[0]:
            raise RecordingError(f"{path.name}: has {parsed['Segments']} segments; expected one, with channels")
        return Contents(_arrays(path, parsed, text), header=_header(parsed))


def _without_header(path: Path, text: str, options: ReadingOptions) -> Contents:
    """Numbers alone, as LabVIEW writes them with "no headers"; names and rate are the laboratory's."""
    lines = text[: 1 << 18].split("\n")[:-1]
    start = next((line.strip() for line in lines if line.strip()), "")
    if not re.match(r"[-+\d.,]|nan", start, re.IGNORECASE):
        raise RecordingError(
            f"{path.name}: starts with {one_line(start[:30])!r}; expected 'LabVIEW Measurement', or numbers alone"
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


def _arrays(path: Path, parsed: dict[Any, Any], text: str) -> list[Array]:
    segment = parsed[0]
    numbers, count = segment["data"], int(segment["Channels"])
    x_columns = parsed.get("X_Columns", "One")
    if x_columns not in ("No", "One"):
        raise RecordingError(f"{path.name}: X_Columns is {x_columns!r}; expected No or One")
    first = 1 if x_columns == "One" else 0
    names = segment["Channel names"][first : first + count]
    if numbers.ndim != 2 or numbers.shape[1] < first + count or len(names) != count:
        raise RecordingError(f"{path.name}: declares {count} channels, its lines hold {numbers.shape[-1] - first}")
    lengths = _lengths(path, parsed, len(numbers))
    columns = [numbers[: lengths[i], first + i] for i in range(count)]
    _refuse_unreadable(path, columns, text)
    clocks = [_clock(path, segment, i, numbers[: lengths[i], 0] if first else None) for i in range(count)]
    units = [*segment.get("Y_Unit_Label", []), *[""] * count]
    return [in_memory(names[i], np.ascontiguousarray(columns[i]), unit=units[i], **clocks[i]) for i in range(count)]


def _lengths(path: Path, parsed: dict[Any, Any], rows: int) -> list[int]:
    """Samples of each channel, as declared. Raises `RecordingError` unless the longest is as long as the table.

    With one heading for many writes (`Multi_Headings No`) LabVIEW declares the samples of the first write only.
    """
    count = int(parsed[0]["Channels"])
    declared = [int(samples) for samples in parsed[0].get("Samples", [])[:count]]
    longest = max(declared, default=0)
    if len(declared) != count or longest == 0:
        raise RecordingError(f"{path.name}: declares samples {declared} for {count} channels; expected one each")
    if parsed.get("Multi_Headings") == "No" and rows % longest == 0 and min(declared) == longest:
        return [rows] * count
    if rows != longest:
        raise RecordingError(f"{path.name}: declares {longest} samples and holds {rows}; it is cut or damaged")
    return declared


def _refuse_unreadable(path: Path, columns: list[NDArray[np.float64]], text: str) -> None:
    """lvm_read turns every field that it cannot read into NaN: there must be no more of them than the file wrote."""
    missing = sum(int(np.count_nonzero(np.isnan(column))) for column in columns)
    if missing == 0:
        return
    written = text[text.index("X_Value") :].lower().count("nan")
    if missing > written:
        raise RecordingError(f"{path.name}: {missing - written} fields are not numbers; a line is cut or damaged")


def _clock(path: Path, segment: dict[str, Any], channel: int, times: NDArray[np.float64] | None) -> dict[str, Any]:
    """From Delta_X and X0, else from the X column."""
    steps, starts = segment.get("Delta_X", []), segment.get("X0", [])
    if channel < len(steps) and np.isfinite(steps[channel]):
        step = float(steps[channel])
        if step <= 0.0:
            raise RecordingError(f"{path.name}: Delta_X is {step} s; expected a step above 0")
        start = float(starts[channel]) if channel < len(starts) and np.isfinite(starts[channel]) else 0.0
        return {"rate_hz": rate_from_step(step, _PRINTED_STEP), "start_s": start}
    if times is None:
        raise RecordingError(f"{path.name}: has neither Delta_X nor an X column; expected one of them")
    return {"times_s": times}


def _header(parsed: dict[Any, Any]) -> dict[str, str]:
    return {key: value for key, value in parsed.items() if isinstance(key, str) and key and isinstance(value, str)}
