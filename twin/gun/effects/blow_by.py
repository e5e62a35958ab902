"""Air that leaks past the projectile."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...effects import Value, parameter
from ..effect import Floats, GunEffect, Instant
from ..flow import mass_flow
from ..shot import Shot


@dataclass(frozen=True)
class BlowBy(GunEffect):
    """Flow through the ring between bore and projectile, as wide as the bench's diameters say, plus wear.

    Corner's relation (`corner_velocity_ratio`, eq. 5.3) is the same loss by one number without geometry.
    """

    id = "gun.blow_by"
    law = "mdot = Cd pi/4 ((D + 2 w)^2 - d^2) c* p / sqrt(R T) phi(p_atm / p)"
    source = "Corner, Theory of the Interior Ballistics of Guns (1950), ch. 9; flow: ISO 6358-1:2013"
    moves: ClassVar[bool] = True

    discharge_coefficient: Value = parameter(
        "flow through the ring over flow through a nozzle", "", default=0.6, low=0.0, high=1.0, off=0.0
    )
    wear_m: Value = parameter("added to the radial clearance", "m", default=0.0, low=0.0, high=2e-3, off=0.0)

    def prepare(self, shot: Shot) -> Shot:
        bore = shot.bore_diameter_m + 2 * np.asarray(self.wear_m)
        ring = np.pi / 4 * (bore**2 - shot.projectile_diameter_m**2)
        return shot.but(leak_area_m2=np.asarray(self.discharge_coefficient) * ring)

    def leak_kg_s(self, shot: Shot, instant: Instant) -> Floats:
        return mass_flow(
            shot.leak_area_m2,
            instant.gas_pressure_pa,
            instant.gas_temperature_k,
            shot.atmosphere_pa,
            shot.temperature_k,
            shot.heat_capacity_ratio,
        )
