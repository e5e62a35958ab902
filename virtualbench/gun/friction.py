"""What holds the projectile back: sliding friction with its Stribeck hump, seal drag, and the air column's losses."""

from __future__ import annotations

import math

from .gas import Gas
from .setting import GunSetting

#: Friction rises from 0 to its full value over this speed, as tanh(v / v0). That replaces the jump at rest, where
#: no integrator gets past; a projectile that should stick creeps by less than 0.1 mm in 0.1 s.
CREEP_M_S = 1e-3
AIR_VISCOSITY_PA_S = 1.82e-5


def sliding_friction(setting: GunSetting, velocity: float, pressure_difference: float) -> float:
    """Force (N) against the motion, of the sign of `velocity`.

    (F_c + F_b exp(-(v / v_s)^2) + k A max(dp, 0)) tanh(v / v0): Coulomb, breakaway hump, and a seal that the gas
    presses on the wall.
    """
    hump = setting.breakaway_force_n * math.exp(-min((velocity / setting.stribeck_velocity_m_s) ** 2, 700.0))
    seal = setting.seal_area_m2 * max(pressure_difference, 0.0)
    return (setting.coulomb_force_n + hump + seal) * math.tanh(velocity / CREEP_M_S)


def column_loss(setting: GunSetting, velocity: float, gas: Gas, length_m: float, minor_loss: float) -> float:
    """Force (N) of the wall on an air column that moves with the projectile: (f l / D + K) rho v |v| / 2 A.

    Darcy's friction factor by Hagen-Poiseuille and Blasius, whichever is larger.
    """
    speed = abs(velocity)
    reynolds = max(gas.density * speed * setting.bore_m / AIR_VISCOSITY_PA_S, 1.0)
    factor: float = max(64 / reynolds, 0.3164 * reynolds**-0.25)
    heads = factor * max(length_m, 0.0) / setting.bore_m + minor_loss
    return setting.column_losses * heads * gas.density * velocity * speed / 2 * setting.area_m2
