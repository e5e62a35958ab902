"""Parts of a bench as the store holds them, as the twin takes them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from ..twin.gun.bench import GunBench
from ..twin.materials import ElasticMaterial

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from ..schema import benches as schema
    from ..schema import materials as stored
    from ..twin.plate.modal import ModalPlate


def gun_bench(row: schema.Gun) -> GunBench:
    """A stored gun."""
    return GunBench(
        tank_volume_m3=row.tank_volume_m3,
        bore_diameter_m=row.bore_diameter_m,
        projectile_diameter_m=row.projectile_diameter_m,
        travel_m=row.travel_m,
        friction_coefficient=row.friction_coefficient,
        heat_capacity_ratio=row.heat_capacity_ratio,
        efficiency=row.efficiency,
    )


def modal_plate(table: schema.ModalTable) -> ModalPlate:
    """A stored modal table; its impact point is "#1", its sensors are the channels."""
    from ..twin.plate.table import modal_plate_from_table

    columns: dict[str, list[float]] = {"frequency_hz": [], "damping_ratio": [], "shape_impact": []}
    for mode in table.modes:
        columns["frequency_hz"].append(mode.frequency_hz)
        columns["damping_ratio"].append(mode.damping_ratio)
        columns["shape_impact"].append(mode.shape_impact_per_sqrt_kg)
        for shape in mode.shapes:
            columns.setdefault(f"shape_{shape.channel}", []).append(shape.shape_per_sqrt_kg)
    return modal_plate_from_table(columns)


def stored_materials(session: Session) -> dict[str, ElasticMaterial]:
    """The store's materials by name and alias in lower case."""
    from sqlalchemy import select
    from sqlalchemy.orm import selectinload

    from ..schema import materials as stored

    rows = session.scalars(select(stored.Material).options(selectinload(stored.Material.aliases))).all()
    aliases = {alias.alias: row.name for row in rows for alias in row.aliases}
    return by_name([_material(row) for row in rows], aliases)


def by_name(materials: Iterable[ElasticMaterial], aliases: Mapping[str, str]) -> dict[str, ElasticMaterial]:
    """Materials by name and alias in lower case; a name goes before another's alias."""
    named = {material.name: material for material in materials}
    return {alias.lower(): named[name] for alias, name in aliases.items()} | {k.lower(): m for k, m in named.items()}


def _material(row: stored.Material) -> ElasticMaterial:
    return ElasticMaterial(row.name, row.youngs_modulus_pa, row.poisson_ratio, row.density_kg_m3, row.yield_strength_pa)
