"""A plate from a modal table: columns in memory, or `plate_modes.csv`."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ...array_types import Floats
from ...files.delimited_text import HeadedTable, decode_utf8, table_rows
from ...signals.modal_table import SHAPE, modal_columns
from .modal import ModalPlate

_POINT = re.compile(r"shape_impact(?:_(\d+))?")


def modal_plate_from_table(columns: Mapping[str, Sequence[float] | Floats]) -> ModalPlate:
    """A plate from columns of equal length, a mode a row, in any order.

    Parameters:
        columns: Values of the modes (m,) by the name of the column. `frequency_hz`,
            `damping_ratio`, `shape_impact` (point "#1") and `shape_CHANNEL` for each sensor are as
            `plate_modes.csv` has them; `shape_impact_2` and so on are further points "#2". Other
            columns are ignored.

    Raises:
        ValueError: For a column that is missing or does not fit; the message names it.
    """
    values = {name: np.asarray(column, dtype=np.float64) for name, column in columns.items()}
    for name in ("frequency_hz", "damping_ratio", "shape_impact"):
        _column(values, name)
    points = {
        f"#{name_match[1] or 1}": name for name in values if (name_match := _POINT.fullmatch(name))
    }
    sensors = {name.removeprefix(SHAPE): name for name in values if _is_sensor(name)}
    if not sensors:
        raise ValueError(
            f"no column 'shape_CHANNEL', the shapes at a sensor; there are: {', '.join(values)}"
        )
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
    """A plate from a CSV file.

    Parameters:
        path: The file: UTF-8, comma, semicolon or tab, a header and a mode a row.

    Raises:
        ValueError: For a table that does not fit; the message names file, row, column and value.
        FileNotFoundError: Where there is no such file.
    """
    try:
        table = HeadedTable.of(table_rows(decode_utf8(path.read_bytes())))
        table.check()
        return modal_plate_from_table(modal_columns(table.header, table.lines))
    except ValueError as error:
        raise ValueError(f"{path.name}: {error}") from error


def _is_sensor(name: str) -> bool:
    return name.startswith(SHAPE) and len(name) > len(SHAPE) and not _POINT.fullmatch(name)


def _column(values: Mapping[str, Floats], name: str) -> Floats:
    if name not in values:
        raise ValueError(f"no column {name!r}; there are: {', '.join(values)}")
    if values[name].shape != values["frequency_hz"].shape:
        raise ValueError(
            f"column {name!r} has shape {values[name].shape}: expected that of frequency_hz"
        )
    return values[name]
