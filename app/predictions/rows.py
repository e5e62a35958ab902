"""Rows of a plan or of a table of runs as shots to foretell."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...ingest.column_names import MEASURED
from ...ingest.tables import read_table
from ...schema.known_factors import BY_COLUMN, BY_NAME, KnownFactor, parse_number
from ...schema.session import Store
from ..plans.simulation import rows_of
from .given_factors import check_used, factor_value, is_used, looks_like_factor
from .predicting import ShotRequest

if TYPE_CHECKING:
    from ..twins.building import BuiltTwin

_PRESSURE, _VELOCITY, _PLATE = "tank_pressure_bar", "impact_velocity_m_s", "plate_material"
_HEIGHT = "chain_height_mm"
#: Column: field of `ShotRequest`. The unit of a factor's column is the lab's, that of the field SI.
FIELDS = {
    _PRESSURE: "tank_pressure_pa",
    _VELOCITY: "impact_velocity_m_s",
    "bullet_mass_kg": "bullet_mass_kg",
    "tip_material": "tip_material",
    "tip_radius_mm": "tip_radius_m",
    "anvil_material": "anvil_material",
    "insulator": "insulator",
    "impact_position": "impact_position",
    "boundary_conditions": "boundary_conditions",
    "valve_profile": "valve_profile",
}


#: Columns with a field of their own, and those that are never factors of a shot that is to be predicted.
_NOT_FACTORS = frozenset({*FIELDS, _PLATE, "run", "repetition", "recording", *MEASURED})
#: Factors of the store that say what the velocity or the pressure of the row says already.
_LABELS = frozenset({"hammer_speed", "velocity_level", *BY_NAME})


@dataclass(frozen=True)
class ShotRow:
    """A shot of a table: the cells that name it, and the material of its plate where the table says one."""

    labels: Mapping[str, str | int]
    shot: ShotRequest
    plate: str | None
    chain_height_m: float = 0.0

    @property
    def twin(self) -> tuple[str | None, float]:
        """Which twin predicts it: that of its plate, as high as it hangs."""
        return self.plate, self.chain_height_m


def rows_of_plan(store: Store, plan: str) -> list[ShotRow]:
    """The runs of a plan that are not discarded. Raises as `rows_of`, and `ValueError` as `rows_of_table`."""
    return rows_of_table(rows_of(store, plan)[1], f"plan {plan!r}")


def rows_of_file(path: Path) -> list[ShotRow]:
    """A CSV table with the columns of `runs.csv`. Raises `IngestError`, `OSError`, `ValueError`."""
    return rows_of_table([row for _, row in read_table(path, path.name)[1]], path.name)


def assumed(rows: Sequence[ShotRow], impactor_mass_kg: float) -> list[str]:
    """What a shot has that the table does not say, in words for the user; the mass is that of the bench."""
    stated, usual = rows[0].labels, ShotRequest(bullet_mass_kg=impactor_mass_kg)
    absent = {column: getattr(usual, field) for column, field in FIELDS.items() if column not in stated}
    return [f"no column {column}: {value}" for column, value in absent.items() if value is not None]


def with_factors(row: ShotRow, built: BuiltTwin, of_store: Collection[str]) -> ShotRow:
    """The shot with the further columns of its row that the twin's contact model asks for.

    Raises `ValueError` for a column that is a factor (`looks_like_factor`) and that no stage uses; any other column is
    a label, such as `recording` or a planned figure.
    """
    cells = {
        column: str(cell)
        for column, cell in row.labels.items()
        if cell not in ("", None) and column not in _NOT_FACTORS
    }
    used = {column: factor_value(cell) for column, cell in cells.items() if is_used(built, column)}
    ignored = {
        column: cell
        for column, cell in cells.items()
        if column not in used and column not in _LABELS and looks_like_factor(column, of_store)
    }
    if ignored:
        check_used(built, ignored, None)
    return replace(row, shot=replace(row.shot, factors=used))


def rows_of_table(rows: Sequence[Mapping[str, str]], name: str) -> list[ShotRow]:
    """Rows with the columns of `runs.csv`; an empty cell says nothing. `name` is the table's, for errors.

    Raises `ValueError` for a table without rows, for a row with both pressure and velocity or neither, and for a cell
    that is no number.
    """
    if not rows:
        raise ValueError(f"{name} has no row to predict")
    return [_shot(row, f"{name}, run {row.get('run', number)}") for number, row in enumerate(rows, 1)]


def _shot(row: Mapping[str, str], name: str) -> ShotRow:
    settings = {column: row[column] for column in FIELDS if row.get(column)}
    if (_PRESSURE in settings) == (_VELOCITY in settings):
        raise ValueError(f"{name}: expected {_PRESSURE} or {_VELOCITY}, and one of them only")
    shot = ShotRequest(**{FIELDS[column]: _value(column, cell, name) for column, cell in settings.items()})
    numbers = {column: int(row[column]) for column in ("run", "repetition") if row.get(column, "").isdecimal()}
    height = _value(_HEIGHT, row[_HEIGHT], name) if row.get(_HEIGHT) else 0.0
    return ShotRow({**row, **numbers}, shot, row.get(_PLATE) or None, height)


def _value(column: str, cell: str, name: str) -> Any:
    factor = BY_COLUMN.get(column, KnownFactor(column, column, "m/s"))
    if not factor.is_number:
        return cell
    try:
        return parse_number(cell) * factor.scale
    except ValueError as error:
        raise ValueError(f"{name}: {column} is {cell!r}; expected a number") from error
