"""The units at the end of names: `peak_force_n` is in newton, and the bench reads it in kilonewton.

Keys of JSON, columns of the store and of frames take their units from here.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

#: g, in which accelerations are shown (ISO 80000-3). The twin's own constant would bring numpy.
STANDARD_GRAVITY_M_S2 = 9.80665


@dataclass(frozen=True)
class UnitEnding:
    """`unit` of a name with this `ending`, and `shown`, the unit of the bench, of which one unit is
    `scale`. Empty: headings spell the name as it is. `nouns` end the names of predictors in this
    unit, which have no ending."""

    ending: str
    unit: str
    shown: str = ""
    scale: float = 1.0
    nouns: tuple[str, ...] = ()

    @property
    def plain(self) -> str:
        """The unit without raised digits, as frames and files write it."""
        return self.unit.replace("²", "2").replace("³", "3")


#: A longer ending stands before one that it ends with: `_m_s2` also ends with `_s2`.
UNIT_ENDINGS: tuple[UnitEnding, ...] = (
    UnitEnding("_v_per_unit", "V/unit"),
    UnitEnding("_m2_s3", "m²/s³", "m²/s³"),
    UnitEnding("_kg_m3", "kg/m³", "kg/m³", nouns=("density",)),
    UnitEnding("_bytes", "B"),
    UnitEnding("_m_s2", "m/s²", "g", 1 / STANDARD_GRAVITY_M_S2),
    UnitEnding("_kg_s", "kg/s"),
    UnitEnding("_m_s", "m/s", "m/s", nouns=("velocity",)),
    UnitEnding("_n_s", "N s", "N s"),
    UnitEnding("_n_m", "N/m"),
    UnitEnding("_mb", "MB"),
    UnitEnding("_hz", "Hz", "Hz"),
    UnitEnding("_db", "dB", "dB"),
    UnitEnding("_kg", "kg", "kg", nouns=("mass",)),
    UnitEnding("_pa", "Pa", "bar", 1e-5, ("pressure", "modulus", "strength")),
    UnitEnding("_m3", "m³"),
    UnitEnding("_m2", "m²"),
    UnitEnding("_mm", "mm"),
    UnitEnding("_nm", "N m"),
    UnitEnding("_s", "s", "ms", 1e3),
    UnitEnding("_n", "N", "kN", 1e-3),
    UnitEnding("_m", "m", "mm", 1e3, ("radius", "thickness")),
    UnitEnding("_j", "J"),
    UnitEnding("_k", "K"),
    UnitEnding("_v", "V"),
)


@cache
def unit_ending(name: str) -> UnitEnding | None:
    """The unit at the end of a name; None where it has none, or is nothing else."""
    return next(
        (
            entry
            for entry in UNIT_ENDINGS
            if name.endswith(entry.ending) and len(name) > len(entry.ending)
        ),
        None,
    )


def key_of_quantity(name: str) -> str:
    """A quantity with its unit at the end: `tip_radius_m` of `tip_radius`, which is a predictor."""
    if unit_ending(name) is not None:
        return name
    noun = name.rpartition("_")[2]
    return name + next((entry.ending for entry in UNIT_ENDINGS if noun in entry.nouns), "")
