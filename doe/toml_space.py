"""The file in which a lab writes down its factors: TOML, every key checked.

name = "gun"                        # of the space
kind = "gun"                        # or "hammer"

[[factors]] name = "tip_radius"                 # as in the store column = "tip_radius_mm"
# in tables; the name where it is left out kind = "numeric"                    # numbers; "ordered":
words with an order; "categorical": words without unit = "mm"                         # of numbers
levels = [30, 45, 60]               # rising change = 0                          # work to change
it: 0 for easy (the default), the higher the more

[[factors]]
name = "tank_pressure"
column = "tank_pressure_bar"
kind = "continuous"                 # any value of a range, in steps of what the bench can set
unit = "bar"
low = 0.8
high = 6
step = 0.05                         # left out: 1, 2 or 5 times a power of ten, fifty steps or more

[[factors]]
name = "velocity_level"
kind = "ordered"
levels = ["low", "high"]
unit = "m/s"                        # of the values
values = [10, 30]                   # what ordered words stand for, where it is known

[[requires]]                        # a level that needs another factor's level
factor = "insulator"
level = "polymeric"
needs = "anvil_material"
levels = ["aluminum", "steel"]

[[tied]]                            # factors that are set together
factors = ["tip_material", "tip_radius"]
combinations = [["aluminum", 30], ["polyurethane", 15]]

[bench]                             # what the bench withstands; kept as it is, read by the guards

A factors file with ranges in place of levels, as the command line's `--range` and the Python API
write them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..files.toml_text import check_keys, toml_table
from ..schema.known_factors import BY_COLUMN, BY_NAME
from .factors import DesignFactor, Requirement, Rule, Tie, continuous_levels, number_label

_KINDS = ("numeric", "continuous", "ordered", "categorical")
_NUMBERS = ("numeric", "continuous")
#: Keys of each table: those that must be there, and the others.
_TOP = (("name", "kind", "factors"), ("requires", "tied", "bench"))
_FACTOR = (("name", "kind", "levels"), ("column", "unit", "values", "change"))
_CONTINUOUS = (("name", "kind", "low", "high"), ("column", "unit", "step", "change"))
_REQUIRES = (("factor", "level", "needs", "levels"), ())
_TIED = (("factors", "combinations"), ())


@dataclass(frozen=True)
class SpaceFile:
    """What the file says, each entry checked by itself; what they say together is the space's
    business."""

    name: str
    kind: str
    factors: tuple[DesignFactor, ...]
    rules: tuple[Rule, ...]
    bench: Mapping[str, Any]


def parse(text: str) -> SpaceFile:
    """What a file of factors says. Raises `ValueError` naming key, value and what was expected."""
    table = toml_table(text)
    _check(table, _TOP, "the file")
    bench = table.get("bench", {})
    if not isinstance(bench, dict):
        raise ValueError(f"bench is {bench!r}; expected a table")
    factors = tuple(_factor(entry, where) for entry, where in _entries(table, "factors"))
    requires = [_requirement(entry, where) for entry, where in _entries(table, "requires")]
    ties = [_tie(entry, where) for entry, where in _entries(table, "tied")]
    return SpaceFile(
        _text(table, "name", "the file"),
        _text(table, "kind", "the file"),
        factors,
        (*requires, *ties),
        bench,
    )


def _factor(entry: dict[str, Any], where: str) -> DesignFactor:
    _check(entry, _CONTINUOUS if entry.get("kind") == "continuous" else _FACTOR, where)
    name, kind = _text(entry, "name", where), _text(entry, "kind", where)
    if kind not in _KINDS:
        raise ValueError(f"{where}: kind is {kind!r}; expected one of {', '.join(_KINDS)}")
    is_number = kind in _NUMBERS
    measured = is_number or (kind == "ordered" and "values" in entry)
    if measured != ("unit" in entry):
        raise ValueError(
            f"{where}: unit is {entry.get('unit')!r}; expected one for a "
            f"factor of numbers, or with values"
        )
    if "values" in entry and kind != "ordered":
        raise ValueError(
            f"{where}: values are given; expected them for an ordered factor, "
            f"whose levels are words"
        )
    change = entry.get("change", 0)
    if not isinstance(change, int) or isinstance(change, bool):
        raise ValueError(f"{where}: change is {change!r}; expected a whole number")
    column = _text(entry, "column", where) if "column" in entry else name
    levels = (
        _range(entry, where) if kind == "continuous" else _listed(entry, where, numeric=is_number)
    )
    _check_known(name, column, kind, levels, where)
    return DesignFactor(
        name=name,
        column=column,
        levels=levels,
        numbers=tuple(map(float, levels)) if is_number else None,
        ordered=kind != "categorical",
        change=change,
        unit=_text(entry, "unit", where) if measured else None,
        values=_values(entry, where) if "values" in entry else None,
        continuous=kind == "continuous",
    )


def _listed(entry: dict[str, Any], where: str, *, numeric: bool) -> tuple[str, ...]:
    return tuple(_level(level, where, numeric=numeric) for level in _list(entry, "levels", where))


def _range(entry: dict[str, Any], where: str) -> tuple[str, ...]:
    low, high = (float(_level(entry[key], where, numeric=True)) for key in ("low", "high"))
    step = float(_level(entry["step"], where, numeric=True)) if "step" in entry else None
    try:
        return continuous_levels(low, high, step)
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None


def _values(entry: dict[str, Any], where: str) -> tuple[float, ...]:
    """What an ordered factor's words stand for."""
    return tuple(
        float(_level(value, where, numeric=True)) for value in _list(entry, "values", where)
    )


def _check_known(name: str, column: str, kind: str, levels: tuple[str, ...], where: str) -> None:
    """A factor that recordings know too must be the same there, or no recording would ever match
    its plan."""
    factor = BY_COLUMN.get(column) or BY_NAME.get(name)
    if factor is None:
        return
    if (name, column, kind in _NUMBERS) != (factor.name, factor.column, factor.is_number):
        expected = (
            f"{factor.name!r} in {factor.column!r}, {'numeric' if factor.is_number else 'words'}"
        )
        raise ValueError(
            f"{where}: {kind} {name!r} in column {column!r}; tables of runs know {expected}"
        )
    for level in levels:
        if (factor.words and level not in factor.words) or (
            factor.is_number and not factor.allows(float(level))
        ):
            expected = (
                f"one of {', '.join(factor.words)}" if factor.words else factor.expected_number
            )
            raise ValueError(f"{where}: {column} has level {level!r}; expected {expected}")


def _requirement(entry: dict[str, Any], where: str) -> Requirement:
    _check(entry, _REQUIRES, where)
    levels = tuple(_level(level, where) for level in _list(entry, "levels", where))
    return Requirement(
        _text(entry, "factor", where),
        _level(entry["level"], where),
        _text(entry, "needs", where),
        levels,
    )


def _tie(entry: dict[str, Any], where: str) -> Tie:
    _check(entry, _TIED, where)
    factors = tuple(_list(entry, "factors", where))
    if not all(isinstance(name, str) for name in factors):
        raise ValueError(f"{where}: factors is {list(factors)!r}; expected names")
    combinations = []
    for levels in _list(entry, "combinations", where):
        if not isinstance(levels, list) or len(levels) != len(factors):
            raise ValueError(
                f"{where}: combination {levels!r}; expected a list of {len(factors)} levels"
            )
        combinations.append(tuple(_level(level, where) for level in levels))
    return Tie(factors, tuple(combinations))


def _level(value: object, where: str, *, numeric: bool | None = None) -> str:
    """A level's text; a number's is the shortest that a person would write."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not (is_number or isinstance(value, str)) or (numeric is not None and numeric != is_number):
        expected = {None: "a text or a number", True: "a number", False: "a text in quotes"}[
            numeric
        ]
        raise ValueError(f"{where}: level {value!r}; expected {expected}")
    try:
        return number_label(float(value)) if isinstance(value, int | float) else str(value)
    except OverflowError as error:
        raise ValueError(f"{where}: a level is beyond any number that a bench sets") from error


def _entries(table: dict[str, Any], key: str) -> list[tuple[dict[str, Any], str]]:
    entries = table.get(key, [])
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        raise ValueError(f"{key} is {entries!r}; expected tables [[{key}]]")
    return [(entry, f"[[{key}]] {number}") for number, entry in enumerate(entries, 1)]


def _check(
    entry: dict[str, Any], keys: tuple[tuple[str, ...], tuple[str, ...]], where: str
) -> None:
    required, optional = keys
    check_keys(entry, (*required, *optional), where, required)


def _text(entry: dict[str, Any], key: str, where: str) -> str:
    value = entry[key]
    if not isinstance(value, str) or value != value.strip() or not value.isprintable() or not value:
        raise ValueError(
            f"{where}: {key} is {value!r}; expected printable text without blanks around it"
        )
    return value


def _list(entry: dict[str, Any], key: str, where: str) -> list[Any]:
    value = entry[key]
    if not isinstance(value, list) or not value:
        raise ValueError(f"{where}: {key} is {value!r}; expected a list with at least one entry")
    return value


_PRESSURE, _VELOCITY_LEVEL = "tank_pressure", "velocity_level"


def with_ranges(text: str, ranges: Mapping[str, Sequence[float]]) -> str:
    """The factors file with continuous factors: column (or name) to low, high and, if wished, step,
    in the column's unit.

    A factor of the file keeps its place and its work to change; a column that only recordings know,
    such as "tank_pressure_bar", is added. A tank pressure takes the place of the velocity levels,
    which it would contradict. Raises `ValueError` for any other column, for words, and for a range
    that is none; comments of the text are lost.
    """
    if not ranges:
        return text
    import tomli_w

    table = toml_table(text)
    factors = table.get("factors", [])
    if not isinstance(factors, list):
        raise ValueError(f"factors is {factors!r}; expected tables [[factors]]")
    for column, limits in ranges.items():
        factors = _with_range(factors, column, limits)
    return tomli_w.dumps({**table, "factors": factors})


def _with_range(
    factors: list[dict[str, Any]], column: str, limits: Sequence[float]
) -> list[dict[str, Any]]:
    if not 2 <= len(limits) <= 3:
        raise ValueError(
            f"range of {column} is {list(limits)}; expected low and high, or low, high and step"
        )
    numbers = dict(
        zip(
            ("low", "high", "step"),
            (float(number_label(float(limit))) for limit in limits),
            strict=False,
        )
    )
    for index, factor in enumerate(factors):
        if column in (factor.get("column", factor.get("name")), factor.get("name")):
            if "unit" not in factor or factor.get("kind") == "ordered":
                raise ValueError(
                    f"{column} has words for levels; expected a factor of numbers for a range"
                )
            kept = {
                key: factor[key] for key in ("name", "column", "unit", "change") if key in factor
            }
            return [
                *factors[:index],
                {**kept, "kind": "continuous", **numbers},
                *factors[index + 1 :],
            ]
    known_factor = BY_COLUMN.get(column) or BY_NAME.get(column)
    if known_factor is None or not known_factor.is_number:
        there = ", ".join(str(factor.get("column", factor.get("name"))) for factor in factors)
        raise ValueError(f"no factor {column!r} to give a range; there: {there}")
    unit = known_factor.column.removeprefix(f"{known_factor.name}_")
    added = {
        "name": known_factor.name,
        "column": known_factor.column,
        "kind": "continuous",
        "unit": unit,
        **numbers,
    }
    replaced = _VELOCITY_LEVEL if known_factor.name == _PRESSURE else None
    return [*(factor for factor in factors if factor.get("name") != replaced), added]
