"""`plate_modes.csv`: a modal table of the plate."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path

from ..schema.known_factors import parse_number
from .errors import IngestError
from .tables import Line, read_table

_FIXED = ("mode", "frequency_hz", "damping_ratio", "shape_impact")


@dataclass(frozen=True)
class ModeRow:
    """One mode; shapes are mass-normalised, 1/sqrt(kg), by sensor in `shapes`."""

    mode: int
    frequency_hz: float
    damping_ratio: float
    shape_impact: float
    shapes: dict[str, float]


@dataclass(frozen=True)
class ModalTableFile:
    """The modes in the file's order."""

    modes: tuple[ModeRow, ...]

    @property
    def fingerprint(self) -> str:
        return hashlib.sha256(json.dumps([asdict(m) for m in self.modes], sort_keys=True).encode()).hexdigest()


def read_modal_table(folder: Path, name: str, accelerations: tuple[str, ...]) -> ModalTableFile:
    """Read `folder`/`name`; `accelerations` are the channels that need a shape column.

    Raises `IngestError` with file, row, column, value and what was expected.
    """
    columns, lines = _table(folder, name)
    for column in (*_FIXED, *(f"shape_{channel}" for channel in accelerations)):
        if column not in columns:
            raise IngestError(f"{name}: no column {column!r}; it has {', '.join(columns)}")
    sensors = [c.removeprefix("shape_") for c in columns if c.startswith("shape_") and c != "shape_impact"]
    modes = tuple(_mode(name, line, cells, sensors) for line, cells in lines)
    if not modes:
        raise IngestError(f"{name}: no modes; expected at least one row")
    numbers = [m.mode for m in modes]
    if len(set(numbers)) != len(numbers):
        twice = next(n for n in numbers if numbers.count(n) > 1)
        raise IngestError(f"{name}: mode {twice} stands twice")
    return ModalTableFile(modes)


def _table(folder: Path, name: str) -> tuple[list[str], list[Line]]:
    path = folder / name
    try:
        inside = path.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError):  # a loop of links
        inside = False
    if not inside:
        raise IngestError(f"campaign.toml: bench.plate.modes is {name!r}; expected a file inside the campaign folder")
    try:
        return read_table(path, name)
    except FileNotFoundError as error:
        raise IngestError(f"campaign.toml: bench.plate.modes is {name!r}; there is no such file") from error


def _mode(name: str, line: int, row: dict[str, str], sensors: list[str]) -> ModeRow:
    def number(column: str, expected: str, low: float, high: float) -> float:
        try:
            value = parse_number(row[column])
        except ValueError:
            value = float("nan")
        if not low <= value < high:
            raise IngestError(f"{name}: row {line}, column {column!r}: {row[column]!r}; expected {expected}")
        return value

    inf = float("inf")
    mode = number("mode", "a whole number", 0, 2**31)
    if mode != int(mode):
        raise IngestError(f"{name}: row {line}, column 'mode': {row['mode']!r}; expected a whole number")
    return ModeRow(
        mode=int(mode),
        frequency_hz=number("frequency_hz", "a frequency of zero or more", 0, inf),
        damping_ratio=number("damping_ratio", "a ratio from 0 to below 1", 0, 1),
        shape_impact=number("shape_impact", "a finite number", -inf, inf),
        shapes={s: number(f"shape_{s}", "a finite number", -inf, inf) for s in sensors},
    )
