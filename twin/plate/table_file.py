"""The cells of a modal table as numbers; every refusal names file, row, column and value."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path

_INFINITY = math.inf
#: What is expected of a column, and its range: from the first number to below the second.
_EXPECTED = {
    "frequency_hz": ("a frequency of zero or more", 0.0, _INFINITY),
    "damping_ratio": ("a ratio from 0 to below 1", 0.0, 1.0),
}
_ANY = ("a finite number", -_INFINITY, _INFINITY)


def numbers_of(path: Path) -> dict[str, list[float]]:
    """Columns by name. A number may have a decimal comma where the delimiter is another one."""
    lines = _lines(path)
    if len(lines) < 2:
        raise ValueError(f"{path.name}: {len(lines)} rows; expected a header and at least one mode")
    header = lines[0][1]
    for name in header:
        if not name or header.count(name) > 1:
            raise ValueError(f"{path.name}: column {name!r} in the header; expected names, each of them once")
    for row, cells in lines[1:]:
        if len(cells) != len(header):
            raise ValueError(f"{path.name}: row {row}: {len(cells)} cells; expected {len(header)} as in the header")
    used = [i for i, name in enumerate(header) if name in ("mode", *_EXPECTED) or name.startswith("shape_")]
    return {header[i]: [_number(path, row, header[i], cells[i]) for row, cells in lines[1:]] for i in used}


def _lines(path: Path) -> list[tuple[int, list[str]]]:
    """Line number and cells of every line that holds anything."""
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path.name}: byte {error.start} is not UTF-8; save the file as UTF-8") from error
    first = text.lstrip().split("\n", 1)[0]
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=max(",;\t", key=first.count))
    try:
        return [(reader.line_num, [c.strip() for c in cells]) for cells in reader if any(c.strip() for c in cells)]
    except csv.Error as error:
        raise ValueError(f"{path.name}: row {reader.line_num}: {error}") from error


def _number(path: Path, row: int, column: str, text: str) -> float:
    expected, low, high = _EXPECTED.get(column, _ANY)
    try:
        value = float(text.replace(",", ".") if "," in text and "." not in text else text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and low <= value < high):
        raise ValueError(f"{path.name}: row {row}, column {column!r}: {text!r}; expected {expected}")
    return value
