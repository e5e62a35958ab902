"""Shots as a DataFrame: its columns are arguments of `predict`, or those of a table of runs, in its units or in SI."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...schema.known_factors import KNOWN_FACTORS, level_label
from ..predictions.rows import ShotRow, rows_of_table
from .twin import python_name, shot_of

if TYPE_CHECKING:
    import pandas as pd

#: Columns that only one of the two forms has.
_ARGUMENTS = ("tank_pressure", "velocity", "bullet_mass", "tip", "tip_radius", "anvil")
#: Arguments that a table of runs has as columns of the same name.
_COMMON = ("insulator", "impact_position", "boundary_conditions", "valve_profile")
_LABELS = ("run", "repetition")
#: Argument -> the column of a table of runs that says the same.
_OF_RUNS = {
    "tank_pressure": "tank_pressure_bar",
    "velocity": "impact_velocity_m_s",
    "bullet_mass": "bullet_mass_kg",
    "tip": "tip_material",
    "tip_radius": "tip_radius_mm",
    "anvil": "anvil_material",
}
#: Columns of the library's frames in SI -> that of a table of runs, and its unit in SI.
_IN_SI = {
    f"{factor.name}_{factor.si_unit.lower()}": (factor.column, factor.scale)
    for factor in KNOWN_FACTORS
    if factor.si_unit is not None and factor.scale != 1.0
}
_RUN_COLUMNS = {*_OF_RUNS.values(), *_IN_SI, "plate_material"}


def shot_rows(shots: pd.DataFrame) -> list[ShotRow]:
    """A shot for each row; an empty cell is not given.

    Raises `ValueError` that says the row for what `predict` refuses, and for a column that is no argument.
    """
    if not len(shots):
        raise ValueError("shots has no row to predict")
    rows = [
        {str(name): value for name, value in row.items() if value is not None and value == value}
        for row in shots.to_dict("records")
    ]
    if not set(_ARGUMENTS) & set(map(str, shots.columns)):
        return rows_of_table([dict(_cell(name, value) for name, value in row.items()) for row in rows], "shots")
    columns = (*_ARGUMENTS, *_COMMON, *_LABELS)
    unknown = [str(name) for name in shots.columns if name not in columns]
    if unknown:
        given = next(name for name in _ARGUMENTS if name in shots.columns)
        beside = (
            f"; a table of runs has it, with {_OF_RUNS[given]!r} for {given!r}: use the names of one form"
            if unknown[0] in _RUN_COLUMNS
            else f"; there are: {', '.join(columns)}"
        )
        raise ValueError(f"column {unknown[0]!r} of shots is no argument of predict{beside}")
    return [_shot_row(row, number) for number, row in enumerate(rows, 1)]


def _cell(name: str, value: Any) -> tuple[str, str]:
    """Column and text as a table of runs has them."""
    column, scale = _IN_SI.get(name, (name, None))
    return column, str(value) if scale is None else level_label(float(value) / scale)


def _shot_row(row: dict[str, Any], number: int) -> ShotRow:
    arguments = {name: value for name, value in row.items() if name not in _LABELS}
    labels = {name: str(value) for name, value in row.items()}
    try:
        return ShotRow(labels, shot_of(python_name, **arguments), None)
    except ValueError as error:
        raise ValueError(f"shots, row {number}: {error}") from error
