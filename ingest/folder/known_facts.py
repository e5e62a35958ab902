"""`[known]` of campaign.toml: what the laboratory measured of its own bench, refused where it is
not understood."""

from __future__ import annotations

import datetime as dt
import math
from collections.abc import Iterator, Mapping
from typing import Any

from ...files.toml_text import key_problems
from ...schema.known_facts import EffectParameter, KnownFact, effect_parameters
from ...signals.units import UnitError, unit_quantity
from ..errors import LONGEST_NAME, Faults, IngestError, parse_date, printable

FILE = "campaign.toml"
#: Keys of a fact. A table that has none of them is a part of a name.
_KEYS = ("value", "u", "source", "date", "unit")


def read_known_facts(table: Mapping[str, Any]) -> tuple[KnownFact, ...]:
    """The facts of `[known]`, by name: `gun.valve_flow.opening_time_s = { value = 0.12, u = 0.01,
    source = "..." }`.

    Parameters:
        table: The table as TOML gives it. Dots in its keys begin tables within tables.

    Raises:
        IngestError: With every fault: a parameter or key that there is not, with those that there
            are, a unit of another dimension, a number that is none or that the parameter cannot
            have.
    """
    faults = Faults()
    facts = [faults.of(_fact, name, entry) for name, entry in _entries(table, "")]
    faults.refuse()
    names = [fact.name for fact in facts]
    if twice := [name for name in dict.fromkeys(names) if names.count(name) > 1]:
        raise IngestError(f"{FILE}: known.{twice[0]} is given twice; remove one of the two")
    return tuple(sorted(facts, key=lambda fact: fact.name))


def _entries(table: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    """Whole names with their entries: dots in a key of TOML begin tables within tables."""
    for key, value in table.items():
        name = f"{prefix}{key}"
        if (
            isinstance(value, Mapping)
            and value
            and not set(value) & set(_KEYS)
            and name not in effect_parameters()
        ):
            yield from _entries(value, f"{name}.")
        else:
            yield name, value


def _fact(name: str, entry: object) -> KnownFact:
    parameter = effect_parameters().get(name)
    if parameter is None:
        raise IngestError(
            f"{FILE}: known.{printable(name).strip(chr(39))} is no parameter; known: {_alike(name)}"
        )
    where = f"known.{name}"
    if not isinstance(entry, Mapping):
        raise IngestError(
            f"{FILE}: {where} is {printable(entry)}; expected {{ value = "
            f"NUMBER, u = NUMBER, source = TEXT }}"
        )
    if problems := key_problems(entry, _KEYS, f"{where}."):
        raise IngestError(*(f"{FILE}: {problem}" for problem in problems))
    faults = Faults()
    value = faults.of(_number, entry, "value", where)
    u = faults.of(_number, entry, "u", where)
    source = faults.of(_source, entry, where)
    date = faults.of(_date, entry, where)
    scale = faults.of(_scale, entry, parameter, where)
    faults.refuse()
    if not u > 0:
        raise IngestError(f"{FILE}: {where}.u is {u:g}; expected a standard uncertainty above zero")
    if not parameter.low <= scale * value <= parameter.high:
        allowed = f"{parameter.low:g} to {parameter.high:g} {parameter.unit}".rstrip()
        raise IngestError(f"{FILE}: {where}.value is {value:g}; expected {allowed}")
    return KnownFact(name, scale * value, scale * u, source, date)


def _alike(name: str) -> str:
    """The parameters of the effect that is named, of its stage, or all."""
    parameters = effect_parameters()
    effect, stage = f"{name.rpartition('.')[0]}.", f"{name.partition('.')[0]}."
    for prefix in (effect, stage):
        if own := [parameter for parameter in parameters if parameter.startswith(prefix)]:
            return ", ".join(own)
    return ", ".join(parameters)


def _number(entry: Mapping[str, Any], key: str, where: str) -> float:
    if key not in entry:
        raise IngestError(f"{FILE}: {where}.{key} is missing; expected a number")
    value = entry[key]
    try:
        number = (
            math.nan
            if isinstance(value, bool) or not isinstance(value, int | float)
            else float(value)
        )
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise IngestError(f"{FILE}: {where}.{key} is {printable(value)}; expected a finite number")
    return number


def _source(entry: Mapping[str, Any], where: str) -> str:
    value = entry.get("source")
    text = value.strip() if isinstance(value, str) else ""
    if not text or len(text) > LONGEST_NAME or not text.isprintable():
        stated = "missing" if value is None else printable(value)
        raise IngestError(
            f"{FILE}: {where}.source is {stated}; expected one line of at most {LONGEST_NAME} "
            "characters that says where the value is from, such as a certificate or a data sheet"
        )
    return text


def _date(entry: Mapping[str, Any], where: str) -> dt.date | None:
    if "date" not in entry:
        return None
    try:
        return parse_date(entry["date"], "the day of the measurement, such as 2026-11-01")
    except ValueError as error:
        raise IngestError(f"{FILE}: {where}.date is {error}") from error


def _scale(entry: Mapping[str, Any], parameter: EffectParameter, where: str) -> float:
    """What a number in the stated unit is multiplied by; without a unit it is in the parameter's
    own."""
    unit = entry.get("unit", parameter.unit)
    if unit == parameter.unit:
        return 1.0
    expected = (
        f"a unit that converts to {parameter.unit}"
        if parameter.unit
        else "no unit, for it is a pure number"
    )
    if not isinstance(unit, str):
        raise IngestError(f"{FILE}: {where}.unit is {printable(unit)}; expected {expected}")
    import pint

    try:
        return float(unit_quantity(unit).to(unit_quantity(parameter.unit).units).magnitude)
    except (UnitError, pint.DimensionalityError) as error:
        raise IngestError(
            f"{FILE}: {where}.unit is {printable(unit)}; expected {expected}"
        ) from error
    except (pint.PintError, ArithmeticError, ValueError) as error:
        raise IngestError(
            f"{FILE}: {where}.unit is {printable(unit)}; expected {expected}"
        ) from error
