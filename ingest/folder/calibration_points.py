"""Points of a transducer's static calibration: `[channels.NAME.calibration]` of campaign.toml, and
tables of points."""

from __future__ import annotations

import datetime as dt
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...files.delimited_text import parse_number
from ...files.toml_text import key_problems
from ...signals.calibration import Calibration, fit_line
from ..errors import IngestError, parse_date, printable
from .tables import read_table

FILE = "campaign.toml"
_KEYS = ("points", "file", "date", "reference_u", "reading_u_v", "common_u")
#: Columns of a table of points: required, and optional ones.
COLUMNS, UNCERTAINTIES = ("reference", "reading_v"), ("reference_u", "reading_u_v")


@dataclass(frozen=True)
class CalibrationPoints:
    """References in the channel's unit and readings in volt, (n,), with standard uncertainties; 0
    where unstated."""

    reference: tuple[float, ...]
    reading_v: tuple[float, ...]
    reference_u: tuple[float, ...] | float = 0.0
    reading_u_v: tuple[float, ...] | float = 0.0

    def calibration(self, date: dt.date, common_u: float = 0.0) -> Calibration:
        """The line through the points. Raises `ValueError` as `fit_line`, and for a line without
        slope."""
        line = fit_line(self.reference, self.reading_v, self.reference_u, self.reading_u_v)
        if not abs(line.sensitivity) > 3 * line.sensitivity_u:
            raise ValueError(
                f"the readings do not follow the references: sensitivity {line.sensitivity:.4g} "
                f"with a standard uncertainty of {line.sensitivity_u:.2g}"
            )
        return Calibration(line, date, len(self.reference), common_u)


def read_points(
    path: Path, reference_u: float = 0.0, reading_u_v: float = 0.0
) -> CalibrationPoints:
    """A table with the columns `reference` and `reading_v`, and `reference_u` and `reading_u_v`
    where it has them.

    A column of uncertainties comes before `reference_u` and `reading_u_v`. Raises `IngestError`
    naming row and column.
    """
    try:
        header, lines = read_table(path, path.name)
    except FileNotFoundError as error:
        raise IngestError(
            f"{path}: no such file; expected a table with the columns {', '.join(COLUMNS)}"
        ) from error
    for column in COLUMNS:
        if column not in header:
            raise IngestError(f"{path.name}: no column {column!r}; expected {', '.join(COLUMNS)}")
    if unknown := sorted(set(header) - {*COLUMNS, *UNCERTAINTIES}):
        column_names = ", ".join((*COLUMNS, *UNCERTAINTIES))
        raise IngestError(
            f"{path.name}: unknown column {printable(unknown[0])}; known: {column_names}"
        )
    values: dict[str, list[float]] = {column: [] for column in header}
    for line, cells in lines:
        for column, text in cells.items():
            try:
                values[column].append(parse_number(text))
            except ValueError as error:
                raise IngestError(
                    f"{path.name}: row {line}, column "
                    f"{column!r}: {printable(text)}; expected a number"
                ) from error
    return CalibrationPoints(
        tuple(values["reference"]),
        tuple(values["reading_v"]),
        tuple(values["reference_u"]) if "reference_u" in values else reference_u,
        tuple(values["reading_u_v"]) if "reading_u_v" in values else reading_u_v,
    )


def stated_calibration(channel: Mapping[str, Any], where: str, folder: Path) -> Calibration | None:
    """`calibration` of a channel's table, whose name is `where`; None without it.

    Raises `IngestError` with the key, its value and what was expected, also where the channel
    states a sensitivity of its own beside the points.
    """
    table = channel.get("calibration")
    if table is None:
        return None
    where = f"{where}.calibration"
    if not isinstance(table, Mapping):
        raise IngestError(f"{FILE}: {where} is {printable(table)}; expected a table [{where}]")
    if problems := key_problems(table, _KEYS, f"{where}."):
        raise IngestError(*(f"{FILE}: {problem}" for problem in problems))
    for key in ("sensitivity", "offset_v"):
        if key in channel:
            raise IngestError(
                f"{FILE}: {where} gives {key}, which stands beside it; remove one of them"
            )
    if ("points" in table) == ("file" in table):
        raise IngestError(
            f"{FILE}: {where} needs points = [[reference, volt], ...] or file, one of them"
        )
    uncertainties = [_not_negative(table, key, where) for key in ("reference_u", "reading_u_v")]
    if "points" in table:
        points = CalibrationPoints(*_pairs(table["points"], where), *uncertainties)
    elif not isinstance(table["file"], str) or not table["file"].strip():
        raise IngestError(
            f"{FILE}: {where}.file is {printable(table['file'])}; expected the name of a file"
        )
    else:
        points = read_points(folder / table["file"], *uncertainties)
    date, common_u = _date(table, where), _not_negative(table, "common_u", where)
    try:
        return points.calibration(date, common_u)
    except ValueError as error:
        raise IngestError(f"{FILE}: {where}: {error}") from error


def _pairs(value: object, where: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    pairs = value if isinstance(value, Sequence) and not isinstance(value, str) else ()
    good = [
        pair
        for pair in pairs
        if isinstance(pair, list) and len(pair) == 2 and all(map(_is_number, pair))
    ]
    if not good or len(good) < len(pairs):
        raise IngestError(
            f"{FILE}: {where}.points is {printable(value)}; expected [[reference, volt], ...]"
        )
    return tuple(float(pair[0]) for pair in good), tuple(float(pair[1]) for pair in good)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _not_negative(table: Mapping[str, Any], key: str, where: str) -> float:
    value = table.get(key, 0.0)
    if not _is_number(value) or value < 0:
        raise IngestError(
            f"{FILE}: {where}.{key} is {printable(value)}; expected a "
            f"standard uncertainty of 0 or more"
        )
    return float(value)


def _date(table: Mapping[str, Any], where: str) -> dt.date:
    try:
        return parse_date(table.get("date"), "the day of the calibration")
    except ValueError as error:
        raise IngestError(f"{FILE}: {where}.date is {error}") from error
