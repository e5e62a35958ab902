"""Air as a perfect gas, and its flow through holes: isentropic nozzle and ISO 6358, either way and without kink."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

__all__ = ["CP", "CV", "GAMMA", "GAS_CONSTANT", "Gas", "exchange", "gas_of", "iso6358_flow", "nozzle_flow"]

GAMMA = 1.4
GAS_CONSTANT = 287.05  # J/(kg K)
CV = GAS_CONSTANT / (GAMMA - 1)
CP = GAMMA * CV

CRITICAL_RATIO: float = (2 / (GAMMA + 1)) ** (GAMMA / (GAMMA - 1))
#: Mass flow through 1 m2 when choked, times sqrt(R T) / p.
CHOKED: float = math.sqrt(GAMMA) * (2 / (GAMMA + 1)) ** ((GAMMA + 1) / (2 * (GAMMA - 1)))
#: Within about this share of equal pressures flow turns from the square root of the difference to the difference,
#: smoothly: the root's infinite slope at equal pressures, or a kink in its place, is where integrators get stuck.
LAMINAR_SHARE = 1e-3
#: A chamber that is all but empty has a temperature made of rounding errors.
COLDEST_K, HOTTEST_K = 30.0, 3000.0


class Gas(NamedTuple):
    """Absolute pressure (Pa), temperature (K), density (kg/m3)."""

    pressure: float
    temperature: float
    density: float


#: A law of flow: upstream gas, ratio of pressures, and its own figures to a mass flow (kg/s).
Law = Callable[..., float]


def gas_of(mass_kg: float, energy_j: float, volume_m3: float) -> Gas:
    """The state of a mass of air with its internal energy in a volume."""
    if mass_kg <= 0 or energy_j <= 0:  # rounding, in a chamber that is all but empty
        return Gas(0.0, COLDEST_K, 0.0)
    temperature = min(max(energy_j / (mass_kg * CV), COLDEST_K), HOTTEST_K)
    return Gas((GAMMA - 1) * energy_j / volume_m3, temperature, mass_kg / volume_m3)


def nozzle_flow(upstream: Gas, ratio: float, area_m2: float) -> float:
    """Mass flow (kg/s) through an effective area into `ratio` (< 1) times the upstream pressure.

    Saint-Venant and Wantzel: p A / sqrt(R T) sqrt(2 gamma / (gamma - 1) (r^(2 / gamma) - r^((gamma + 1) / gamma))),
    choked below r = 0.528; laminar close to 1.
    """
    unit = area_m2 * upstream.pressure / math.sqrt(GAS_CONSTANT * upstream.temperature)
    if ratio <= CRITICAL_RATIO:
        return CHOKED * unit
    root: float = ratio ** ((GAMMA - 1) / GAMMA)
    share = 2 * GAMMA / (GAMMA - 1) * (ratio / root) ** 2 * (1 - root)
    return unit * math.sqrt(max(share, 0.0)) * _laminar(1 - ratio)


def iso6358_flow(upstream: Gas, ratio: float, area_m2: float, critical_ratio: float) -> float:
    """Mass flow (kg/s) by the ellipse of ISO 6358-1: choked like a nozzle of `area_m2`, but below another ratio b."""
    unit = CHOKED * area_m2 * upstream.pressure / math.sqrt(GAS_CONSTANT * upstream.temperature)
    if ratio <= critical_ratio:
        return unit
    share: float = 1 - ((ratio - critical_ratio) / (1 - critical_ratio)) ** 2
    return unit * math.sqrt(share) * _laminar(1 - ratio)


def _laminar(apart: float) -> float:
    """What is left of the square-root law when pressures are `apart` by this share."""
    return 1 / math.sqrt(math.sqrt(1 + (LAMINAR_SHARE / apart) ** 2))


def exchange(first: Gas, second: Gas, law: Law, *figures: float) -> tuple[float, float]:
    """Mass (kg/s) and enthalpy (W) that flow from the first chamber to the second, negative the other way.

    `law` takes the upstream gas, the ratio of pressures (< 1) and `figures`.
    """
    if first.pressure > second.pressure:
        mass = law(first, second.pressure / first.pressure, *figures)
        return mass, mass * CP * first.temperature
    if first.pressure < second.pressure:
        mass = -law(second, first.pressure / second.pressure, *figures)
        return mass, mass * CP * second.temperature
    return 0.0, 0.0
