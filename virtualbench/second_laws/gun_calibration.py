"""The gun's second laws for calibration, as functions of what the gas and the projectile do at one
moment.

`table.LAWS` names each law's source; here it stands as an equation. Strength s of each:

- back pressure: s atmospheres ahead, shut in between the projectile and a muzzle that leaves a
  tenth of the bore free: the air is compressed isentropically and leaves through that orifice;
- leak: m' = C a s (p - p_a) p / sqrt(R T), a lip whose gap grows with the pressure that lifts it;
- valve: a poppet that the tank's pressure throws open, lift p t^2, over s times its time and with 1
  / s of the area;
- bore: s A rho v^2 / 2 0.316 Re^(-1/4) (x + l) / D, Blasius' smooth wall in the bore and the line
  before it;
- friction: s k F0 (1 + p / p0)^(2/3), a rubber seal whose friction goes with its load to the 2/3;
- heat: s h A_w (T_wall - T), h by Nu = 0.13 Ra^(1/3), from wires in the tank;
- dead volume: s times the build's, in a hose that grows evenly with pressure and does work on its
  wall.
"""

from __future__ import annotations

import math

from numba import njit

from ..gun.gas import CHOKED, GAMMA, GAS_CONSTANT
from ..gun.motion import AIR_VISCOSITY_PA_S

#: What a sound absorber at the muzzle leaves free of the bore, with its coefficient of discharge.
FREE_MUZZLE = 0.1
#: The air ahead has no less room than this share of the barrel: the absorber's own.
LEAST_ROOM = 0.1
#: A lip at this pressure (gauge) leaks through half of the bullet's clearance.
LIFTING_PA, LIFTED_SHARE = 1e5, 0.5
#: ISO 6358-1: b of poppet valves, 0.2 to 0.3, and of sharp-edged holes, 0.4 to 0.5.
POPPET_RATIO, HOLE_RATIO = 0.25, 0.45
#: A poppet under this pressure is open after so many of the first law's opening times: its inertia
#: gives a lift p t^2.
THROWN_PA, THROWN_OPENING = 2e5, 1.2
#: A smooth line of the bore's width between tank and barrel.
LINE_M = 3.0
#: A rubber lip: its friction without gas, and the pressure of its own squeeze. Hertz: friction
#: load^(2/3).
LIP_FRICTION_N, SQUEEZE_PA, LOAD_EXPONENT = 1.5, 2e4, 2 / 3
#: Wires in the tank (ISO 6358-2's isothermal tank has far more) over the area of a sphere of its
#: volume.
WIRE_AREA = 8.0
AIR_CONDUCTIVITY_W_M_K, PRANDTL, GRAVITY_M_S2 = 0.026, 0.71, 9.81
#: Of a hose's stated volume, what it has unloaded, and the pressure (gauge) at which it has all of
#: it.
SLACK_SHARE, FULL_HOSE_PA = 0.6, 1e5


@njit(cache=True)
def sonic_flow(pressure: float, temperature: float, ratio: float, critical: float) -> float:
    """Mass flow (kg/s) through 1 m2 by ISO 6358-1's ellipse; straight within a thousandth of equal
    pressures."""
    unit = CHOKED * pressure / math.sqrt(GAS_CONSTANT * temperature)
    if ratio <= critical:
        return float(unit)
    held = min(ratio, 0.999)
    share = (held - critical) / (1 - critical)
    flow: float = unit * math.sqrt(1 - share * share)
    return flow * (1 - ratio) / 0.001 if ratio > held else flow


@njit(cache=True)
def poppet_lift(time: float, pressure: float, opening: float) -> float:
    """Share of its travel that a poppet has gone, of constant mass under the pressure (Pa,
    absolute) behind it."""
    lift: float = pressure / THROWN_PA * (time / opening) ** 2
    return min(max(lift, 0.0), 1.0)


@njit(cache=True)
def smooth_drop_pa(density: float, speed: float, length: float, bore: float) -> float:
    """Pressure that a smooth wall takes along a length (m), with the sign of the speed: Blasius, f
    = 0.316 Re^-1/4."""
    reynolds = density * abs(speed) * bore / AIR_VISCOSITY_PA_S
    if reynolds <= 0:
        return 0.0
    drop: float = 0.316 * reynolds**-0.25 * length / bore * density * speed * abs(speed) / 2
    return drop


@njit(cache=True)
def lip_friction_n(gauge: float) -> float:
    """Friction of a rubber lip that a gauge pressure (Pa) presses on the wall."""
    friction: float = LIP_FRICTION_N * (1 + max(gauge, 0.0) / SQUEEZE_PA) ** LOAD_EXPONENT
    return friction


@njit(cache=True)
def natural_film_w_m2_k(density: float, temperature: float, wall: float) -> float:
    """Film of turbulent natural convection of air, whatever the size: Nu = 0.13 (Gr Pr)^(1/3)."""
    if density <= 0 or temperature <= 0:
        return 0.0
    buoyancy = (
        GRAVITY_M_S2 * abs(wall - temperature) / temperature * (density / AIR_VISCOSITY_PA_S) ** 2
    )
    film: float = 0.13 * AIR_CONDUCTIVITY_W_M_K * (buoyancy * PRANDTL) ** (1 / 3)
    return film


@njit(cache=True)
def hose_pressure_pa(energy: float, volume: float, growth: float, ambient: float) -> float:
    """Pressure (absolute) of gas in a rigid volume and a hose that grows by `growth` (m3/Pa) above
    the ambient one.

    The energy is that of the gas and of the hose, which has stored the gas's work, growth (p^2 -
    p_a^2) / 2.
    """
    square = growth * (1 + (GAMMA - 1) / 2)
    linear = volume - growth * ambient
    constant = (GAMMA - 1) * (energy + growth * ambient * ambient / 2)
    # this form of the root has no difference of nearly equal numbers where the hose is stiff
    pressure: float = 2 * constant / (linear + math.sqrt(linear * linear + 4 * square * constant))
    return pressure
