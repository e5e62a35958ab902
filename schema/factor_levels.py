"""A cell of a table of runs as a factor's level: known columns by their meaning, any other as number or text."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from .known_factors import BY_COLUMN, NONE, KnownFactor, level_label, parse_number

#: Reads a material's name (any case, any alias) as the store's; None for an unknown one.
MaterialNames = Callable[[str], str | None]


class LevelError(ValueError):
    """A cell is no level of its factor; the message is what was expected."""


@dataclass(frozen=True)
class RunLevel:
    """One factor's setting in one run: `number` in SI where it is a number."""

    factor: str
    label: str
    number: float | None = None
    si_unit: str | None = None
    material: str | None = None


def level_of(column: str, text: str, materials: MaterialNames) -> RunLevel:
    """The level that a cell states. Raises `LevelError` where a known column holds something else."""
    factor = BY_COLUMN.get(column)
    if factor is None:
        return _free_level(column, text)
    if factor.si_unit is not None:
        return _number_level(text, factor, factor.si_unit)
    if factor.material:
        return _material_level(text, factor, materials)
    if factor.words:
        word = text.lower()
        if word not in factor.words:
            raise LevelError(f"one of {', '.join(factor.words)}")
        return RunLevel(factor.name, word)
    return RunLevel(factor.name, text)


def _material_level(text: str, known: KnownFactor, materials: MaterialNames) -> RunLevel:
    if known.optional_layer and text.lower() == NONE:
        return RunLevel(known.name, NONE)
    material = materials(text)
    if material is None:
        raise LevelError("a material of the store (pyroshock materials lists and adds them)")
    return RunLevel(known.name, material, material=material)


def _number_level(text: str, known: KnownFactor, si_unit: str) -> RunLevel:
    try:
        cell = parse_number(text)
        number = float(level_label(cell * known.scale))
    except ValueError as error:
        raise LevelError(known.expected_number) from error
    if not math.isfinite(number) or not known.allows(cell):
        raise LevelError(known.expected_number)
    return RunLevel(known.name, level_label(number), number, si_unit)


def _free_level(column: str, text: str) -> RunLevel:
    try:
        number = parse_number(text)
    except ValueError:
        return RunLevel(column, text)
    label = level_label(number)
    if text.isdigit() and float(label) != number:
        return RunLevel(column, text)  # a serial number: rounded, it would be another's
    return RunLevel(column, label, float(label))
