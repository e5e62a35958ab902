"""The configurations of a campaign: their factors in the words of the store, and labels for people."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session

from ...schema.campaigns import ConfigurationLevel, FactorLevel
from ...schema.campaigns import Factor as FactorRow
from ...schema.columns import BY_NAME
from ..record import Configuration, Factor
from .notes import note_columns

#: Columns of a projectile's own travel to the vent holes, and their units in m.
TRAVEL = {"travel_m": 1.0, "travel_mm": 1e-3}

Factors = Mapping[str, Factor]
_AT_ONCE = 500  # SQLite allows a limited number of variables


@dataclass(frozen=True)
class Grouped:
    """The configurations of a campaign in the order of their first runs, and the row of each run's.

    `notes` are sentences on columns that are no settings.
    """

    configurations: tuple[Configuration, ...]
    rows: tuple[int, ...]
    notes: tuple[str, ...]


def grouped_by_setting(session: Session, keys: Sequence[int]) -> Grouped:
    """Runs by the store's `keys` of their configurations. Those that differ in notes alone are one."""
    stored = read_factors(session, list(dict.fromkeys(keys)))
    notes = note_columns([stored[key] for key in keys])
    runs = [{name: value for name, value in stored[key].items() if name not in notes} for key in keys]
    settings = [tuple(sorted(run.items())) for run in runs]
    row_of = {setting: row for row, setting in enumerate(dict.fromkeys(settings))}
    said = tuple(f"{name}: a note on each run, and not a setting" for name in notes)
    return Grouped(labelled([dict(setting) for setting in row_of]), tuple(row_of[each] for each in settings), said)


def read_factors(session: Session, keys: Sequence[int]) -> dict[int, dict[str, Factor]]:
    """Factors of each configuration by its key: a number in SI where the level is one."""
    found: dict[int, dict[str, Factor]] = {key: {} for key in keys}
    query = (
        select(ConfigurationLevel.configuration_id, FactorRow.name, FactorLevel.label, FactorLevel.number)
        .join(FactorLevel, ConfigurationLevel.level_id == FactorLevel.id)
        .join(FactorRow, FactorLevel.factor_id == FactorRow.id)
        .order_by(FactorRow.id)
    )
    for i in range(0, len(keys), _AT_ONCE):
        some = query.where(ConfigurationLevel.configuration_id.in_(keys[i : i + _AT_ONCE]))
        for key, name, label, number in session.execute(some):
            found[key][name] = label if number is None else number
    return found


def labelled(factors: Sequence[Factors]) -> tuple[Configuration, ...]:
    """Configurations in this order. A label names what varies; two that read the same are numbered."""
    varying = [name for name in _names(factors) if len({each.get(name) for each in factors}) > 1]
    texts = [_label(each, varying) for each in factors]
    twice = {text for text, count in Counter(texts).items() if count > 1}
    return tuple(
        Configuration(f"{text} ({i})" if text in twice else text, dict(each))
        for i, (text, each) in enumerate(zip(texts, factors, strict=True), 1)
    )


def _names(factors: Sequence[Factors]) -> list[str]:
    return list(dict.fromkeys(name for each in factors for name in each))


def _label(factors: Factors, varying: Sequence[str]) -> str:
    parts = [_part(name, factors[name]) for name in varying if name in factors]
    return ", ".join(parts) or "the one setting"


def _part(name: str, value: Factor) -> str:
    """`tip_radius_mm 30`: a number in the unit of its column."""
    known = BY_NAME.get(name)
    if isinstance(value, str):
        return f"{name} {value}"
    return f"{known.column} {value / known.scale:.6g}" if known else f"{name} {value:.6g}"


def travel_m(configuration: Configuration) -> float | None:
    """The projectile's travel to the vent holes, m; None where no column has it.

    Raises `ValueError` for a column that is not a positive number.
    """
    for name, unit in TRAVEL.items():
        value = configuration.factors.get(name)
        if value is None:
            continue
        if isinstance(value, str) or not value > 0:
            raise ValueError(f"{name} is {value!r} at {configuration.label}: expected a number above 0")
        return value * unit
    return None
