"""The factors of the thesis (Tables 3.2 and 4.1) as tables of runs name them, and what a cell may
hold.

Any other column is a free factor, kept under its own name as number or text.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from ..files.delimited_text import parse_number
from ..files.number_notation import AmbiguousNumberError

#: A layer that is not there.
NONE = "none"
#: The plate is hung up by other links of its chains, whose pitch this is (section 2.1.1).
CHAIN_PITCH_M = 0.056
#: What the regulator of the thesis's gun gives at most (gauge; section 2.1.2). Another gun states
#: its own.
MAX_REGULATED_PRESSURE_PA = 0.8e6


@dataclass(frozen=True)
class KnownFactor:
    """A column of a table of runs, recorded or planned, with a meaning.

    `name` and `si_unit` are stored; a cell times `scale` is SI. `words` are the allowed texts;
    `material` takes the name of a known material (`optional_layer`: or "none").
    """

    column: str
    name: str
    si_unit: str | None = None
    scale: float = 1.0
    words: tuple[str, ...] = ()
    material: bool = False
    above_zero: bool = False  # a quantity of matter or state: zero or less is a slip of the pen
    optional_layer: bool = False
    step: float | None = (
        None  # the column's numbers are multiples of it, zero and negative ones included
    )

    @property
    def is_number(self) -> bool:
        return self.si_unit is not None

    @property
    def expected_number(self) -> str:
        """What a cell may hold, for a message."""
        return (
            "a number above zero"
            if self.step is None
            else f"a multiple of {self.step:g}, such as -{self.step:g} or 0"
        )

    def allows(self, number: float) -> bool:
        """Whether a number may stand in the column.

        Parameters:
            number: The number of a cell, in the unit of the column.
        """
        if self.step is not None:
            return abs(number / self.step - round(number / self.step)) < 1e-6
        return number > 0 or not self.above_zero


KNOWN_FACTORS: tuple[KnownFactor, ...] = (
    KnownFactor("tip_material", "tip_material", material=True),
    KnownFactor("tip_radius_mm", "tip_radius", "m", 1e-3, above_zero=True),
    KnownFactor("plate_material", "plate_material", material=True),
    KnownFactor("anvil_material", "anvil_material", material=True, optional_layer=True),
    KnownFactor("insulator", "insulator", words=(NONE, "polymeric")),
    KnownFactor("boundary_conditions", "boundary_conditions", words=("free", "fixed")),
    KnownFactor("impact_position", "impact_position"),
    KnownFactor("hammer_speed", "hammer_speed", words=("low", "high")),
    KnownFactor("bullet_mass_kg", "bullet_mass", "kg", above_zero=True),
    KnownFactor("tank_pressure_bar", "tank_pressure", "Pa", 1e5, above_zero=True),
    KnownFactor("valve_profile", "valve_profile"),
    KnownFactor("chain_height_mm", "chain_height", "m", 1e-3, step=1e3 * CHAIN_PITCH_M),
)

BY_COLUMN = {factor.column: factor for factor in KNOWN_FACTORS}
BY_NAME = {factor.name: factor for factor in KNOWN_FACTORS}


def checked_chain_height(height_m: float) -> float:
    """A height by which the chains of a plate lift it.

    Parameters:
        height_m: The height, m.

    Raises:
        ValueError: Where it is not a whole number of links.
    """
    height = BY_COLUMN["chain_height_mm"]
    if not height.allows(height_m / height.scale):
        raise ValueError(
            f"chain height {1e3 * height_m:g} mm: expected "
            f"{height.expected_number}, for the plate hangs by links of {height.step:g} mm"
        )
    return height_m


def column_of(factor: str) -> tuple[str, float]:
    """A factor as the campaign's files name it, and its unit in SI: ("tank_pressure_bar", 1e5).

    Parameters:
        factor: The name of the factor as it is stored. A free factor keeps its name, with 1 as its
            unit.
    """
    column = BY_NAME.get(factor)
    return (column.column, column.scale) if column else (factor, 1.0)


def level_label(number: float) -> str:
    """The shortest text of a number that reads back as it: levels are compared by it.

    Parameters:
        number: The level, in SI where its factor has a unit. It is rounded to twelve digits.
    """
    return repr(float(f"{number:.12g}"))


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
    """The level that a cell states.

    Parameters:
        column: The column of the table of runs. A column without a known meaning is a free factor.
        text: What the cell holds.
        materials: A reader of material names, such as `material_names` gives.

    Raises:
        LevelError: Where a known column holds something else, or a number can be read in two ways.
    """
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


def _material_level(text: str, factor: KnownFactor, materials: MaterialNames) -> RunLevel:
    if factor.optional_layer and text.lower() == NONE:
        return RunLevel(factor.name, NONE)
    material = materials(text)
    if material is None:
        raise LevelError("a material of the store (pyroshock materials lists and adds them)")
    return RunLevel(factor.name, material, material=material)


def _number_level(text: str, factor: KnownFactor, si_unit: str) -> RunLevel:
    try:
        cell = parse_number(text)
        number = float(level_label(cell * factor.scale))
    except AmbiguousNumberError as error:
        raise LevelError(f"{error.choices}, written so that it has one meaning") from error
    except ValueError as error:
        raise LevelError(factor.expected_number) from error
    if not math.isfinite(number) or not factor.allows(cell):
        raise LevelError(factor.expected_number)
    return RunLevel(factor.name, level_label(number), number, si_unit)


def _free_level(column: str, text: str) -> RunLevel:
    try:
        number = parse_number(text)
    except AmbiguousNumberError as error:
        raise LevelError(f"{error.choices}, written so that it has one meaning") from error
    except ValueError:
        return RunLevel(column, text)
    label = level_label(number)
    if text.isdigit() and float(label) != number:
        return RunLevel(column, text)  # a serial number: rounded, it would be another's
    return RunLevel(column, label, float(label))
