"""The gun's motion where gas flows: one perfect gas behind the projectile, or two with a valve in between.

Behind the projectile, with V = Vb + A x, h = R T times the flow of mass, and n the polytropic index:
dp/dt = n / V (h_valve - h_leak - p A v), dM/dt = mdot_valve - mdot_leak, m dv/dt = (p - B) A - F - resistance;
in the tank dp/dt = -n h_valve / V, dM/dt = -mdot_valve. These are the balances of energy and mass of a perfect gas
(Bird, Stewart and Lightfoot, Transport Phenomena, section 15.5); without flow they are eq. 2.15.

p is the law's pressure (see `Shot`); flows see absolute pressures, and temperatures R T = p V / M.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from ..ode import DORMAND_PRINCE, Method
from ..rosenbrock import RODAS
from .effect import GunEffect, Instant
from .flow import mass_flow
from .shot import GAS_CONSTANT, Floats, Shot

#: A projectile that is slower than this is at rest.
_CREEP_M_S = 1e-4
# Of the time that the tank's pressure alone takes to the vent holes: what creeps longer behind its own leak stays.
_PATIENCE = 100.0


@dataclass(frozen=True, eq=False)
class Chamber:
    """Motion behind one gas: states (4, n) of position, velocity, the law's pressure, and mass of gas."""

    shot: Shot
    effects: Sequence[GunEffect]
    method: ClassVar[Method] = DORMAND_PRINCE
    #: Allowed in a step, relative: velocities then hold to some 1e-7.
    step_error: ClassVar[float] = 1e-8
    #: Tried first, of the time that the nominal shot takes.
    first_step: ClassVar[float] = 0.1

    @property
    def target(self) -> Floats:
        return self.shot.travel_m

    @cached_property
    def volume_m3(self) -> Floats:
        """Behind the projectile at rest."""
        return self.shot.volume_m3

    @cached_property
    def zero_pa(self) -> Floats:
        return self.shot.pressure_zero_pa

    @cached_property
    def drag_n(self) -> Floats:
        return np.asarray(self.shot.opposing_pressure_pa * self.shot.area_m2 + self.shot.friction_n)

    @cached_property
    def leaking(self) -> list[GunEffect]:
        return [effect for effect in self.effects if type(effect).leak_kg_s is not GunEffect.leak_kg_s]

    @cached_property
    def resisting(self) -> list[GunEffect]:
        return [effect for effect in self.effects if type(effect).resistance_n is not GunEffect.resistance_n]

    @cached_property
    def patience_s(self) -> Floats:
        """After which a shot counts as one that stays in the barrel."""
        shot = self.shot
        push = shot.area_m2 * np.maximum(shot.driving_pressure_pa, 1.0)
        return np.asarray(_PATIENCE * np.sqrt(shot.travel_m * shot.bullet_mass_kg / push) + 10 * shot.opening_time_s)

    def start(self) -> Floats:
        """At rest, tank and dead volume filled."""
        shot = self.shot
        rest = np.zeros(len(shot))
        return np.stack([rest, rest, shot.filled_pressure_pa, _air_kg(shot, shot.tank_volume_m3, shot.dead_volume_m3)])

    def rates(self, time: Floats, state: Floats) -> Floats:
        rates = np.empty_like(state)
        self.advance(rates, time, state, 0.0, 0.0)
        return rates

    def advance(
        self, rates: Floats, time: Floats, state: Floats, inflow_kg_s: Floats | float, inflow_w: Floats | float
    ) -> None:
        """Fills the first four rows of `rates`, for gas that comes in with a mass and R T times it."""
        shot = self.shot
        instant, volume = self.instant(time, state)
        leak = sum(effect.leak_kg_s(shot, instant) for effect in self.leaking)
        resistance = sum((effect.resistance_n(shot, instant) for effect in self.resisting), self.drag_n)
        escapes = np.asarray(leak) > 0
        warmth = instant.gas_temperature_k
        if not escapes.all():
            warmth = np.where(escapes, warmth, shot.temperature_k)
        speed, pressure = instant.velocity_m_s, state[2]
        push = pressure * shot.area_m2
        force = push - resistance
        rates[0] = speed
        # Friction holds a projectile at rest; it does not pull it back, and a corner there would stop the steps.
        if (held := force < 0).any():
            force = np.where(held, force * np.minimum(np.maximum(state[1] / _CREEP_M_S, 0.0), 1.0), force)
        rates[1] = force / shot.bullet_mass_kg
        flow = inflow_w - GAS_CONSTANT * warmth * leak - push * speed
        rates[2] = shot.polytropic_index / volume * flow
        rates[3] = inflow_kg_s - leak

    def instant(self, time: Floats, state: Floats) -> tuple[Instant, Floats]:
        """What the hooks see, and the volume behind the projectile."""
        position, velocity, pressure, mass = state[:4]
        volume = self.volume_m3 + self.shot.area_m2 * position
        absolute = pressure + self.zero_pa
        density = mass / volume
        speed = np.maximum(velocity, 0.0)
        return Instant(time, position, speed, absolute, absolute / (GAS_CONSTANT * density), density), volume

    def given_up(self, time: Floats, state: Floats) -> NDArray[np.bool_]:
        """At rest with no pressure left anywhere that could move the projectile, or on its way for too long."""
        most = state[2::2].max(axis=0)
        held = (state[1] < _CREEP_M_S) & (most * self.shot.area_m2 <= self.drag_n)
        return np.asarray(held | (time > self.patience_s))

    def take(self, rows: NDArray[np.intp]) -> Self:
        return type(self)(self.shot.take(rows), [effect.take(rows) for effect in self.effects])


# Of the tank's volume: the valve's own passage, which stands at tank pressure. Without it the volume behind
# the projectile would start at nothing; it belongs to the tank, so that a wide valve has the nominal law as its limit.
_PASSAGE = 1e-4


@dataclass(frozen=True, eq=False)
class TwoChambers(Chamber):
    """The same behind a valve: states (6, n), the last two the law's pressure in the tank and its mass of gas.

    Stiff: both pressures come together much faster than the projectile moves.
    """

    method: ClassVar[Method] = RODAS
    step_error: ClassVar[float] = 2e-7
    first_step: ClassVar[float] = 2e-4

    @cached_property
    def tank_m3(self) -> Floats:
        return np.asarray(self.shot.tank_volume_m3 * (1 - _PASSAGE))

    @cached_property
    def volume_m3(self) -> Floats:
        return np.asarray(self.shot.tank_volume_m3 * _PASSAGE + self.shot.dead_volume_m3)

    def start(self) -> Floats:
        """At rest, dead volume and the valve's passage filled."""
        shot = self.shot
        rest, passage = np.zeros(len(shot)), shot.tank_volume_m3 * _PASSAGE
        energy = shot.driving_pressure_pa * passage + shot.opposing_pressure_pa * shot.dead_volume_m3
        behind = [rest, rest, energy / self.volume_m3, _air_kg(shot, passage, shot.dead_volume_m3)]
        return np.stack([*behind, shot.driving_pressure_pa, _air_kg(shot, self.tank_m3, rest)])

    def rates(self, time: Floats, state: Floats) -> Floats:
        shot, rates = self.shot, np.empty_like(state)
        tank = state[4] + self.zero_pa
        behind = state[2] + self.zero_pa
        tank_k = tank * self.tank_m3 / (GAS_CONSTANT * state[5])
        behind_k = behind * (self.volume_m3 + shot.area_m2 * state[0]) / (GAS_CONSTANT * state[3])
        area = shot.valve_area_m2 * opened(time, shot.opening_time_s)
        flow = mass_flow(area, tank, tank_k, behind, behind_k, shot.heat_capacity_ratio)
        carried = GAS_CONSTANT * np.where(flow > 0, tank_k, behind_k) * flow
        self.advance(rates, time, state, flow, carried)
        rates[4] = -shot.polytropic_index / self.tank_m3 * carried
        rates[5] = -flow
        return rates


def opened(time_s: Floats, opening_time_s: Floats) -> Floats:
    """Share of a ball valve's area that is open while its passage moves in front of the bore at even speed.

    Two circles of one size whose centres are a share s of their diameter apart have 2 / pi (acos s - s sqrt(1 - s^2))
    of their area in common.
    """
    instant = opening_time_s <= 0
    turned = np.where(instant, 1.0, time_s / np.where(instant, 1.0, opening_time_s))
    apart = 1 - np.minimum(turned, 1.0)
    return np.asarray((np.arccos(apart) - apart * np.sqrt(1 - apart * apart)) * (2 / np.pi))


def _air_kg(shot: Shot, at_tank_pressure_m3: Floats, at_atmosphere_m3: Floats) -> Floats:
    """Mass of gas in volumes at absolute tank pressure and at the atmosphere's, all at room temperature."""
    tank_pa = shot.tank_pressure_pa + shot.atmosphere_pa
    energy = tank_pa * at_tank_pressure_m3 + shot.atmosphere_pa * at_atmosphere_m3
    return np.asarray(energy / (GAS_CONSTANT * shot.temperature_k))
