"""The atmosphere ahead of the projectile, and a gas law of absolute pressure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ...effects import Value, parameter
from ..shot import GunEffect, ShotInputs


@dataclass(frozen=True)
class BackPressure(GunEffect):
    """Gauge pressure does not expand: the gas does, from Q0 + p_atm, and the atmosphere pushes
    back.

    Without it the gun stands in a vacuum, and leaks, valve and dead volume do too: the nominal law
    knows gauge pressure only.
    """

    id = "gun.back_pressure"
    law = "m dv/dt = (p - p_atm) A - F, p (V0 + A x)^n = (Q0 + p_atm) V0^n"
    source = (
        "Corner, Theory of the Interior Ballistics of Guns (1950), ch. 9; "
        "Mungan, Eur. J. Phys. 30 (2009) 453"
    )

    # Guns are fired in air; a barrel that is pumped out is the exception.
    prior_odds: ClassVar[float] = 6.0

    # Likely: any weather, up to 1000 m above the sea; the atmosphere is there or it is left out.
    atmosphere_pa: Value = parameter(
        "absolute pressure of the atmosphere",
        "Pa",
        default=101_325.0,
        low=0.0,
        high=110_000.0,
        off=0.0,
        likely=(90e3, 105e3),
    )

    def prepare(self, shot: ShotInputs) -> ShotInputs:
        return shot.but(opposing_pressure_pa=self.atmosphere_pa)
