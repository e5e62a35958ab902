"""Expansion that is not adiabatic."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...effects import Value, parameter
from ..effect import GunEffect
from ..shot import Shot


@dataclass(frozen=True)
class HeatExchange(GunEffect):
    """Walls give the gas a share of the heat that would keep it at its temperature; a negative share takes heat away.

    The index is n = gamma - share (gamma - 1): gamma with 0, isothermal with 1.
    """

    id = "gun.heat_exchange"
    law = "p V^n = const, n = gamma - s (gamma - 1)"
    source = "polytropic change of state: Moran and Shapiro, Fundamentals of Engineering Thermodynamics, section 6.11"

    # Likely: gas that expands is colder than its walls, so heat flows in; a colder wall is no gun's.
    share: Value = parameter(
        "of the heat of an isothermal expansion that reaches the gas",
        "",
        default=0.3,
        low=-0.5,
        high=1.0,
        off=0.0,
        likely=(0.0, 1.0),
    )

    def prepare(self, shot: Shot) -> Shot:
        gamma = shot.heat_capacity_ratio
        return shot.but(polytropic_index=gamma - np.asarray(self.share) * (gamma - 1))
