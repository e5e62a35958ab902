"""`plate_modes.csv`: a modal table of the plate."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path

from ...files.delimited_text import Line
from ...signals.modal_table import SHAPE, modal_columns
from ..errors import IngestError
from .tables import read_table

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
        return hashlib.sha256(
            json.dumps([asdict(m) for m in self.modes], sort_keys=True).encode()
        ).hexdigest()


def read_modal_table(folder: Path, name: str, accelerations: tuple[str, ...]) -> ModalTableFile:
    """Read `folder`/`name`; `accelerations` are the channels that need a shape column.

    Raises `IngestError` with file, row, column, value and what was expected.
    """
    header, lines = _table(folder, name)
    try:
        columns = modal_columns(
            header, lines, (*_FIXED, *(f"{SHAPE}{channel}" for channel in accelerations))
        )
    except ValueError as error:
        raise IngestError(f"{name}: {error}") from error
    numbers, frequencies, dampings, impact_shapes = (columns.pop(column) for column in _FIXED)
    shapes = [
        dict(zip((column.removeprefix(SHAPE) for column in columns), values, strict=True))
        for values in zip(*columns.values(), strict=True)
    ] or [{}] * len(lines)
    return ModalTableFile(
        tuple(map(ModeRow, map(int, numbers), frequencies, dampings, impact_shapes, shapes))
    )


def _table(folder: Path, name: str) -> tuple[list[str], list[Line]]:
    path = folder / name
    try:
        inside = path.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError):  # a loop of links
        inside = False
    if not inside:
        raise IngestError(
            f"campaign.toml: bench.plate.modes is {name!r}; expected a file "
            f"inside the campaign folder"
        )
    try:
        return read_table(path, name)
    except FileNotFoundError as error:
        raise IngestError(
            f"campaign.toml: bench.plate.modes is {name!r}; there is no such file"
        ) from error
