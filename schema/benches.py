"""The parts of a bench: gun, hammer, plate with its modal table; and the materials of tips, plates
and anvils, each with its source. A part is stored once, whoever uses it.

`fingerprint` is the hash of a part's content: two campaigns with the same gun share one row, and a
gun whose friction was re-identified is another row. Sensors belong to the channel that they
recorded (`recordings`).
"""

from __future__ import annotations

from typing import Any

from sqlalchemy import CheckConstraint, ForeignKey, UniqueConstraint, select
from sqlalchemy.orm import Mapped, Session, mapped_column, relationship

from .base import Base, HasId, WithProvenance, names_row, not_negative, positive
from .known_factors import MaterialNames


class Gun(HasId, WithProvenance, Base):
    """A compressed-air gun (thesis, section 2.1.2): the constants of equation 2.16."""

    __tablename__ = "guns"
    __table_args__ = (
        CheckConstraint(positive("tank_volume_m3"), "tank_volume_positive"),
        CheckConstraint(positive("bore_diameter_m"), "bore_diameter_positive"),
        CheckConstraint(positive("projectile_diameter_m"), "projectile_diameter_positive"),
        CheckConstraint("projectile_diameter_m <= bore_diameter_m", "projectile_fits_bore"),
        CheckConstraint(positive("travel_m"), "travel_positive"),
        CheckConstraint(not_negative("friction_coefficient"), "friction_not_negative"),
        CheckConstraint("heat_capacity_ratio >= 1", "heat_capacity_ratio_physical"),
        CheckConstraint("efficiency > 0 AND efficiency <= 1", "efficiency_share"),
    )

    fingerprint: Mapped[str] = mapped_column(unique=True)
    tank_volume_m3: Mapped[float]
    bore_diameter_m: Mapped[float]
    projectile_diameter_m: Mapped[float]
    travel_m: Mapped[float]
    friction_coefficient: Mapped[float]
    heat_capacity_ratio: Mapped[float]
    efficiency: Mapped[float]


class Hammer(HasId, WithProvenance, Base):
    """An instrumented hammer."""

    __tablename__ = "hammers"
    __table_args__ = (CheckConstraint(positive("mass_kg"), "mass_positive"),)

    fingerprint: Mapped[str] = mapped_column(unique=True)
    mass_kg: Mapped[float]


class Plate(HasId, WithProvenance, Base):
    """A resonant plate: a modal table, or material, thickness and outline for the finite element
    model."""

    __tablename__ = "plates"
    __table_args__ = (
        CheckConstraint(positive("thickness_m"), "thickness_positive"),
        CheckConstraint(
            "modal_table_id IS NOT NULL OR (material_id IS NOT NULL AND thickness_m IS NOT NULL)",
            "described",
        ),
    )

    fingerprint: Mapped[str] = mapped_column(unique=True)
    modal_table_id: Mapped[int | None] = mapped_column(ForeignKey("modal_tables.id"))
    material_id: Mapped[int | None] = mapped_column(ForeignKey("materials.id"))
    thickness_m: Mapped[float | None]
    outline_m: Mapped[list[Any] | None]


class ModalTable(HasId, WithProvenance, Base):
    """Measured or computed modes of a plate, as `plate_modes.csv` gives them."""

    __tablename__ = "modal_tables"

    fingerprint: Mapped[str] = mapped_column(unique=True)
    modes: Mapped[list[Mode]] = relationship(order_by="Mode.number", back_populates="table")


class Mode(HasId, WithProvenance, Base):
    """One mode: frequency, damping ratio, mass-normalised shape at the impact point."""

    __tablename__ = "modes"
    __table_args__ = (
        UniqueConstraint("table_id", "number"),
        # Rigid-body modes have frequency zero.
        CheckConstraint("frequency_hz >= 0", "frequency_not_negative"),
        CheckConstraint("damping_ratio >= 0 AND damping_ratio < 1", "damping_below_critical"),
    )

    table_id: Mapped[int] = mapped_column(ForeignKey("modal_tables.id"))
    number: Mapped[int] = mapped_column(info=names_row("mode"))
    frequency_hz: Mapped[float]
    damping_ratio: Mapped[float]
    shape_impact_per_sqrt_kg: Mapped[float]
    table: Mapped[ModalTable] = relationship(back_populates="modes")
    shapes: Mapped[list[ModeShape]] = relationship()


class ModeShape(HasId, WithProvenance, Base):
    """A mode's mass-normalised shape at one sensor."""

    __tablename__ = "mode_shapes"
    __table_args__ = (UniqueConstraint("mode_id", "channel"),)

    mode_id: Mapped[int] = mapped_column(ForeignKey("modes.id"))
    channel: Mapped[str] = mapped_column(info=names_row("channel"))
    shape_per_sqrt_kg: Mapped[float]


class Material(HasId, WithProvenance, Base):
    """An isotropic elastic material (Table 4.2 of the thesis, and what a lab adds)."""

    __tablename__ = "materials"
    __table_args__ = (
        CheckConstraint(positive("youngs_modulus_pa"), "youngs_modulus_positive"),
        # Thermodynamic bounds of an isotropic solid.
        CheckConstraint("poisson_ratio > -1 AND poisson_ratio < 0.5", "poisson_ratio_physical"),
        CheckConstraint(positive("density_kg_m3"), "density_positive"),
        CheckConstraint(positive("yield_strength_pa"), "yield_strength_positive"),
    )

    name: Mapped[str] = mapped_column(unique=True, info=names_row("material"))
    youngs_modulus_pa: Mapped[float]
    poisson_ratio: Mapped[float]
    density_kg_m3: Mapped[float]
    yield_strength_pa: Mapped[float]
    source: Mapped[str]
    aliases: Mapped[list[MaterialAlias]] = relationship(back_populates="material")


class MaterialAlias(HasId, WithProvenance, Base):
    """Another spelling of a material's name ("aluminium", "POM"), compared without case."""

    __tablename__ = "material_aliases"
    __table_args__ = (UniqueConstraint("alias"),)

    material_id: Mapped[int] = mapped_column(ForeignKey("materials.id"), index=True)
    alias: Mapped[str] = mapped_column(info=names_row("alias"))
    material: Mapped[Material] = relationship(back_populates="aliases")


def material_id(session: Session, name: str) -> int:
    """Key of a material.

    Parameters:
        session: A session of the store.
        name: The store's own name of the material, not an alias.

    Raises:
        NoResultFound: Where there is no such material.
    """
    return session.scalars(select(Material.id).where(Material.name == name)).one()


def material_names(session: Session) -> MaterialNames:
    """A reader of material names: any case, any alias; None for an unknown one.

    Parameters:
        session: A session of the store, which is read once.
    """
    material_names = [(name, name) for name in session.scalars(select(Material.name))]
    aliases = session.execute(
        select(MaterialAlias.alias, Material.name).join(Material.aliases)
    ).all()
    table = {
        alias.lower(): name for alias, name in (*((a, n) for a, n in aliases), *material_names)
    }
    return lambda text: table.get(text.lower())
