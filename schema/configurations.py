"""Configurations by their levels: found where the combination is known, added once where it is new,
and read."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple, cast

from sqlalchemy import Table, bindparam, select
from sqlalchemy.orm import Session

from .base import in_batches
from .benches import material_id
from .campaigns import Configuration, ConfigurationLevel, Factor, FactorLevel
from .known_factors import RunLevel
from .transactions import add_or_get, fingerprint_of

_configurations, _factors, _levels_of_factors, _levels_of_configurations = (
    cast("Table", model.__table__)
    for model in (Configuration, Factor, FactorLevel, ConfigurationLevel)
)
#: Asked for with every recording: made once, and of the tables, for rows of the models take several
#: times as long.
_KNOWN = select(_configurations.c.fingerprint, _configurations.c.id).where(
    _configurations.c.fingerprint.in_(bindparam("fingerprints", expanding=True))
)
_FACTORS = select(_factors.c.name, _factors.c.id).where(
    _factors.c.name.in_(bindparam("names", expanding=True))
)
_LEVELS = select(
    _levels_of_factors.c.factor_id, _levels_of_factors.c.label, _levels_of_factors.c.id
).where(
    _levels_of_factors.c.factor_id.in_(bindparam("factors", expanding=True)),
    _levels_of_factors.c.label.in_(bindparam("labels", expanding=True)),
)
_LEVELS_OF_ONE = select(_levels_of_configurations.c.level_id).where(
    _levels_of_configurations.c.configuration_id == bindparam("configuration")
)


class _StoredLevel(NamedTuple):
    """The keys of a level and of its factor."""

    factor_id: int
    id: int


def configuration_fingerprint(levels: Sequence[RunLevel]) -> str:
    """Hash of a combination of levels; the same combination has the same, whoever plans or records
    it.

    Parameters:
        levels: A level of each factor, in any order.
    """
    return fingerprint_of(sorted([level.factor, level.label] for level in levels))


def configuration_id(session: Session, levels: Sequence[RunLevel]) -> int:
    """Key of a configuration, made of known factors and levels where it is new.

    Parameters:
        session: A session that writes to the store.
        levels: A level of each factor, in any order.
    """
    return configuration_ids(session, [levels])[0]


def configuration_ids(session: Session, combinations: Sequence[Sequence[RunLevel]]) -> list[int]:
    """`configuration_id` of each combination, in their order.

    What is new is added in one order, whoever adds it: of two transactions that add the same rows,
    one waits for the other, and never both. So a transaction asks once, for all that it needs.

    Parameters:
        session: A session that writes to the store.
        combinations: The levels of each configuration.
    """
    prints = [configuration_fingerprint(levels) for levels in combinations]
    of_print = dict(zip(prints, combinations, strict=True))
    existing = known_configurations(session, list(of_print))
    new = {key: levels for key, levels in sorted(of_print.items()) if key not in existing}
    if new:
        level_rows = _levels(session, [level for levels in new.values() for level in levels])
        existing |= {
            key: _add(session, key, [level_rows[_key(level)] for level in levels])
            for key, levels in new.items()
        }
    return [existing[key] for key in prints]


def configuration_factors(
    session: Session, keys: Sequence[int]
) -> dict[int, dict[str, str | float]]:
    """Factors of each configuration by its key, in the order of the factors: a number in SI where
    the level is one.

    Parameters:
        session: A session of the store.
        keys: The keys of the configurations.
    """
    factors: dict[int, dict[str, str | float]] = {key: {} for key in keys}
    for row in iter_levels(session, keys):
        factors[row.configuration][row.factor] = row.level
    return factors


class ConfigurationFactor(NamedTuple):
    """A factor of a configuration with its level: a number in SI, or a word."""

    configuration: int
    factor: str
    si_unit: str | None
    level_id: int
    level: str | float


def iter_levels(session: Session, keys: Sequence[int]) -> Iterator[ConfigurationFactor]:
    """All factors of some configurations, those of one in the order of the factors.

    Parameters:
        session: A session of the store.
        keys: The keys of the configurations.
    """
    columns = (ConfigurationLevel.configuration_id, Factor.name, Factor.si_unit)
    query = (
        select(*columns, FactorLevel.id, FactorLevel.label, FactorLevel.number)
        .join(FactorLevel, ConfigurationLevel.level_id == FactorLevel.id)
        .join(Factor, FactorLevel.factor_id == Factor.id)
        .order_by(Factor.id)
    )
    for some in in_batches(keys):
        rows = session.execute(query.where(ConfigurationLevel.configuration_id.in_(some)))
        for key, factor, si_unit, level_id, label, number in rows:
            yield ConfigurationFactor(
                key, factor, si_unit, level_id, label if number is None else number
            )


def known_configurations(session: Session, fingerprints: Sequence[str]) -> dict[str, int]:
    """Keys of the stored configurations, by fingerprint.

    Parameters:
        session: A session of the store.
        fingerprints: The hashes that are looked for, as `configuration_fingerprint` gives them.
            Those that are not stored are left out.
    """
    existing: dict[str, int] = {}
    for some in in_batches(fingerprints):
        rows = session.connection().execute(_KNOWN, {"fingerprints": some})
        existing |= dict(iter(rows))
    return existing


def _key(level: RunLevel) -> tuple[str, str]:
    return level.factor, level.label


def _add(session: Session, fingerprint: str, levels: Sequence[_StoredLevel]) -> int:
    row = add_or_get(session, Configuration, {"fingerprint": fingerprint})
    # Whoever was faster stored it with its levels, in one transaction; nobody else can add to it
    # before ours ends.
    stored_levels = set(session.connection().scalars(_LEVELS_OF_ONE, {"configuration": row.id}))
    session.add_all(
        ConfigurationLevel(configuration_id=row.id, level_id=level.id, factor_id=level.factor_id)
        for level in levels
        if level.id not in stored_levels
    )
    session.flush()
    return row.id


def _levels(session: Session, levels: Sequence[RunLevel]) -> dict[tuple[str, str], _StoredLevel]:
    """All factors before the first level: rows of one table, in order, before those of the next."""
    wanted = {_key(level): level for level in sorted(levels, key=_key)}
    units = {level.factor: level.si_unit for level in wanted.values()}
    connection = session.connection()
    factors: dict[str, int] = dict(iter(connection.execute(_FACTORS, {"names": list(units)})))
    for name, unit in units.items():
        if name not in factors:
            factors[name] = add_or_get(session, Factor, {"name": name}, {"si_unit": unit}).id
    names = {key: name for name, key in factors.items()}
    level_rows: dict[tuple[str, str], _StoredLevel] = {}
    labels = sorted({level.label for level in wanted.values()})
    for some in in_batches(labels):
        rows = connection.execute(_LEVELS, {"factors": list(names), "labels": some})
        level_rows |= {
            (names[factor], label): _StoredLevel(factor, key) for factor, label, key in rows
        }
    return {
        key: level_rows.get(key) or _level(session, factors[key[0]], level)
        for key, level in wanted.items()
    }


def _level(session: Session, factor: int, level: RunLevel) -> _StoredLevel:
    material = material_id(session, level.material) if level.material else None
    row = add_or_get(
        session,
        FactorLevel,
        {"factor_id": factor, "label": level.label},
        {"number": level.number, "material_id": material},
    )
    return _StoredLevel(factor, row.id)
