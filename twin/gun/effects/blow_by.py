"""Air that leaks past the projectile."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...effects import Value, parameter
from ..shot import GunEffect, ShotInputs


@dataclass(frozen=True)
class BlowBy(GunEffect):
    """Flow through the ring between bore and projectile, as wide as the bench's diameters say, plus
    wear.

    Corner's relation (eq. 5.3) is the same loss by one number without geometry. Eq. 2.16
    knows gauge pressure only; a leak that is reckoned likewise is choked at all pressures
    (`gauge_discharge_coefficient`), and takes less from shots of low pressure.
    """

    id = "gun.blow_by"
    law = (
        "mdot = Cd pi/4 ((D + 2 w)^2 - d^2) c* p / sqrt(R T) phi(p_atm / p), or "
        "Cd_g with gauge pressure and phi = 1"
    )
    source = (
        "Corner, Theory of the Interior Ballistics of Guns (1950), ch. 9; flow: ISO 6358-1:2013"
    )
    moves: ClassVar[bool] = True

    # Likely: a long narrow gap lets through far less than a nozzle, a rounded edge almost as much.
    discharge_coefficient: Value = parameter(
        "flow through the ring over flow through a nozzle",
        "",
        default=0.6,
        low=0.0,
        high=1.0,
        off=0.0,
        likely=(0.0, 1.0),
        owner="bullet",
    )
    # Likely: printed bullets wear by tenths of a millimetre; one beyond 1 mm would rattle in the
    # barrel.
    wear_m: Value = parameter(
        "added to the radial clearance",
        "m",
        default=0.0,
        low=0.0,
        high=2e-3,
        off=0.0,
        likely=(0.0, 1e-3),
        owner="bullet",
    )

    # Likely: as the other, and a worn ring of three times the clearance.
    gauge_discharge_coefficient: Value = parameter(
        "the same, for a choked flow at gauge pressure",
        "",
        default=0.0,
        low=0.0,
        high=10.0,
        off=0.0,
        likely=(0.002, 3.0),
        owner="bullet",
    )
    regimes: ClassVar[tuple[tuple[str, ...], ...]] = (
        ("discharge_coefficient", "wear_m"),
        ("gauge_discharge_coefficient",),
    )

    def prepare(self, shot: ShotInputs) -> ShotInputs:
        made = np.pi / 4 * (shot.bore_diameter_m**2 - shot.projectile_diameter_m**2)
        worn = (
            np.pi
            / 4
            * (
                (shot.bore_diameter_m + 2 * np.asarray(self.wear_m)) ** 2
                - shot.projectile_diameter_m**2
            )
        )
        return shot.but(
            leak_area_m2=shot.leak_area_m2 + self.discharge_coefficient * worn,
            gauge_leak_area_m2=shot.gauge_leak_area_m2 + self.gauge_discharge_coefficient * made,
        )
