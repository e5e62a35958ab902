"""What tips and faces are made of.

Elastic data and yield strength are those of Table 4.2 of the thesis; PLA is not in it. The relaxing fraction r and
its time tau are of one Maxwell branch: the instantaneous modulus is 1 + r times the relaxed one, and the loss factor
at the angular frequency w is r w tau / (1 + (1 + r) w^2 tau^2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

__all__ = ["HARDENING", "HARDNESS_RATIO", "MATERIALS", "ContactMaterial", "contact_material"]

#: Mean pressure of a fully plastic contact over the yield strength (Tabor, The Hardness of Metals, 1951).
HARDNESS_RATIO = 2.8
#: Yield strength of a surface that has been struck before, at an impact's rate of strain, over that of the data sheet.
#: Assumed: with 1 the pulses of a small hammer widen with force other than recorded ones do (log-log slope -0.131, not
#: -0.158), from 1.5 on they nearly do as these.
HARDENING = 1.5


@dataclass(frozen=True)
class ContactMaterial:
    """One material. Raises `ValueError` for numbers that no material has."""

    name: str
    youngs_modulus_pa: float
    poisson_ratio: float
    density_kg_m3: float
    yield_strength_pa: float
    relaxing_fraction: float
    relaxation_time_s: float
    polymer: bool

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, float) and not (math.isfinite(value) and value > 0):
                raise ValueError(f"{field.name} of {self.name} = {value!r}: expected a number above 0")
        if not self.poisson_ratio < 0.5:
            raise ValueError(f"poisson_ratio of {self.name} = {self.poisson_ratio!r}: expected less than 0.5")

    @property
    def compliance_1_pa(self) -> float:
        """(1 - nu^2) / E, its share of 1 / E* in a contact."""
        return (1 - self.poisson_ratio**2) / self.youngs_modulus_pa

    @property
    def hardness_pa(self) -> float:
        return HARDNESS_RATIO * HARDENING * self.yield_strength_pa


#: The losses are assumed, of the order of loss factors near 1 kHz in Lakes, Viscoelastic Materials (2009): metals below
#: 0.01 (the joint between tip and head included), polyacetal and PLA some 0.05, polyurethane 0.1 to 0.3.
MATERIALS = {
    row.name: row
    for row in (
        ContactMaterial("aluminum", 69.9e9, 0.33, 2700.0, 276e6, 0.02, 50e-6, False),
        ContactMaterial("steel", 200e9, 0.30, 7800.0, 400e6, 0.015, 50e-6, False),
        ContactMaterial("delrin", 3.2e9, 0.35, 1410.0, 71.7e6, 0.15, 150e-6, True),
        ContactMaterial("polyurethane", 0.03e9, 0.39, 1210.0, 51e6, 0.5, 1.0e-3, True),
        # Printed PLA: Farah, Anderson and Langer, Adv. Drug Deliv. Rev. 107 (2016) 367, Table 1, middle of its range.
        ContactMaterial("PLA", 3.5e9, 0.36, 1240.0, 60e6, 0.15, 150e-6, True),
    )
}


def contact_material(name: str) -> ContactMaterial:
    """By name, in any case. Raises `ValueError` listing the known ones."""
    for material, row in MATERIALS.items():
        if material.lower() == name.strip().lower():
            return row
    raise ValueError(f"unknown contact material {name!r}: expected one of {', '.join(MATERIALS)}")
