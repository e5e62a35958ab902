"""`runs.csv`, or a spreadsheet in its place: one row per recorded impact or shot, every cell
checked before anything is stored."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from ...files.delimited_text import Line, parse_number
from ...files.number_notation import AmbiguousNumberError
from ...schema.known_factors import (
    BY_COLUMN,
    BY_NAME,
    LevelError,
    MaterialNames,
    RunLevel,
    level_of,
)
from ...signals.valve_profile import ValveProfile
from ..errors import LONGEST_NAME, Faults, IngestError, printable
from ..readers.recording_files import recording_path
from .column_names import KEYS, MEASURED, RUNS_FILE, check_columns, suggestion
from .tables import SUFFIXES, read_table

FILE = RUNS_FILE
#: A folder has one of them.
FILES = (FILE, *(f"runs{suffix}" for suffix in SUFFIXES))


@dataclass(frozen=True)
class RunRow:
    """A row of `runs.csv`. `line` is its line in the `file`, or its row in a sheet; velocities in
    m/s, lengths in m."""

    line: int
    run: int
    repetition: int
    levels: tuple[RunLevel, ...]
    recording: str | None = None
    impact_velocity_m_s: float | None = None
    impact_velocity_u_m_s: float | None = None
    measured_velocity_m_s: float | None = None
    measured_velocity_u_m_s: float | None = None
    bullet_length_m: float | None = None
    bullet_length_u_m: float | None = None
    laser_sampling_rate_hz: float | None = None
    levels_by_factor: Mapping[str, RunLevel] = field(default_factory=dict, compare=False)
    file: str = FILE

    @property
    def place(self) -> str:
        """For messages: "runs.csv: row 3"."""
        return f"{self.file}: row {self.line}"

    def number(self, factor: str) -> float | None:
        """The number that the row states for a factor.

        Parameters:
            factor: The name of the factor as it is stored, such as "tank_pressure".

        Returns:
            The number in SI; None where the row does not state the factor, or states a word.
        """
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
    """Read and check the runs.csv of a folder, or runs.xlsx or runs.xls in its place.

    Delimiter (comma, semicolon, tab) and decimal comma are recognised.

    Parameters:
        folder: The campaign folder. Recordings must lie inside it and exist.
        kind: The kind of the campaign, "hammer" or "gun". None, of a campaign.toml with faults,
            asks for no column of its own.
        materials: A reader of material names; it gives None for an unknown one.
        declared: Columns that are free factors though they resemble a known one, with what they
            are, by `[factors]` of campaign.toml; by default none.
        confirmed: Further such columns that the user named; by default none.
        faults: Takes all of the table's faults, and the rows without a fault are returned; by
            default (None) the faults are raised.

    Raises:
        IngestError: With every fault: file, row, column, value and what was expected.
    """
    own = Faults()
    name = own.attempt(_file_name, folder) or ""
    header, lines = (own.attempt(read_table, folder / name, name, own) if name else None) or (
        [],
        [],
    )
    rows = []
    if header:
        required = _REQUIRED.get(kind or "", KEYS)
        own.of(_check_header, name, header, kind, required)
        own.of(check_columns, header, declared, confirmed, name)
        if set(KEYS) <= set(header):
            rows = _runs_rows(_Reading(folder, name, required, materials), lines, own)
        if not lines and not own:
            own.add([f"{name}: no rows; expected at least one recorded impact or shot"])
    if faults is None:
        own.refuse()
    else:
        faults.of(own.refuse)
    return tuple(rows)


def _runs_rows(reading: _Reading, lines: list[Line], faults: Faults) -> list[RunRow]:
    """The rows that are understood; the faults of the others are added to `faults`."""
    rows = []
    seen: dict[tuple[int, int], int] = {}
    for line, cells in lines:
        row = faults.attempt(reading.row, line, cells)
        if row is None:
            continue
        key = (row.run, row.repetition)
        if key in seen:
            faults.add(
                [
                    f"{row.place}: duplicate run {row.run}, repetition "
                    f"{row.repetition}; see row {seen[key]}"
                ]
            )
            continue
        seen[key] = line
        rows.append(row)
    return rows


def _file_name(folder: Path) -> str:
    names = [name for name in FILES if (folder / name).exists()]
    if not names:
        raise IngestError(
            f"{folder}: no {FILE}; a campaign folder needs one (docs/reference/campaigns.md)"
        )
    if len(names) > 1:
        raise IngestError(f"{names[0]}: {' and '.join(names[1:])} beside it; expected one table")
    return names[0]


def _check_header(
    name: str, header: list[str], kind: str | None, required: tuple[str, ...]
) -> None:
    faults = Faults()
    for column in required:
        if column not in header:
            needs = f"a {kind or 'campaign of any kind'} campaign needs {', '.join(required)}"
            faults.add([f"{name}: no column {column!r}; {needs}{suggestion(column, header)}"])
    for column in header:
        if column in BY_NAME and column not in BY_COLUMN:
            faults.add(
                [f"{name}: column {column!r} states no unit; expected {BY_NAME[column].column!r}"]
            )
    faults.refuse()


class _Reading:
    """Rows of one table. A recording's file is looked for once, and refused once, by the first row
    that names it."""

    def __init__(
        self, folder: Path, name: str, required: tuple[str, ...], materials: MaterialNames
    ) -> None:
        self._folder, self._name, self._required, self._materials = (
            folder,
            name,
            required,
            materials,
        )
        self._recordings: dict[str, str | IngestError] = {}

    def row(self, line: int, cells: dict[str, str]) -> RunRow:
        """Raises `IngestError` with a line for each cell that is not understood."""
        levels = []
        measured: dict[str, float | None] = {}
        faults = Faults()
        for column, text in cells.items():
            if len(text) > LONGEST_NAME:
                faults.add([self._fault(line, column, text, f"at most {LONGEST_NAME} characters")])
            elif column in MEASURED:
                measured[MEASURED[column][0]] = faults.of(self._measurement, line, column, text)
            elif column in ("run", "repetition", "recording"):
                continue
            elif text:
                levels.append(faults.of(self._level, line, column, text))
            elif column in self._required:
                faults.add([self._fault(line, column, text, "a number above zero")])
        run = faults.of(self._whole, line, "run", cells["run"], 0)
        repetition = faults.of(self._whole, line, "repetition", cells["repetition"], 1)
        recording = faults.of(self._recording, line, cells.get("recording", ""))
        faults.refuse()
        levels.sort(key=lambda level: level.factor)
        return RunRow(
            line=line,
            run=run,
            repetition=repetition,
            levels=tuple(levels),
            recording=recording,
            levels_by_factor={level.factor: level for level in levels},
            file=self._name,
            **measured,
        )

    def _fault(self, line: int, column: str, text: str, expected: str) -> str:
        return (
            f"{self._name}: row {line}, column {printable(column)}: "
            f"{printable(text)}; expected {expected}"
        )

    def _whole(self, line: int, column: str, text: str, lowest: int) -> int:
        value = int(text) if text.isascii() and text.isdigit() and len(text) <= 10 else lowest - 1
        # ten digits hold the upper bound, which is PostgreSQL's integer
        if not lowest <= value < 2**31:
            raise IngestError(
                self._fault(line, column, text, f"a whole number of {lowest} or more")
            )
        return value

    def _measurement(self, line: int, column: str, text: str) -> float | None:
        if not text:
            return None
        _, scale, zero = MEASURED[column]
        expected = "a number of zero or more" if zero else "a number above zero"
        try:
            value = parse_number(text) * scale
        except AmbiguousNumberError as error:
            raise IngestError(self._fault(line, column, text, error.choices)) from error
        except ValueError as error:
            raise IngestError(self._fault(line, column, text, expected)) from error
        if not 0 <= value < math.inf or (value == 0 and not zero):
            raise IngestError(self._fault(line, column, text, expected))
        return value

    def _level(self, line: int, column: str, text: str) -> RunLevel:
        try:
            # In one spelling, so that the same profile is the same level.
            return level_of(
                column, _profile(text) if column == "valve_profile" else text, self._materials
            )
        except LevelError as error:
            raise IngestError(self._fault(line, column, text, str(error))) from error

    def _recording(self, line: int, text: str) -> str | None:
        """The recording's path as it is stored; None for an empty cell."""
        if not text:
            return None
        if text not in self._recordings:
            try:
                self._recordings[text] = recording_path(self._folder, text)
            except ValueError as error:
                self._recordings[text] = IngestError(
                    self._fault(line, "recording", text, str(error))
                )
        path = self._recordings[text]
        if isinstance(path, IngestError):
            raise path
        return path


def _profile(text: str) -> str:
    try:
        return str(ValveProfile.parse(text))
    except ValueError as error:
        raise LevelError(f"points TIME:POSITION such as '0:0 0.1:1' ({error})") from error
