"""The valve between tank and barrel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...effects import Value, parameter
from ..effect import GunEffect
from ..shot import Shot


@dataclass(frozen=True)
class ValveFlow(GunEffect):
    """A ball valve of the bore's size with a loss coefficient, which opens evenly; tank and barrel are two gases.

    The loss coefficient K counts dynamic heads of the flow in the bore, those of the way from the tank included: area
    of flow A / sqrt(K). A smaller valve of diameter d has K (D / d)^4.
    """

    id = "gun.valve_flow"
    law = "mdot = a(t / t_open) A / sqrt(K) c* p1 / sqrt(R T1) phi(p2 / p1)"
    source = "ISO 6358-1:2013; loss coefficients: Idelchik, Handbook of Hydraulic Resistance, ch. 3 and 9"

    loss_coefficient: Value = parameter(
        "dynamic heads lost in the open valve and on the way to it", "", default=1.0, low=0.0, high=1e4, off=0.0
    )
    opening_time_s: Value = parameter("until the valve is wide open", "s", default=0.1, low=0.0, high=2.0, off=0.0)

    def prepare(self, shot: Shot) -> Shot:
        loss = np.asarray(self.loss_coefficient, dtype=np.float64)
        with np.errstate(divide="ignore"):
            area = np.pi / 4 * shot.bore_diameter_m**2 / np.sqrt(loss)
        return shot.but(valve_area_m2=area, opening_time_s=self.opening_time_s)
