"""Settings and figures in the words and units of the bench."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...array_types import Floats
from ...schema.known_factors import BY_COLUMN, KNOWN_FACTORS, NONE
from ...schema.listings import listing_key
from .document import Cell, cell_text


@dataclass(frozen=True)
class FactorLabel:
    """How a factor is told: "tip radius" in "mm", of which one SI unit is `per_si`."""

    name: str
    unit: str
    per_si: float

    @property
    def heading(self) -> str:
        """Of a column."""
        return f"{self.name} ({self.unit})" if self.unit else self.name

    def cell(self, level: Any) -> Cell:
        """A level in the unit of the heading."""
        return round(level * self.per_si, 9) if isinstance(level, float) else None if level is None else str(level)

    def words(self, level: Any) -> str:
        """A level by itself: "30 mm"; a layer that is missing by its name."""
        if level is None or level == NONE:
            return f"no {self.name}"
        text = cell_text(self.cell(level))
        return f"{text} {self.unit}" if self.unit and isinstance(level, float) else text

    def named(self, level: Any) -> str:
        """A level with its factor: "tip radius 30 mm"."""
        words = self.words(level)
        return words if words == f"no {self.name}" else f"{self.name} {words}"


_KNOWN = {
    listing_key(factor.name, factor.si_unit): FactorLabel(
        factor.name.replace("_", " "), factor.column.removeprefix(f"{factor.name}_"), 1 / factor.scale
    )
    if factor.is_number
    else FactorLabel(factor.name.replace("_", " "), "", 1.0)
    for factor in KNOWN_FACTORS
} | {"velocity_m_s": FactorLabel("velocity", "m/s", 1.0)}


def setting(key: str) -> FactorLabel:
    """The factor that a listing has under `key`; a lab's own ones keep their name."""
    return _KNOWN.get(key) or FactorLabel(key.replace("_", " "), "", 1.0)


def column_heading(column: str) -> str:
    """A column of a table of runs: "tip radius (mm)"."""
    factor = BY_COLUMN.get(column)
    return setting(listing_key(factor.name, factor.si_unit) if factor else column).heading


def settings_words(levels: Mapping[str, Any]) -> str:
    """ "steel, 30 mm, no insulator"."""
    return ", ".join(setting(key).words(level) for key, level in levels.items()) or "all alike"


def mean_and_spread(values: Floats, scale: float = 1.0) -> str | None:
    """ "5.62 ± 0.11": mean and standard deviation of `values` (n,), to two digits of the latter; of one, the value."""
    finite_values = scale * values[np.isfinite(values)]
    if not finite_values.size:
        return None
    mean = float(finite_values.mean())
    spread = float(finite_values.std(ddof=1)) if finite_values.size > 1 else 0.0
    if not spread > 1e-9 * abs(mean):
        return cell_text(mean)
    decimals = max(0, 1 - math.floor(math.log10(spread)))
    return f"{mean:.{decimals}f} ± {spread:.{decimals}f}"


def force_unit(largest_n: float) -> tuple[str, float]:
    """The unit that a force is told in, and how many of them a newton is."""
    return ("kN", 1e-3) if largest_n >= 1000 else ("N", 1.0)
