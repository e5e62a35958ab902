"""Air as a perfect gas, and its flow through holes: isentropic nozzle and ISO 6358, either way and
without kink.

The ball valve: how far the ball is turned over time, and what its port leaves open.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

from numba import njit

GAMMA = 1.4
GAS_CONSTANT = 287.05  # J/(kg K)
CV = GAS_CONSTANT / (GAMMA - 1)
CP = GAMMA * CV

CRITICAL_RATIO: float = (2 / (GAMMA + 1)) ** (GAMMA / (GAMMA - 1))
#: Mass flow through 1 m2 when choked, times sqrt(R T) / p.
CHOKED: float = math.sqrt(GAMMA) * (2 / (GAMMA + 1)) ** ((GAMMA + 1) / (2 * (GAMMA - 1)))
#: Within about this share of equal pressures flow turns from the square root of the difference to
#: the difference, smoothly: the root's infinite slope at equal pressures, or a kink in its place,
#: is where integrators get stuck.
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


@njit(cache=True)
def gas_of(mass_kg: float, energy_j: float, volume_m3: float) -> Gas:
    """The state of a mass of air with its internal energy in a volume."""
    if mass_kg <= 0 or energy_j <= 0:  # rounding, in a chamber that is all but empty
        return Gas(0.0, COLDEST_K, 0.0)
    temperature = min(max(energy_j / (mass_kg * CV), COLDEST_K), HOTTEST_K)
    return Gas((GAMMA - 1) * energy_j / volume_m3, temperature, mass_kg / volume_m3)


@njit(cache=True)
def nozzle_flow(upstream: Gas, ratio: float, area_m2: float) -> float:
    """Mass flow (kg/s) through an effective area into `ratio` (< 1) times the upstream pressure.

    Saint-Venant and Wantzel: p A / sqrt(R T) sqrt(2 gamma / (gamma - 1) (r^(2 / gamma) - r^((gamma
    + 1) / gamma))), choked below r = 0.528; laminar close to 1.
    """
    unit = area_m2 * upstream.pressure / math.sqrt(GAS_CONSTANT * upstream.temperature)
    if ratio <= CRITICAL_RATIO:
        return CHOKED * unit
    root: float = ratio ** ((GAMMA - 1) / GAMMA)
    share = 2 * GAMMA / (GAMMA - 1) * (ratio / root) ** 2 * (1 - root)
    return unit * math.sqrt(max(share, 0.0)) * _laminar(1 - ratio)


@njit(cache=True)
def iso6358_flow(upstream: Gas, ratio: float, area_m2: float, critical_ratio: float) -> float:
    """Mass flow (kg/s) by the ellipse of ISO 6358-1: choked like a nozzle of `area_m2`, but below
    another ratio b."""
    unit = CHOKED * area_m2 * upstream.pressure / math.sqrt(GAS_CONSTANT * upstream.temperature)
    if ratio <= critical_ratio:
        return unit
    share: float = 1 - ((ratio - critical_ratio) / (1 - critical_ratio)) ** 2
    return unit * math.sqrt(share) * _laminar(1 - ratio)


@njit(cache=True)
def _laminar(apart: float) -> float:
    """What is left of the square-root law when pressures are `apart` by this share."""
    return 1 / math.sqrt(math.sqrt(1 + (LAMINAR_SHARE / apart) ** 2))


def exchange(first: Gas, second: Gas, law: Law, *figures: float) -> tuple[float, float]:
    """Mass (kg/s) and enthalpy (W) that flow from the first chamber to the second, negative the
    other way.

    `law` takes the upstream gas, the ratio of pressures (< 1) and `figures`.
    """
    if first.pressure > second.pressure:
        mass = law(first, second.pressure / first.pressure, *figures)
        return mass, mass * CP * first.temperature
    if first.pressure < second.pressure:
        mass = -law(second, first.pressure / second.pressure, *figures)
        return mass, mass * CP * second.temperature
    return 0.0, 0.0


#: The ball turns this share of its quarter before its bore meets the seat.
DEAD_SHARE = 0.15
#: Largest over smallest flow that the characteristic covers: ball valves are made with 30 to 300.
RANGEABILITY = 50.0


@dataclass(frozen=True)
class ValveWay:
    """The ball's position (0 shut, 1 a quarter turn further) at moments that rise, straight lines
    in between.

    Raises `ValueError` for moments that do not rise from 0 s on or after, and positions outside of
    0 to 1.
    """

    moments_s: tuple[float, ...]
    positions: tuple[float, ...]

    def __post_init__(self) -> None:
        rising = all(first < second for first, second in pairwise(self.moments_s))
        inside = all(0 <= position <= 1 for position in self.positions)
        finite = all(0 <= moment < math.inf for moment in self.moments_s)
        if not (
            self.moments_s
            and len(self.moments_s) == len(self.positions)
            and rising
            and inside
            and finite
        ):
            raise ValueError(
                f"valve at {self.moments_s} s in {self.positions}: expected rising moments from 0 "
                "s on, and as many positions of 0 to 1"
            )

    def slowed(self, factor: float) -> ValveWay:
        """Every moment `factor` times as late."""
        return ValveWay(tuple(factor * moment for moment in self.moments_s), self.positions)

    def position(self, time_s: float) -> float:
        if time_s >= self.moments_s[-1]:
            return self.positions[-1]
        if time_s < self.moments_s[0]:
            return self.positions[0]
        k = next(k for k in range(len(self.moments_s) - 1) if time_s < self.moments_s[k + 1])
        share = (time_s - self.moments_s[k]) / (self.moments_s[k + 1] - self.moments_s[k])
        return self.positions[k] + (self.positions[k + 1] - self.positions[k]) * share

    @property
    def port_opens_s(self) -> float:
        """The moment (s) from which on the port is open; infinite where it never is."""
        begins = (0.0, *self.kinks_s)
        ends = (*begins[1:], math.inf)
        middles = (
            begin + (min(end, begin + 1.0) - begin) / 2
            for begin, end in zip(begins, ends, strict=True)
        )
        opened = (
            begin
            for begin, middle in zip(begins, middles, strict=True)
            if open_share(self.position(middle)) > 0
        )
        return next(opened, math.inf)

    @property
    def kinks_s(self) -> tuple[float, ...]:
        """Moments (s) at which the flow has a kink: where the ball changes its speed, and where its
        bore meets or leaves the seat."""
        kinks = list(self.moments_s)
        points = list(zip(self.moments_s, self.positions, strict=True))
        for (begin, first), (end, second) in pairwise(points):
            if min(first, second) < DEAD_SHARE < max(first, second):
                kinks.append(begin + (DEAD_SHARE - first) / (second - first) * (end - begin))
        return tuple(sorted(kinks))


@njit(cache=True)
def open_share(position: float) -> float:
    """Open share of the port (0 to 1) at a position of the ball.

    The inherent flow characteristic of a ball valve is close to equal percentage (IEC
    60534-2-4:2009): equal steps of the travel h multiply the flow by equal factors, R^(h - 1). That
    law leaves 1 / R at h = 0, where a ball valve is shut; with this share taken off, it is (R^h -
    1) / (R - 1).
    """
    travel = (position - DEAD_SHARE) / (1 - DEAD_SHARE)
    if travel <= 0:
        return 0.0
    if travel >= 1:
        return 1.0
    return math.expm1(travel * math.log(RANGEABILITY)) / (RANGEABILITY - 1)
