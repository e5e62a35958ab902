"""The gun's motion where gas flows: one perfect gas behind the projectile, or two with a valve in
between.

Behind the projectile, with V = Vb + A x, h = R T times the flow of mass, and n the polytropic
index: dp/dt = n / V (h_valve - h_leak - p A v), dM/dt = mdot_valve - mdot_leak, m dv/dt = (p - B) A
- F - resistance; in the tank dp/dt = -n h_valve / V, dM/dt = -mdot_valve. These are the balances of
energy and mass of a perfect gas (Bird, Stewart and Lightfoot, Transport Phenomena, section 15.5);
without flow they are eq. 2.15.

The resistance is A v^2 / 2 (f x / D rho_gas + H_air rho_air + H_gas p / (R T)), f, H_air and H_gas
being those of the `ShotInputs`, and what hooks of effects add.

p is the law's pressure (see `ShotInputs`); flows see absolute pressures, and temperatures R T = p V
/ M.

Flow of a gas through an opening, as ISO 6358 writes it, by its area of flow.

mdot = A c* p1 / sqrt(R T1) phi(p2 / p1), c* = sqrt(gamma) (2 / (gamma + 1))^((gamma + 1) / (2 gamma
- 2)), phi(r) = 1 up to the critical ratio b, sqrt(1 - ((r - b) / (1 - b))^2) above it; p1, T1
upstream, p2 downstream.

With b = (2 / (gamma + 1))^(gamma / (gamma - 1)), that of a nozzle, phi as it stands here follows de
Saint-Venant and Wantzel's law within 0.4 % up to a ratio of 0.9 and 1.5 % up to 0.99; nearer to 1
it is laminar. The numbers of a gas are here; `motion_kernel.mass_flow` is the law.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .. import ode
from ..ode import DORMAND_PRINCE, RODAS, Ends, Method, StepTolerance
from .motion_kernel import QUANTITIES, REACHED, TOO_MANY_STEPS, all_rates, run_all
from .shot import ATMOSPHERE_PA, GAS_CONSTANT, GunEffect, Instant, ShotInputs


@cache
def critical_ratio(heat_capacity_ratio: float) -> float:
    """b of a nozzle; its limit exp(-1/2) for an isothermal gas."""
    g = max(heat_capacity_ratio, 1 + 1e-9)
    return math.pow(2 / (g + 1), g / (g - 1))


@cache
def choked_flow(heat_capacity_ratio: float) -> float:
    """c*: mass flow times sqrt(R T) over area and pressure; 0.6847 for air."""
    g = max(heat_capacity_ratio, 1 + 1e-9)
    return math.sqrt(g) * math.pow(2 / (g + 1), (g + 1) / (2 * (g - 1)))


#: A projectile that is slower than this is at rest, and than so many of the errors that a step may
#: make of its speed: steps that cannot tell whether friction holds it would stay where it stops for
#: ever.
_CREEP_M_S, _CREEP_ERRORS = 1e-4, 20.0
# Of the time that the tank's pressure alone takes to the vent holes: what creeps longer behind its
# own leak stays.
_PATIENCE = 100.0
# What a position or a speed counts as at least, of travel and mean speed, where the error of a step
# is judged.
_SIZE = 0.1


@dataclass(frozen=True, eq=False)
class Chamber:
    """Motion behind one gas: states (4, n) of position, velocity, the law's pressure, and mass of
    gas.

    `effects` are those with a hook; without any the compiled motion is what runs.
    """

    shot: ShotInputs
    effects: Sequence[GunEffect]
    #: A factor on the error that a step may make.
    coarser: float = 1.0
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
    def nominal_time_s(self) -> Floats:
        """sqrt(L m / (p A)) with the tank's pressure."""
        shot = self.shot
        push = shot.area_m2 * np.maximum(shot.driving_pressure_pa, 1.0)
        return np.asarray(np.sqrt(shot.travel_m * shot.bullet_mass_kg / push))

    @cached_property
    def creep_m_s(self) -> Floats:
        """Below which a projectile is at rest."""
        error = self.coarser * self.step_error * _SIZE * self.shot.travel_m / self.nominal_time_s
        return np.maximum(_CREEP_M_S, _CREEP_ERRORS * error)

    @cached_property
    def patience_s(self) -> Floats:
        """After which a shot counts as one that stays in the barrel."""
        return np.asarray(
            _PATIENCE * self.nominal_time_s + 10 * self.valve[:, 0].max(axis=1, initial=0.0)
        )

    @cached_property
    def valve(self) -> Floats:
        """Moments and positions of each shot's valve, (n, 2, k); k is 0 without a valve."""
        return np.empty((len(self.shot), 2, 0))

    def start(self) -> Floats:
        """At rest, tank and dead volume filled."""
        shot = self.shot
        rest = np.zeros(len(shot))
        return np.stack(
            [
                rest,
                rest,
                shot.filled_pressure_pa,
                air_kg(shot, shot.tank_volume_m3, shot.dead_volume_m3),
            ]
        )

    @cached_property
    def table(self) -> NDArray[Any]:
        """The shots as the compiled motion takes them, one record each."""
        shot = self.shot
        choked = choked_flow(shot.heat_capacity_ratio)
        table = np.zeros(len(shot), QUANTITIES)
        table["area_m2"], table["mass_kg"], table["index"] = (
            shot.area_m2,
            shot.bullet_mass_kg,
            shot.polytropic_index,
        )
        table["volume_m3"], table["zero_pa"], table["drag_n"] = (
            self.volume_m3,
            self.zero_pa,
            self.drag_n,
        )
        table["outside_pa"], table["outside_rt"] = (
            shot.atmosphere_pa,
            GAS_CONSTANT * shot.temperature_k,
        )
        table["critical_ratio"] = critical_ratio(shot.heat_capacity_ratio)
        table["leak_m2"], table["gauge_leak_m2"] = (
            shot.leak_area_m2 * choked,
            shot.gauge_leak_area_m2 * choked,
        )
        table["wall_1_m"], table["gas_heads"] = (
            shot.friction_factor / shot.bore_diameter_m,
            shot.gas_heads,
        )
        table["air_density_kg_m3"] = shot.air_heads * ATMOSPHERE_PA / table["outside_rt"]
        table["travel_m"], table["patience_s"] = shot.travel_m, self.patience_s
        table["creep_m_s"] = self.creep_m_s
        return table

    def rates(self, time: Floats, state: Floats) -> Floats:
        columns = np.ascontiguousarray(np.moveaxis(state, 0, -1))
        rates = np.empty_like(columns)
        resistance, leak = self._hooked(time, state)
        instants = (-1, len(self.shot), len(state))
        flat = (-1, len(self.shot))
        all_rates(
            self.table,
            self.valve,
            np.ascontiguousarray(time).reshape(flat),
            columns.reshape(instants),
            leak.reshape(flat),
            resistance.reshape(flat),
            rates.reshape(instants),
        )
        return np.moveaxis(rates, -1, 0)

    def _hooked(self, time: Floats, state: Floats) -> tuple[Floats, Floats]:
        """Resistance and leak of the effects' hooks, of the shape of `time`."""
        resistance, leak = np.zeros(time.shape), np.zeros(time.shape)
        if self.effects:
            instant = self.instant(time, state)
            for effect in self.effects:
                resistance += effect.resistance_n(self.shot, instant)
                leak += effect.leak_kg_s(self.shot, instant)
        return resistance, leak

    def run(self, leads_s: Floats | None = None) -> tuple[Ends, Floats]:
        """Every shot to its end, and the law's tank pressure, position and velocity (n, m, 3) at
        `leads_s` (n, m) before it, NaN where a shot does not reach it, and with hooks. Raises
        `RuntimeError` when one takes more than 200,000 steps."""
        shot, start = self.shot, self.start()
        floor = np.empty_like(start)
        floor[0], floor[1] = _SIZE * shot.travel_m, _SIZE * shot.travel_m / self.nominal_time_s
        floor[2::2], floor[3::2] = shot.driving_pressure_pa, 0.01 * start[3::2].max(axis=0)
        floor, steps = np.maximum(floor, 1e-300), self.first_step * self.nominal_time_s
        leads = (
            np.empty((len(shot), 0))
            if leads_s is None
            else np.ascontiguousarray(leads_s, dtype=np.float64)
        )
        earlier = np.full((*leads.shape, 3), np.nan)
        relative = self.coarser * self.step_error
        if self.effects:
            return ode.run(self, start, steps, StepTolerance(relative, floor), self.method), earlier
        n = len(shot)
        states, floors = start.T.copy(), floor.T.copy()
        time, how = np.zeros(n), np.zeros(n, dtype=np.int64)
        run_all(
            self.table,
            self.valve,
            states,
            steps,
            floors,
            relative,
            ode.MOST_STEPS,
            time,
            how,
            leads,
            earlier,
        )
        if (endless := np.flatnonzero(how == TOO_MANY_STEPS)).size:
            raise RuntimeError(
                f"shot number {endless[0]} of {n} took more than {ode.MOST_STEPS} steps"
            )
        return Ends(time, states.T, how == REACHED), earlier

    def instant(self, time: Floats, state: Floats) -> Instant:
        """What the hooks see."""
        position, velocity, pressure, mass = state[:4]
        volume = self.volume_m3 + self.shot.area_m2 * position
        absolute = pressure + self.zero_pa
        density = mass / volume
        speed = np.maximum(velocity, 0.0)
        return Instant(
            time, position, speed, absolute, absolute / (GAS_CONSTANT * density), density
        )

    def given_up(self, time: Floats, state: Floats) -> NDArray[np.bool_]:
        """At rest with no pressure left anywhere that could move the projectile, or on its way for
        too long."""
        most = state[2::2].max(axis=0)
        held = (state[1] < self.creep_m_s) & (most * self.shot.area_m2 <= self.drag_n)
        return np.asarray(held | (time > self.patience_s))

    def longest_step(self, time: Floats) -> Floats:
        """Up to the next corner of the rates."""
        return np.full(time.shape, np.inf)

    def take(self, rows: NDArray[np.intp]) -> Self:
        return type(self)(
            self.shot.take(rows), [effect.take(rows) for effect in self.effects], self.coarser
        )


# Of the tank's volume: the valve's own passage, which stands at tank pressure. Without it the
# volume behind the projectile would start at nothing; it belongs to the tank, so that a wide valve
# has the nominal law as its limit.
_PASSAGE = 1e-4


@dataclass(frozen=True, eq=False)
class TwoChambers(Chamber):
    """The same behind a valve: states (6, n), the last two the law's pressure in the tank and its
    mass of gas.

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

    @cached_property
    def valve(self) -> Floats:
        """Evenly open within the opening time, unless the shot states a profile."""
        shot, profile = self.shot, self.shot.valve_profile
        evenly = np.zeros((len(shot), 2, max(2, profile.shape[2])))
        evenly[:, 0, 1:], evenly[:, 1, 1:] = shot.opening_time_s[:, None], 1.0
        if not profile.shape[2]:
            return evenly
        stated = np.pad(
            profile, ((0, 0), (0, 0), (0, evenly.shape[2] - profile.shape[2])), mode="edge"
        )
        return np.asarray(np.where(np.isnan(stated), evenly, stated), dtype=np.float64)

    def longest_step(self, time: Floats) -> Floats:
        moments = self.valve[:, 0]
        return np.asarray(np.where(moments > time[:, None], moments, np.inf).min(axis=1) - time)

    def start(self) -> Floats:
        """At rest, dead volume and the valve's passage filled."""
        shot = self.shot
        rest, passage = np.zeros(len(shot)), shot.tank_volume_m3 * _PASSAGE
        energy = (
            shot.driving_pressure_pa * passage + shot.opposing_pressure_pa * shot.dead_volume_m3
        )
        behind = [rest, rest, energy / self.volume_m3, air_kg(shot, passage, shot.dead_volume_m3)]
        return np.stack([*behind, shot.driving_pressure_pa, air_kg(shot, self.tank_m3, rest)])

    @cached_property
    def table(self) -> NDArray[Any]:
        table, shot = super().table, self.shot
        table["tank_m3"] = self.tank_m3
        table["valve_m2"] = shot.valve_area_m2 * choked_flow(shot.heat_capacity_ratio)
        return table


def air_kg(shot: ShotInputs, at_tank_pressure_m3: Floats, at_atmosphere_m3: Floats) -> Floats:
    """Mass of gas in volumes at absolute tank pressure and at the atmosphere's, all at room
    temperature."""
    tank_pa = shot.tank_pressure_pa + shot.atmosphere_pa
    energy = tank_pa * at_tank_pressure_m3 + shot.atmosphere_pa * at_atmosphere_m3
    return np.asarray(energy / (GAS_CONSTANT * shot.temperature_k))
