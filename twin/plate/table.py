"""A plate from a modal table: columns in memory, or `plate_modes.csv`.

The cells of a modal table as numbers; every refusal names file, row, column and value.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ...array_types import Floats
from .modal import ModalPlate

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


_POINT = re.compile(r"shape_impact(?:_(\d+))?")
_SHAPE = "shape_"


def modal_plate_from_table(columns: Mapping[str, Sequence[float] | Floats]) -> ModalPlate:
    """A plate from columns of equal length, a mode a row, in any order.

    `frequency_hz`, `damping_ratio`, `shape_impact` (point "#1") and `shape_CHANNEL` for each sensor are as
    `plate_modes.csv` has them; `shape_impact_2` and so on are further points "#2". Other columns have no say.
    Raises `ValueError` naming the column that is missing or does not fit.
    """
    values = {name: np.asarray(column, dtype=np.float64) for name, column in columns.items()}
    for name in ("frequency_hz", "damping_ratio", "shape_impact"):
        _column(values, name)
    points = {f"#{name_match[1] or 1}": name for name in values if (name_match := _POINT.fullmatch(name))}
    sensors = {name.removeprefix(_SHAPE): name for name in values if _is_sensor(name)}
    if not sensors:
        raise ValueError(f"no column 'shape_CHANNEL', the shapes at a sensor; there are: {', '.join(values)}")
    order = np.argsort(values["frequency_hz"], kind="stable")
    return ModalPlate(
        frequency_hz=values["frequency_hz"][order],
        damping_ratio=_column(values, "damping_ratio")[order],
        shape_impact=np.array([_column(values, name)[order] for name in points.values()]),
        shapes=np.array([_column(values, name)[order] for name in sensors.values()]),
        impact_points=tuple(points),
        sensors=tuple(sensors),
    )


def read_modal_table(path: Path) -> ModalPlate:
    """A plate from a CSV file: UTF-8, comma, semicolon or tab, a header and a mode a row.

    Raises `ValueError` naming file, row, column and value, `FileNotFoundError` where there is none.
    """
    columns = numbers_of(path)
    modes = columns.get("mode", [])
    if twice := [mode for mode in modes if modes.count(mode) > 1]:
        raise ValueError(f"{path.name}: mode {twice[0]:g} stands twice")
    try:
        return modal_plate_from_table(columns)
    except ValueError as error:
        raise ValueError(f"{path.name}: {error}") from error


def _is_sensor(name: str) -> bool:
    return name.startswith(_SHAPE) and len(name) > len(_SHAPE) and not _POINT.fullmatch(name)


def _column(values: Mapping[str, Floats], name: str) -> Floats:
    if name not in values:
        raise ValueError(f"no column {name!r}; there are: {', '.join(values)}")
    if values[name].shape != values["frequency_hz"].shape:
        raise ValueError(f"column {name!r} has shape {values[name].shape}: expected that of frequency_hz")
    return values[name]
