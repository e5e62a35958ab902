"""Materials of tips, plates and anvils, each with its source."""

from __future__ import annotations

from sqlalchemy import CheckConstraint, ForeignKey, UniqueConstraint, select
from sqlalchemy.orm import Mapped, Session, mapped_column, relationship

from .base import Base, HasId, Written, positive
from .factor_levels import MaterialNames


class Material(HasId, Written, Base):
    """An isotropic elastic material (Table 4.2 of the thesis, and what a lab adds)."""

    __tablename__ = "materials"
    __table_args__ = (
        CheckConstraint(positive("youngs_modulus_pa"), "youngs_modulus_positive"),
        # Thermodynamic bounds of an isotropic solid.
        CheckConstraint("poisson_ratio > -1 AND poisson_ratio < 0.5", "poisson_ratio_physical"),
        CheckConstraint(positive("density_kg_m3"), "density_positive"),
        CheckConstraint(positive("yield_strength_pa"), "yield_strength_positive"),
    )

    name: Mapped[str] = mapped_column(unique=True)
    youngs_modulus_pa: Mapped[float]
    poisson_ratio: Mapped[float]
    density_kg_m3: Mapped[float]
    yield_strength_pa: Mapped[float]
    source: Mapped[str]
    aliases: Mapped[list[MaterialAlias]] = relationship(back_populates="material")


class MaterialAlias(HasId, Written, Base):
    """Another spelling of a material's name ("aluminium", "POM"), compared without case."""

    __tablename__ = "material_aliases"
    __table_args__ = (UniqueConstraint("alias"),)

    material_id: Mapped[int] = mapped_column(ForeignKey("materials.id"), index=True)
    alias: Mapped[str]
    material: Mapped[Material] = relationship(back_populates="aliases")


def material_id(session: Session, name: str) -> int:
    """Key of the material with the store's own `name`. Raises `NoResultFound` where there is none."""
    return session.scalars(select(Material.id).where(Material.name == name)).one()


def material_names(session: Session) -> MaterialNames:
    """A reader of material names: any case, any alias; None for an unknown one."""
    material_names = [(name, name) for name in session.scalars(select(Material.name))]
    aliases = session.execute(select(MaterialAlias.alias, Material.name).join(Material.aliases)).all()
    table = {alias.lower(): name for alias, name in (*((a, n) for a, n in aliases), *material_names)}
    return lambda text: table.get(text.lower())
