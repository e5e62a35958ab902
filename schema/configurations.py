"""Configurations by their levels: found where the combination is known, added once where it is new."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy import select
from sqlalchemy.orm import Session

from .campaigns import Configuration, ConfigurationLevel, Factor, FactorLevel
from .keys import fingerprint_of, get_or_add
from .levels import Level
from .materials import material_id


def configuration_fingerprint(levels: Sequence[Level]) -> str:
    """Hash of a combination of levels; the same combination has the same, whoever plans or records it."""
    return fingerprint_of(sorted([level.factor, level.label] for level in levels))


def configuration_id(session: Session, levels: Sequence[Level]) -> int:
    """Key of the configuration with these levels, made of known factors and levels where it is new."""
    fingerprint = configuration_fingerprint(levels)
    known = session.scalar(select(Configuration.id).where(Configuration.fingerprint == fingerprint))
    if known is not None:
        return known
    level_rows = [_level(session, level) for level in levels]
    row = get_or_add(session, Configuration, {"fingerprint": fingerprint})
    for level in level_rows:
        key = {"configuration_id": row.id, "level_id": level.id}
        get_or_add(session, ConfigurationLevel, key, {"factor_id": level.factor_id})
    return row.id


def _level(session: Session, level: Level) -> FactorLevel:
    factor = get_or_add(session, Factor, {"name": level.factor}, {"si_unit": level.si_unit})
    material = material_id(session, level.material) if level.material else None
    return get_or_add(
        session,
        FactorLevel,
        {"factor_id": factor.id, "label": level.label},
        {"number": level.number, "material_id": material},
    )
