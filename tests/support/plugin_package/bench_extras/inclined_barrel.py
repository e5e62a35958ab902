"""A barrel that is not level."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pyroshock.twin.effects import Value, parameter
from pyroshock.twin.gun.bench import STANDARD_GRAVITY_M_S2
from pyroshock.twin.gun.shot import GunEffect, ShotInputs


@dataclass(frozen=True)
class Inclination(GunEffect):
    """The projectile climbs by the sine of the angle times the way that it has gone."""

    id = "gun.inclination"
    law = "F = m g sin(angle)"
    source = "weight on an inclined plane"
    subject = "the inclination of the barrel"
    check = "the angle of the barrel with a spirit level"

    # Likely: a gun on a table stands within 10 degrees of level.
    angle_rad: Value = parameter(
        "of the barrel above the horizontal",
        "rad",
        default=0.1,
        low=0.0,
        high=1.5,
        off=0.0,
        likely=(0.0, 0.2),
    )

    def prepare(self, shot: ShotInputs) -> ShotInputs:
        weight_n = shot.bullet_mass_kg * STANDARD_GRAVITY_M_S2
        return shot.but(friction_n=shot.friction_n + weight_n * np.sin(self.angle_rad))
