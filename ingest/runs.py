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
from .errors import Faults, IngestError
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
    kind: str | None,
    materials: MaterialNames,
    declared: Mapping[str, str] = MappingProxyType({}),
    confirmed: Collection[str] = (),
    faults: Faults | None = None,
) -> tuple[RunRow, ...]:
    """Read and check `folder`/runs.csv. Raises `IngestError` with file, row, column, value and what was expected.

    Delimiter (comma, semicolon, tab) and decimal comma are recognised. Recordings must lie inside `folder` and exist.
    `declared` (with what they are) and `confirmed` are columns that are free factors though they resemble a known one.
    A `kind` of None, of a campaign.toml with faults, asks for no column of its own. Where `faults` are given, all of
    the table's are kept there, and the rows without are returned.
    """
    own = Faults()
    header, lines = own.attempt(_table, folder, own) or ([], [])
    rows = []
    if header:
        required = _REQUIRED.get(kind or "", KEYS)
        own.of(_check_header, header, kind, required)
        own.of(check_columns, header, declared, confirmed)
        if set(KEYS) <= set(header):
            rows = _rows(folder, lines, required, materials, own)
        if not lines and not own:
            own.add([f"{FILE}: no rows; expected at least one recorded impact or shot"])
    if faults is None:
        own.refuse()
    else:
        faults.of(own.refuse)
    return tuple(rows)


def _rows(
    folder: Path, lines: list[Line], required: tuple[str, ...], materials: MaterialNames, faults: Faults
) -> list[RunRow]:
    """The rows that are understood; the faults of the others are added to `faults`."""
    rows = []
    seen: dict[tuple[int, int], int] = {}
    recordings = _Recordings(folder)
    for line, cells in lines:
        row = faults.attempt(_row, recordings, line, cells, required, materials)
        if row is None:
            continue
        key = (row.run, row.repetition)
        if key in seen:
            faults.add(
                [f"{FILE}: row {line}: duplicate run {row.run}, repetition {row.repetition}; see row {seen[key]}"]
            )
            continue
        seen[key] = line
        rows.append(row)
    return rows


def _table(folder: Path, faults: Faults) -> tuple[list[str], list[Line]]:
    try:
        return read_table(folder / FILE, FILE, faults)
    except FileNotFoundError as error:
        raise IngestError(f"{folder}: no {FILE}; a campaign folder needs one (docs/campaigns.md)") from error


def _check_header(header: list[str], kind: str | None, required: tuple[str, ...]) -> None:
    faults = Faults()
    for column in required:
        if column not in header:
            needs = f"a {kind or 'campaign of any kind'} campaign needs {', '.join(required)}"
            faults.add([f"{FILE}: no column {column!r}; {needs}{suggestion(column, header)}"])
    for column in header:
        if column in BY_NAME and column not in BY_COLUMN:
            faults.add([f"{FILE}: column {column!r} states no unit; expected {BY_NAME[column].column!r}"])
    faults.refuse()


def _row(
    recordings: _Recordings, line: int, cells: dict[str, str], required: tuple[str, ...], materials: MaterialNames
) -> RunRow:
    levels = []
    measured: dict[str, float | None] = {}
    faults = Faults()
    for column, text in cells.items():
        if len(text) > LONGEST_NAME:
            faults.of(_refuse, line, column, text, f"at most {LONGEST_NAME} characters")
        elif column in MEASURED:
            name, scale, zero = MEASURED[column]
            measured[name] = faults.of(_measurement, line, column, text, scale, zero)
        elif column in ("run", "repetition", "recording"):
            continue
        elif text:
            levels.append(faults.of(_level, line, column, text, materials))
        elif column in required:
            faults.of(_refuse, line, column, text, "a number above zero")
    run, repetition = (faults.of(_whole, line, key, cells[key], low) for key, low in (("run", 0), ("repetition", 1)))
    recording = faults.of(recordings.path, line, cells.get("recording", ""))
    faults.refuse()
    levels.sort(key=lambda level: level.factor)
    return RunRow(
        line=line,
        run=run,
        repetition=repetition,
        levels=tuple(levels),
        recording=recording,
        levels_by_factor={level.factor: level for level in levels},
        **measured,
    )


def _refuse(line: int, column: str, text: str, expected: str) -> None:
    raise _refusal(line, column, text, expected)


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


class _Recordings:
    """The files that a folder's rows name: each is looked for, and refused, once."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._seen: dict[str, str | IngestError] = {}

    def path(self, line: int, text: str) -> str | None:
        """The recording's path as it is stored; None for an empty cell. Raises `IngestError`."""
        if not text:
            return None
        if text not in self._seen:
            try:
                self._seen[text] = _recording(self._folder, line, text)
            except IngestError as error:
                self._seen[text] = error
        seen = self._seen[text]
        if isinstance(seen, IngestError):
            raise seen
        return seen


def _recording(folder: Path, line: int, text: str) -> str:
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
