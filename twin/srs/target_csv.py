"""Targets from CSV: what a specification's table, or a spectrum that `pyroshock srs --out` wrote,
holds."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ...files.delimited_text import decode_utf8, parse_number, table_rows
from .standards import NASA_STD_7003, Tolerance
from .target import Target

Row = Mapping[str, str]

STANDARD_GRAVITY_M_S2 = 9.80665
#: Suffix of a level's column -> m/s2.
_UNITS = {"g": STANDARD_GRAVITY_M_S2, "m_s2": 1.0}
#: Words for a level, in order: where a file has several, the first of this list counts.
_LEVELS = ("level", "target", "nominal", "srs", "maximax", "acceleration", "amplitude")
_FREQUENCIES = ("frequency_hz", "freq_hz", "f_hz")
_DEFAULT = NASA_STD_7003
#: A side of the tolerance that is free.
_FREE = ("inf", "+inf", "infinity")
_TOLERANCES = ("tolerance_db", "upper_db", "lower_db")


def read_target(path: Path, tolerance: Tolerance | None = None) -> Target:
    """The target in a CSV file.

    Columns: `frequency_hz`; a level with its unit (`level_g`, `level_m_s2`, `maximax_m_s2`, ...);
    where wanted `tolerance_db`, or `upper_db` and `lower_db` (`inf`: that side is free). In place
    of a level, a row may give `slope_db_per_octave` from the row above. Header `Level (g)` is
    `level_g`; columns of other names are ignored; lines that begin with # are comments; `;` or
    tab may stand for the comma. Numbers may have a decimal comma, or thousands apart.

    Parameters:
        path: The file.
        tolerance: Overrides the file's tolerance; by default None, that of the file, or
            NASA-STD-7003A's where the file has none.

    Raises:
        ValueError: For a table that does not fit; the message names the file, the line, the value
            and what is expected.
        OSError: For a file that cannot be read.
    """
    return target_of_csv(path.read_bytes(), path.name, tolerance)


def target_of_csv(content: bytes, source: str, tolerance: Tolerance | None = None) -> Target:
    """`read_target` of a file's content.

    Parameters:
        content: The bytes of the file.
        source: What errors call the file.
        tolerance: Overrides the file's tolerance; by default None, that of the file, or
            NASA-STD-7003A's where the file has none.

    Raises:
        ValueError: As `read_target`.
    """
    columns, rows = _table(content, source)
    if "frequency_hz" not in columns:
        raise ValueError(f"{source}: no column frequency_hz; it has: {', '.join(columns)}")
    level, to_m_s2 = _level_column(source, columns)
    if len(rows) < 2:
        raise ValueError(f"{source}: {len(rows)} rows; expected two break points or more")
    frequency = [_number(source, line, row, "frequency_hz") for line, row in rows]
    levels: list[float] = []
    for (line, row), hz in zip(rows, frequency, strict=True):
        before = (frequency[len(levels) - 1], levels[-1]) if levels else None
        levels.append(_level(source, line, row, level, to_m_s2, hz, before))
    upper, lower = (_tolerances(source, rows, columns, name) for name in ("upper_db", "lower_db"))
    try:
        target = Target(
            np.asarray(frequency), np.asarray(levels), np.asarray(upper), np.asarray(lower)
        )
    except ValueError as error:
        raise ValueError(f"{source}: {error}") from error
    stated = any(name in columns for name in _TOLERANCES)
    return target.with_tolerance(tolerance or _DEFAULT) if tolerance or not stated else target


def _table(content: bytes, source: str) -> tuple[list[str], list[tuple[int, Row]]]:
    """Names of the columns, and the rows by name with their number in the file."""
    try:
        text_lines = decode_utf8(content).splitlines()
        # A comment becomes an empty line, so that the rows keep their numbers.
        text = "\n".join("" if line.lstrip().startswith("#") else line for line in text_lines)
        lines = table_rows(text, strict=True)
    except ValueError as error:
        raise ValueError(f"{source}: no CSV table in UTF-8: {error}") from error
    if not lines:
        raise ValueError(f"{source}: is empty; expected a header such as frequency_hz,level_g")
    columns = [_column(name) for name in lines[0][1]]
    rows: list[tuple[int, Row]] = []
    for number, row in lines[1:]:
        if len(row) != len(columns):
            raise ValueError(
                f"{source}, line {number}: {len(row)} fields; expected "
                f"{len(columns)}, as in the header"
            )
        rows.append((number, dict(zip(columns, row, strict=True))))
    return columns, rows


def _column(name: str) -> str:
    """`Level (g)` -> `level_g`, `Frequency [Hz]` -> `frequency_hz`, `maximax m/s²` ->
    `maximax_m_s2`."""
    plain = (
        name.strip()
        .lower()
        .replace("m/s^2", "m_s2")
        .replace("m/s2", "m_s2")
        .replace("m/s²", "m_s2")
    )
    plain = re.sub(r"[\s()\[\]_/]+", "_", plain).strip("_")
    return "frequency_hz" if plain in _FREQUENCIES else plain


def _level_column(source: str, columns: list[str]) -> tuple[str, float]:
    for word in _LEVELS:
        level_columns = [name for name in columns if name in {f"{word}_{unit}" for unit in _UNITS}]
        if len(level_columns) > 1:
            raise ValueError(
                f"{source}: {' and '.join(level_columns)} both give the level; expected one of them"
            )
        if level_columns:
            return level_columns[0], _UNITS[level_columns[0].removeprefix(f"{word}_")]
    bare = next((name for name in columns if name in _LEVELS), None)
    problem = (
        f"column {bare!r} has no unit" if bare else f"no column of levels in {', '.join(columns)}"
    )
    raise ValueError(f"{source}: {problem}; expected level_g or level_m_s2")


def _level(
    source: str,
    line: int,
    row: Row,
    column: str,
    to_m_s2: float,
    hz: float,
    before: tuple[float, float] | None,
) -> float:
    """m/s2, from the level or the slope since `before` (Hz, m/s2)."""
    if row[column] or not row.get("slope_db_per_octave"):
        return to_m_s2 * _number(source, line, row, column)
    if before is None:
        raise ValueError(f"{source}, line {line}: a slope without a row above; expected {column}")
    slope = _number(source, line, row, "slope_db_per_octave", signed=True)
    try:
        return before[1] * math.pow(10, slope * math.log2(hz / before[0]) / 20)
    except OverflowError as error:
        raise ValueError(
            f"{source}, line {line}: slope_db_per_octave is {row['slope_db_per_octave']!r}; "
            f"expected less: the level at {hz:g} Hz would be no number"
        ) from error


def _tolerances(
    source: str, rows: list[tuple[int, Row]], columns: list[str], side: str
) -> list[float]:
    """One side of every row, dB; -3 below the level is 3 below it. Free where the file gives the
    other side only."""
    name = side if side in columns else "tolerance_db" if "tolerance_db" in columns else None
    if name is None:
        return [math.inf] * len(rows)
    values = [
        _number(source, line, row, name, signed=side == "lower_db", finite=False)
        for line, row in rows
    ]
    return [abs(value) for value in values] if side == "lower_db" else values


def _number(
    source: str, line: int, row: Row, column: str, *, signed: bool = False, finite: bool = True
) -> float:
    """A cell's number, positive (0 allowed where infinity is) unless `signed`."""
    try:
        value = math.inf if row[column].lower() in _FREE else parse_number(row[column])
    except ValueError:
        value = math.nan
    good = not math.isnan(value) and (math.isfinite(value) or not finite)
    if not good or not (signed or value > 0 or (not finite and value == 0)):
        expected = "a number" if signed else "a positive number"
        raise ValueError(f"{source}, line {line}: {column} is {row[column]!r}; expected {expected}")
    return value
