"""Losses that grow with the square of speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ...effects import Value, parameter
from ..shot import GunEffect, ShotInputs


@dataclass(frozen=True)
class BarrelLoss(GunEffect):
    """The air that moves behind the projectile rubs along the bore (Darcy and Weisbach), the air
    ahead drags.

    The drop of pressure along the column is taken from the force at its front. The inertia of the
    column is left out. What the gas loses where it enters the bore does not hang on how far the
    projectile is (`gas_heads`); its density is reckoned as eq. 2.16 reckons pressure, from the
    gauge pressure.
    """

    id = "gun.barrel_loss"
    law = "F = A v^2 / 2 (f x / D rho_gas + Cd rho_atm + H p / (R T))"
    source = (
        "Darcy-Weisbach: White, Fluid Mechanics, ch. 6; drag: Hoerner, "
        "Fluid-Dynamic Drag (1965), ch. 3"
    )
    moves: ClassVar[bool] = True

    # Likely: Moody's chart, smooth to fully rough.
    friction_factor: Value = parameter(
        "Darcy's, of the bore", "", default=0.02, low=0.0, high=1.0, off=0.0, likely=(0.0, 0.1)
    )
    # Likely: 1 in the open; many times that in a tube, where the air ahead has nowhere to go but
    # out of the barrel. As wide as a valve's steady loss: the two laws are one, and none may be
    # preferred for its range. Plausible: the air ahead that fills the bore costs f L / D, at most
    # 0.04 over 100 diameters, and 1 at the muzzle (White, ch. 6).
    drag_coefficient: Value = parameter(
        "of the projectile, on its cross section",
        "",
        default=1.0,
        low=0.0,
        high=1e4,
        off=0.0,
        likely=(0.0, 300.0),
        plausible=(0.0, 5.0),
    )

    # Likely: a sharp entrance 0.5, bends and reducers up to some tens (Idelchik, ch. 3 to 6)
    gas_heads: Value = parameter(
        "H, dynamic heads of the driving gas",
        "",
        default=0.0,
        low=0.0,
        high=1e4,
        off=0.0,
        likely=(0.05, 100.0),
    )
    regimes: ClassVar[tuple[tuple[str, ...], ...]] = (
        ("friction_factor", "drag_coefficient"),
        ("gas_heads",),
    )

    def prepare(self, shot: ShotInputs) -> ShotInputs:
        return shot.but(
            friction_factor=shot.friction_factor + self.friction_factor,
            air_heads=shot.air_heads + self.drag_coefficient,
            gas_heads=shot.gas_heads + self.gas_heads,
        )
