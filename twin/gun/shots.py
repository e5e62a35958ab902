"""The gun stage: tank pressures to muzzle velocities, nominal or with effects.

The gun in closed form: eq. 2.16 with any index, dead volume, pressure ahead and constant friction.

Work along the barrel, with V = V0 + Vd, P the law's pressure after filling, B the pressure ahead
and F the friction: W(x) = P V / (n - 1) [1 - (V / (V + A x))^(n - 1)] - (B A + F) x, and m v^2 / 2
= W(L).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...array_types import Floats
from ...signals.valve_profile import ValveProfile
from ..effects import checked_effects
from .bench import GunBench, checked
from .shot import ATMOSPHERE_PA, GAS_CONSTANT, GunEffect, ShotInputs, nominal_shot, profile_table

if TYPE_CHECKING:
    from .chambers import Chamber
    from .emptying import GasAtExit


# A Gauss rule over s in x = L s^2, in which speed begins linearly.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(48)
_PHASES, _WEIGHTS = (_NODES + 1) / 2, _WEIGHTS / 2


def net_work_j(shot: ShotInputs, position_m: Floats) -> Floats:
    """W, the net work on the projectile up to positions along the barrel, (..., n).

    Parameters:
        shot: n shots.
        position_m: x of the projectile from its place at rest, (..., n).
    """
    from scipy.special import exprel

    growth = np.log1p(shot.area_m2 * position_m / shot.volume_m3)
    # exprel keeps the digits for large tanks, and is the isothermal law at an index of one.
    work = (
        shot.filled_pressure_pa
        * shot.volume_m3
        * growth
        * exprel((1 - shot.polytropic_index) * growth)
    )
    return np.asarray(
        work - (shot.opposing_pressure_pa * shot.area_m2 + shot.friction_n) * position_m
    )


def starting_force_n(shot: ShotInputs) -> Floats:
    """The net force on the projectile at rest, (n,).

    Parameters:
        shot: n shots.
    """
    return np.asarray(
        (shot.filled_pressure_pa - shot.opposing_pressure_pa) * shot.area_m2 - shot.friction_n
    )


def ideal_velocity_m_s(shot: ShotInputs) -> Floats:
    """The velocity at the vent holes, (n,), without the efficiency; 0 for a shot that does not get
    there.

    Parameters:
        shot: n shots.
    """
    return np.asarray(
        np.sqrt(np.maximum(2 * net_work_j(shot, shot.travel_m) / shot.bullet_mass_kg, 0.0))
    )


def travel_time_s(shot: ShotInputs) -> Floats:
    """The time until the vent holes, (n,): the integral of dx / v.

    Parameters:
        shot: n shots that get there.
    """
    phases = _PHASES[:, None]
    energy = net_work_j(shot, shot.travel_m * phases**2)
    speed = np.sqrt(2 * energy / shot.bullet_mass_kg)
    return np.asarray(_WEIGHTS @ (2 * shot.travel_m * phases / speed))


#: Places s of x = L s^2 between which the time on the way is interpolated.
_WAY = np.linspace(0.0, 1.0, 129)


def earlier_pressures_pa(shot: ShotInputs, leads_s: Floats) -> Floats:
    """The law's tank pressure at moments before the exit, (n, m), eq. 2.15 along the way.

    What is before the start is as at the start, when tank and dead volume are filled.

    Parameters:
        shot: n shots that get to the vent holes.
        leads_s: How long before the exit each of the m moments of a shot is, (n, m), 0 or more.
    """
    energy = net_work_j(shot, shot.travel_m * _WAY[1:, None] ** 2)
    slowness = np.empty((_WAY.size, len(shot)))  # dt / ds, which is finite at rest
    slowness[1:] = 2 * shot.travel_m * _WAY[1:, None] / np.sqrt(2 * energy / shot.bullet_mass_kg)
    slowness[0] = np.sqrt(
        2 * shot.travel_m * shot.bullet_mass_kg / np.maximum(starting_force_n(shot), 1e-300)
    )
    steps = (slowness[1:] + slowness[:-1]) / 2 * np.diff(_WAY)[:, None]
    elapsed = np.concatenate([np.zeros((1, len(shot))), np.cumsum(steps, axis=0)])
    places = np.array(
        [
            np.interp(times[-1] - leads, times, _WAY, left=0.0)
            for times, leads in zip(elapsed.T, leads_s, strict=True)
        ]
    ).reshape(leads_s.shape)
    growth = 1 + (shot.area_m2 * shot.travel_m / shot.volume_m3)[:, None] * places**2
    return np.asarray(shot.filled_pressure_pa[:, None] * growth ** -shot.polytropic_index[:, None])


class Status(IntEnum):
    """How a shot ended."""

    LEFT = 0
    STOPPED = 1  # in the barrel
    NOT_STARTED = 2

    @property
    def words(self) -> str:
        return ("left", "stopped in the barrel", "did not start")[self]


@dataclass(frozen=True, eq=False)
class GunShots:
    """n shots: velocity at the vent holes (0 for one that does not get there), when (NaN), and
    `Status` of each.

    `tank_pressure_pa` (n, m): gauge, at the m moments about the exit that were asked for; NaN for a
    shot that does not get there, and where a hook of an effect acts.
    """

    velocity_m_s: Floats
    exit_time_s: Floats
    status: NDArray[np.int_]
    tank_pressure_pa: Floats

    @property
    def left(self) -> NDArray[np.bool_]:
        return np.asarray(self.status == Status.LEFT)

    def put(self, rows: NDArray[np.intp], others: GunShots) -> None:
        """Writes other shots into some rows.

        Parameters:
            rows: Row numbers, one for each of the others.
            others: The shots that are written, with as many moments of the tank's pressure.
        """
        self.velocity_m_s[rows], self.exit_time_s[rows] = others.velocity_m_s, others.exit_time_s
        self.status[rows], self.tank_pressure_pa[rows] = others.status, others.tank_pressure_pa

    def words(self) -> list[str]:
        """Of each status."""
        return [Status(int(code)).words for code in self.status]


@dataclass(frozen=True, eq=False)
class Readings:
    """Moments (n, m) before the exit, s, at which the tank's pressure is asked for; negative: after
    it, through an outlet of this area of flow."""

    leads_s: Floats
    outlet_area_m2: float

    @property
    def before_s(self) -> Floats:
        return np.maximum(self.leads_s, 0.0)

    @property
    def has_later(self) -> bool:
        return bool(np.any(self.leads_s < 0))

    def take(self, rows: NDArray[np.intp]) -> Readings:
        """The moments of some of the shots.

        Parameters:
            rows: Their row numbers.
        """
        return replace(self, leads_s=self.leads_s[rows])

    def put_later(self, law_pa: Floats, at_exit: GasAtExit, exit_s: Floats) -> None:
        """Writes the law's pressures after the exit into those of all moments.

        Parameters:
            law_pa: Pressures at all moments (n, m), which are changed in place.
            at_exit: The gas of the n shots as the projectile leaves.
            exit_s: When the projectile leaves, (n,), from the opening of the valve on.
        """
        for column in np.flatnonzero((self.leads_s < 0).any(axis=0)):
            after_s = np.maximum(-self.leads_s[:, column], 0.0)
            pressures_pa = at_exit.tank_pa_after(after_s, exit_s, self.outlet_area_m2)
            law_pa[:, column] = np.where(after_s > 0, pressures_pa, law_pa[:, column])


def gun_velocity(
    bench: GunBench,
    tank_pressure_pa: ArrayLike,
    bullet_mass_kg: ArrayLike,
    effects: Sequence[GunEffect] = (),
    coarser: float = 1.0,
    *,
    travel_m: ArrayLike | None = None,
    valve_profiles: Sequence[ValveProfile | None] | None = None,
    before_exit_s: ArrayLike | None = None,
    outlet_area_m2: float | None = None,
) -> GunShots:
    """Shots broadcast to (n,): eq. 2.16, 2.18, and what effects do to it.

    In closed form without effects and where they only prepare the shot. The bench's efficiency
    still stands before the velocity: it is 1 where effects say where the losses are.

    Parameters:
        bench: The gun.
        tank_pressure_pa: Gauge pressure of the tank, a number or an array (n,).
        bullet_mass_kg: Mass of the bullet, a number or an array (n,).
        effects: Effects of the gun, each at most once, with parameters that are one number or (n,);
            none by default.
        coarser: A factor on the error that a step of the integration may make; 1 by default.
        travel_m: Way to the vent holes, one for all or (n,), where projectiles differ in it; by
            default None, that of the bench.
        valve_profiles: How the valve of `gun.valve_flow` is opened and closed, n of them, in place
            of that effect's opening time; None for a shot leaves that to the effect. Where the
            effects give no valve, a profile acts on one as wide as the bore that loses one dynamic
            head. By default None, no profile for any shot.
        before_exit_s: How long before the exit the pressure of the tank is asked for, (n, m);
            negative: after it. By default None, no pressures.
        outlet_area_m2: Area of flow of the barrel's vent holes and muzzle together (`emptying`),
            for moments after the exit; by default None, where there are none.

    Raises:
        ValueError: As `muzzle_velocity`, for an effect given twice, for parameters or profiles that
            are not one or n, for moments of another shape, and for moments after the exit without a
            positive outlet.
        TypeError: For another stage's effect.
    """
    shot = nominal_shot(bench, tank_pressure_pa, bullet_mass_kg)
    if travel_m is not None:
        shot = shot.but(travel_m=checked("travel_m", travel_m))
    acting = checked_effects(effects, GunEffect)
    for effect in acting:
        shot = effect.prepare(shot)
    if valve_profiles is not None:
        shot = _with_profiles(shot, valve_profiles)
    leads = (
        np.zeros((len(shot), 0))
        if before_exit_s is None
        else np.asarray(before_exit_s, dtype=np.float64)
    )
    if leads.ndim != 2 or len(leads) != len(shot):
        raise ValueError(
            f"before_exit_s has shape {leads.shape}: expected (n, m) for {len(shot)} shots"
        )
    if np.any(leads < 0) and not (outlet_area_m2 is not None and outlet_area_m2 > 0):
        raise ValueError(
            f"outlet_area_m2 = {outlet_area_m2!r}: expected a positive one "
            f"for moments after the exit"
        )
    return _fired(shot, acting, bench.efficiency, coarser, Readings(leads, outlet_area_m2 or 0.0))


def _with_profiles(shot: ShotInputs, profiles: Sequence[ValveProfile | None]) -> ShotInputs:
    if len(profiles) != len(shot):
        raise ValueError(
            f"{len(profiles)} valve profiles: expected one for each of {len(shot)} shots"
        )
    stated = np.array([profile is not None for profile in profiles], dtype=bool)
    bore_m2 = np.pi / 4 * shot.bore_diameter_m**2
    area = np.where(stated & np.isinf(shot.valve_area_m2), bore_m2, shot.valve_area_m2)
    return replace(shot, valve_area_m2=area, valve_profile=profile_table(profiles))


def _fired(
    shot: ShotInputs,
    effects: Sequence[GunEffect],
    efficiency: float,
    coarser: float,
    readings: Readings,
) -> GunShots:
    n = len(shot)
    moving = np.zeros(n, dtype=bool)
    for effect in effects:
        if effect.moves:
            moving |= ~effect.off(n)
    valve = np.isfinite(shot.valve_area_m2)
    shots = _unfired(n, Status.STOPPED, readings)
    simulators = (
        (~moving & ~valve, _closed),
        (moving & ~valve, _one_chamber),
        (valve, _two_chambers),
    )
    for mask, simulator in simulators:
        rows = np.flatnonzero(mask)
        if rows.size:
            acting = [
                effect.take(rows)
                for effect in effects
                if effect.has_hooks() and not effect.off(n)[rows].all()
            ]
            shots.put(rows, simulator(shot.take(rows), acting, coarser, readings.take(rows)))
    return replace(shots, velocity_m_s=efficiency * shots.velocity_m_s)


def _unfired(n: int, status: Status, readings: Readings) -> GunShots:
    pressures_pa = np.full(readings.leads_s.shape, np.nan)
    return GunShots(
        np.zeros(n), np.full(n, np.nan), np.full(n, status, dtype=np.int_), pressures_pa
    )


def _closed(shot: ShotInputs, _: Sequence[GunEffect], __: float, readings: Readings) -> GunShots:
    velocity = ideal_velocity_m_s(shot)
    exited = np.flatnonzero(velocity > 0)
    shots = _unfired(len(shot), Status.STOPPED, readings)
    shots.velocity_m_s[:] = velocity
    shots.status[:] = np.where(starting_force_n(shot) > 0, Status.STOPPED, Status.NOT_STARTED)
    shots.status[exited] = Status.LEFT
    if exited.size:
        leaving = shot.take(exited)
        shots.exit_time_s[exited] = travel_time_s(leaving)
        if readings.leads_s.size:
            leaving_readings = readings.take(exited)
            pressure = earlier_pressures_pa(leaving, leaving_readings.before_s)
            if leaving_readings.has_later:
                from .emptying import one_gas_at_exit

                growth = 1 + leaving.area_m2 * leaving.travel_m / leaving.volume_m3
                at_exit_pa = leaving.filled_pressure_pa * growth**-leaving.polytropic_index
                at_exit = one_gas_at_exit(leaving, at_exit_pa)
                leaving_readings.put_later(pressure, at_exit, shots.exit_time_s[exited])
            shots.tank_pressure_pa[exited] = pressure - leaving.opposing_pressure_pa[:, None]
    return shots


def _one_chamber(
    shot: ShotInputs, effects: Sequence[GunEffect], coarser: float, readings: Readings
) -> GunShots:
    from .chambers import Chamber

    # Without a valve the pressure only falls: a projectile that does not start now never does.
    shots = _unfired(len(shot), Status.NOT_STARTED, readings)
    rows = np.flatnonzero(starting_force_n(shot) > 0)
    if rows.size:
        chamber = Chamber(shot.take(rows), [effect.take(rows) for effect in effects], coarser)
        shots.put(rows, _shots_of_chamber(chamber, readings.take(rows)))
    return shots


def _two_chambers(
    shot: ShotInputs, effects: Sequence[GunEffect], coarser: float, readings: Readings
) -> GunShots:
    from .chambers import TwoChambers

    return _shots_of_chamber(TwoChambers(shot, effects, coarser), readings)


def _kept_back_pa(shot: ShotInputs, position_m: Floats, velocity_m_s: Floats) -> Floats:
    """By how much the tank's pressure is above that of all the gas, (n, m), where a valve's drop
    goes with the projectile's speed: the gas behind the valve stands lower by the drop, and the
    mass of all of it is kept."""
    air = ATMOSPHERE_PA / (GAS_CONSTANT * shot.temperature_k)
    drop_pa = (shot.valve_air_heads * air)[:, None] * velocity_m_s**2 / 2
    behind_m3 = shot.dead_volume_m3[:, None] + shot.area_m2[:, None] * position_m
    return np.asarray(drop_pa * behind_m3 / (shot.tank_volume_m3[:, None] + behind_m3))


def _shots_of_chamber(chamber: Chamber, readings: Readings) -> GunShots:
    ends, earlier = chamber.run(readings.before_s)
    velocity = np.where(ends.reached, ends.state[1], 0.0)
    status = np.where(
        ends.reached, Status.LEFT, np.where(ends.state[0] > 0, Status.STOPPED, Status.NOT_STARTED)
    )
    law_pa = earlier[..., 0] + _kept_back_pa(chamber.shot, earlier[..., 1], earlier[..., 2])
    if readings.has_later and (rows := np.flatnonzero(ends.reached)).size:
        from .emptying import chamber_at_exit

        later_pa = law_pa[rows]
        at_exit = chamber_at_exit(chamber.take(rows), ends.state[:, rows])
        readings.take(rows).put_later(later_pa, at_exit, ends.time[rows])
        law_pa[rows] = later_pa
    gauge = np.where(
        ends.reached[:, None], law_pa - chamber.shot.opposing_pressure_pa[:, None], np.nan
    )
    return GunShots(velocity, np.where(ends.reached, ends.time, np.nan), status, gauge)
