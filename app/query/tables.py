"""The tables of the store and their columns, with units, for people who write SQL."""

from __future__ import annotations

from difflib import get_close_matches
from typing import Any

from ...schema.base import Base
from ...schema.tables import metadata

#: Unit by the end of a column's name, longest ends first.
_UNITS = {
    "m_s2": "m/s²",
    "kg_m3": "kg/m³",
    "n_s": "N s",
    "m_s": "m/s",
    "v_per_unit": "V/unit",
    "bytes": "B",
    "hz": "Hz",
    "pa": "Pa",
    "kg": "kg",
    "n": "N",
    "m": "m",
    "s": "s",
    "k": "K",
    "v": "V",
}


def list_tables() -> list[dict[str, Any]]:
    """Every table with the number of its columns and what a row of it is."""
    models = {str(mapper.local_table.name): mapper.class_ for mapper in Base.registry.mappers}  # type: ignore[attr-defined]
    return [
        {"table": name, "columns": len(table.columns), "a row is": _first_sentence(models.get(name))}
        for name, table in sorted(metadata.tables.items())
    ]


def list_columns(name: str) -> list[dict[str, Any]]:
    """Columns of a table: type, unit, whether they may be empty, what they refer to. Raises `LookupError`."""
    if name not in metadata.tables:
        near = get_close_matches(name, metadata.tables, 3)
        hint = f"did you mean {', '.join(near)}?" if near else f"tables: {', '.join(sorted(metadata.tables))}"
        raise LookupError(f"no table {name!r} in the store; {hint}")
    return [
        {
            "column": column.name,
            "type": str(column.type),
            "unit": unit_of(column.name),
            "empty": "yes" if column.nullable else "no",
            "refers to": ", ".join(key.target_fullname for key in column.foreign_keys) or None,
        }
        for column in metadata.tables[name].columns
    ]


def unit_of(column: str) -> str | None:
    """The unit at the end of a column's name: `peak_force_n` is in N."""
    return next((unit for end, unit in _UNITS.items() if column.endswith(f"_{end}")), None)


def _first_sentence(model: type | None) -> str:
    text = " ".join(((model and model.__doc__) or "").split())
    return text.partition(". ")[0].rstrip(".")
