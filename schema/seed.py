"""Materials that every store starts with."""

from __future__ import annotations

import csv
from importlib.resources import files
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from .keys import get_or_add
from .materials import Material, MaterialAlias
from .session import Store


def seed_materials(store: Store) -> None:
    """Add the materials of Table 4.2, and PLA, that the store lacks; a lab's own values stay."""
    with store.reading() as session:
        material_names = set(session.scalars(select(Material.name)))
    rows = [row for row in _rows() if row["name"] not in material_names]
    if not rows:
        return
    store.write(lambda session: _add(session, rows), idempotent=True)


def _add(session: Session, rows: list[dict[str, str]]) -> None:
    for row in rows:
        # Another process may be making the same store at this moment.
        get_or_add(session, Material, {"name": row["name"]}, _values(row))


def _rows() -> list[dict[str, str]]:
    text = (files(__package__) / "data" / "materials.csv").read_text(encoding="utf-8")
    return list(csv.DictReader(text.splitlines()))


def _values(row: dict[str, str]) -> dict[str, Any]:
    return {
        "youngs_modulus_pa": float(row["youngs_modulus_gpa"]) * 1e9,
        "poisson_ratio": float(row["poisson_ratio"]),
        "density_kg_m3": float(row["density_kg_m3"]),
        "yield_strength_pa": float(row["yield_strength_mpa"]) * 1e6,
        "source": row["source"],
        "aliases": [MaterialAlias(alias=alias) for alias in row["aliases"].split(";") if alias],
    }
