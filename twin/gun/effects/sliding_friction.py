"""Friction beyond the nominal coefficient."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...effects import Value, parameter
from ..bench import STANDARD_GRAVITY_M_S2
from ..shot import GunEffect, ShotInputs


@dataclass(frozen=True)
class SlidingFriction(GunEffect):
    """More weight-borne friction, and the drag of a seal or of a tight bore, which no weight
    explains."""

    id = "gun.sliding_friction"
    law = "F = mu m g + dmu m g + F_seal + s p_tank A"
    source = "Coulomb friction, as eq. 2.13; seal drag: Parker O-Ring Handbook ORD 5700, ch. 5"

    # Likely: dry pairs lie between 0.1 and 1, rubber on metal somewhat higher; a bullet that wedges
    # presses on the wall with some times its weight.
    added_coefficient: Value = parameter(
        "added to the nominal friction coefficient",
        "",
        default=0.3,
        low=0.0,
        high=10.0,
        off=0.0,
        likely=(0.0, 3.0),
        plausible=(0.0, 1.0),
        owner="bullet",
    )
    # Likely: O-rings drag by some tenths of a newton per mm of their length, up to 60 N in 50 mm of
    # bore.
    seal_force_n: Value = parameter(
        "constant drag of seal or fit",
        "N",
        default=5.0,
        low=0.0,
        high=1000.0,
        off=0.0,
        likely=(0.0, 100.0),
        owner="bullet",
    )

    # Likely: a lip that the gas presses on the bore over a tenth of the section at most, times its
    # friction
    seal_share: Value = parameter(
        "s, drag of a seal that the gas presses on the bore, over the force of the gas",
        "",
        default=0.0,
        low=0.0,
        high=0.9,
        off=0.0,
        likely=(0.0, 0.5),
        owner="bullet",
    )
    regimes: ClassVar[tuple[tuple[str, ...], ...]] = (
        ("added_coefficient", "seal_force_n"),
        ("added_coefficient", "seal_share"),
    )

    def prepare(self, shot: ShotInputs) -> ShotInputs:
        weight = shot.bullet_mass_kg * STANDARD_GRAVITY_M_S2
        seal = (
            self.seal_force_n + np.asarray(self.seal_share) * shot.tank_pressure_pa * shot.area_m2
        )
        return shot.but(
            friction_n=shot.friction_n + np.asarray(self.added_coefficient) * weight + seal
        )
