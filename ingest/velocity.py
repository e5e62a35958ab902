"""Velocities of the bench: at the muzzle by laser, at contact by the impactor's deceleration; and the tank pressure."""

from __future__ import annotations

from .deceleration import ImpactVelocity, impact_velocity
from .laser import MuzzleVelocity, NoPassageError, muzzle_velocity, muzzle_velocity_uncertainty
from .tank_pressure import NoDropError, TankPressure, tank_pressure_before

__all__ = [
    "ImpactVelocity",
    "MuzzleVelocity",
    "NoDropError",
    "NoPassageError",
    "TankPressure",
    "impact_velocity",
    "muzzle_velocity",
    "muzzle_velocity_uncertainty",
    "tank_pressure_before",
]
