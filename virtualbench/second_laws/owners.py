"""Figures that belong to a bullet, a tip or a face: each has its own, the same in every
campaign."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

#: Standard deviation of the logarithm from bullet to bullet: printed bodies differ in diameter and
#: finish.
BULLET_SPREAD = 0.2


def bullet_factor(mass_kg: float) -> float:
    """What a bullet has instead of 1: drawn for its mass, log-normal."""
    rng = np.random.default_rng([round(1e6 * mass_kg), 31])
    return float(np.exp(BULLET_SPREAD * rng.standard_normal()))


def bullet_share(mass_kg: float) -> float:
    """What a bullet's length error is over the mean one."""
    return float(1 + 0.7 * np.random.default_rng([round(1e6 * mass_kg), 37]).standard_normal())


def tip_value(table: Mapping[str, float], material: str) -> float:
    """Raises `ValueError` for a material that has none."""
    key = material.lower()
    for name, value in table.items():
        if name.lower() == key:
            return value
    raise ValueError(f"material {material!r}: expected one of {', '.join(table)}")
