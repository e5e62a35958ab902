"""Volume that the gas fills before the projectile moves."""

from __future__ import annotations

from dataclasses import dataclass

from ...effects import Value, parameter
from ..shot import GunEffect, ShotInputs


@dataclass(frozen=True)
class DeadVolume(GunEffect):
    """Pipe and chamber between valve and projectile, at first full of air at the atmosphere's
    pressure.

    Filling does no work, so the energy of both volumes adds up, and with it p V. Behind a valve of
    `gun.valve_flow` the volume fills while the shot goes on.
    """

    id = "gun.dead_volume"
    law = "p1 (V0 + Vd) = p0 V0 + p_atm Vd; the expansion starts at p1 and V0 + Vd"
    source = (
        "Moran and Shapiro, section 4.12; Rohrbach, Buresh and Madsen, Am. J. Phys. 80 (2012) 24"
    )

    # Likely: from the fitting of a hand-held gun to two metres of pipe of 40 mm; scales, so its
    # logarithm is even.
    volume_m3: Value = parameter(
        "between tank and projectile",
        "m3",
        default=2e-4,
        low=0.0,
        high=5e-3,
        off=0.0,
        likely=(2e-6, 3e-3),
    )

    def prepare(self, shot: ShotInputs) -> ShotInputs:
        return shot.but(dead_volume_m3=self.volume_m3)
