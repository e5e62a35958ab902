"""`runs.csv`: one row per recorded impact or shot, every cell checked before anything is stored."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from ..schema.columns import BY_COLUMN, BY_NAME, parse_number
from ..schema.levels import Level, LevelError, MaterialNames, level_of
from .column_names import KEYS, MEASURED, RUNS_FILE, check_columns, suggestion
from .errors import IngestError
from .tables import Line, read_table
from .texts import LONGEST_NAME, shown

FILE = RUNS_FILE


@dataclass(frozen=True)
class RunRow:
    """A row of `runs.csv`. `line` is its line in the file; velocities in m/s, lengths in m."""

    line: int
    run: int
    repetition: int
    levels: tuple[Level, ...]
    recording: str | None = None
    impact_velocity_m_s: float | None = None
    impact_velocity_u_m_s: float | None = None
    measured_velocity_m_s: float | None = None
    measured_velocity_u_m_s: float | None = None
    bullet_length_m: float | None = None
    bullet_length_u_m: float | None = None
    laser_sampling_rate_hz: float | None = None
    levels_by_factor: Mapping[str, Level] = field(default_factory=dict, compare=False)

    def number(self, factor: str) -> float | None:
        level = self.levels_by_factor.get(factor)
        return level.number if level else None


_REQUIRED = {"hammer": KEYS, "gun": (*KEYS, "bullet_mass_kg", "tank_pressure_bar")}


def read_runs(
    folder: Path,
    kind: str,
    materials: MaterialNames,
    declared: Mapping[str, str] = MappingProxyType({}),
    confirmed: Collection[str] = (),
) -> tuple[RunRow, ...]:
    """Read and check `folder`/runs.csv. Raises `IngestError` with file, row, column, value and what was expected.

    Delimiter (comma, semicolon, tab) and decimal comma are recognised. Recordings must lie inside `folder` and exist.
    `declared` (with what they are) and `confirmed` are columns that are free factors though they resemble a known one.
    """
    header, lines = _table(folder)
    _check_header(header, kind)
    check_columns(header, declared, confirmed)
    rows = []
    seen: dict[tuple[int, int], int] = {}
    for line, cells in lines:
        row = _row(folder, line, cells, kind, materials)
        key = (row.run, row.repetition)
        if key in seen:
            raise IngestError(
                f"{FILE}: row {line}: duplicate run {row.run}, repetition {row.repetition}; see row {seen[key]}"
            )
        seen[key] = line
        rows.append(row)
    if not rows:
        raise IngestError(f"{FILE}: no rows; expected at least one recorded impact or shot")
    return tuple(rows)


def _table(folder: Path) -> tuple[list[str], list[Line]]:
    try:
        return read_table(folder / FILE, FILE)
    except FileNotFoundError as error:
        raise IngestError(f"{folder}: no {FILE}; a campaign folder needs one (docs/campaigns.md)") from error


def _check_header(header: list[str], kind: str) -> None:
    for column in _REQUIRED[kind]:
        if column not in header:
            needs = f"a {kind} campaign needs {', '.join(_REQUIRED[kind])}"
            raise IngestError(f"{FILE}: no column {column!r}; {needs}{suggestion(column, header)}")
    for column in header:
        if column in BY_NAME and column not in BY_COLUMN:
            raise IngestError(f"{FILE}: column {column!r} states no unit; expected {BY_NAME[column].column!r}")


def _row(folder: Path, line: int, cells: dict[str, str], kind: str, materials: MaterialNames) -> RunRow:
    levels = []
    measured: dict[str, float | None] = {}
    for column, text in cells.items():
        if len(text) > LONGEST_NAME:
            raise _refusal(line, column, text, f"at most {LONGEST_NAME} characters")
        if column in ("run", "repetition", "recording"):
            continue
        if column in MEASURED:
            name, scale, zero = MEASURED[column]
            measured[name] = _measurement(line, column, text, scale, zero)
        elif text:
            levels.append(_level(line, column, text, materials))
        elif column in _REQUIRED[kind]:
            raise _refusal(line, column, text, "a number above zero")
    levels.sort(key=lambda level: level.factor)
    return RunRow(
        line=line,
        run=_whole(line, "run", cells["run"], 0),
        repetition=_whole(line, "repetition", cells["repetition"], 1),
        levels=tuple(levels),
        recording=_recording(folder, line, cells.get("recording", "")),
        levels_by_factor={level.factor: level for level in levels},
        **measured,
    )


def _refusal(line: int, column: str, text: str, expected: str) -> IngestError:
    return IngestError(f"{FILE}: row {line}, column {shown(column)}: {shown(text)}; expected {expected}")


def _whole(line: int, column: str, text: str, lowest: int) -> int:
    value = int(text) if text.isascii() and text.isdigit() and len(text) <= 10 else lowest - 1
    # ten digits hold the upper bound, which is PostgreSQL's integer
    if not lowest <= value < 2**31:
        raise _refusal(line, column, text, f"a whole number of {lowest} or more")
    return value


def _measurement(line: int, column: str, text: str, scale: float, zero: bool) -> float | None:
    if not text:
        return None
    expected = "a number of zero or more" if zero else "a number above zero"
    try:
        value = parse_number(text) * scale
    except ValueError as error:
        raise _refusal(line, column, text, expected) from error
    if not 0 <= value < math.inf or (value == 0 and not zero):
        raise _refusal(line, column, text, expected)
    return value


def _level(line: int, column: str, text: str, materials: MaterialNames) -> Level:
    try:
        return level_of(column, text, materials)
    except LevelError as error:
        raise _refusal(line, column, text, str(error)) from error


def _recording(folder: Path, line: int, text: str) -> str | None:
    if not text:
        return None
    path = folder / text
    root = folder.resolve()
    try:
        inside = path.resolve().is_relative_to(root) and not Path(text).is_absolute()
    except (OSError, RuntimeError, ValueError):  # a loop of links, a name no file can have
        inside = False
    if not inside:
        raise _refusal(line, "recording", text, "a file inside the campaign folder")
    try:
        found = path.is_file()
    except (OSError, ValueError):
        found = False
    if not found:
        raise _refusal(line, "recording", text, "a file of the campaign folder; there is none of that name")
    return path.resolve().relative_to(root).as_posix()
