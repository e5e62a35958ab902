"""The gun stage: tank pressures to muzzle velocities, nominal or with effects.

The gun in closed form: eq. 2.16 with any index, dead volume, pressure ahead and constant friction.

Work along the barrel, with V = V0 + Vd, P the law's pressure after filling, B the pressure ahead and F the friction:
W(x) = P V / (n - 1) [1 - (V / (V + A x))^(n - 1)] - (B A + F) x, and m v^2 / 2 = W(L).
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
from .shot import GunEffect, ShotInputs, nominal_shot, profile_table

if TYPE_CHECKING:
    from .chambers import Chamber


# A Gauss rule over s in x = L s^2, in which speed begins linearly.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(48)
_PHASES, _WEIGHTS = (_NODES + 1) / 2, _WEIGHTS / 2


def net_work_j(shot: ShotInputs, position_m: Floats) -> Floats:
    """W at positions (..., n)."""
    from scipy.special import exprel

    growth = np.log1p(shot.area_m2 * position_m / shot.volume_m3)
    # exprel keeps the digits for large tanks, and is the isothermal law at an index of one.
    work = shot.filled_pressure_pa * shot.volume_m3 * growth * exprel((1 - shot.polytropic_index) * growth)
    return np.asarray(work - (shot.opposing_pressure_pa * shot.area_m2 + shot.friction_n) * position_m)


def starting_force_n(shot: ShotInputs) -> Floats:
    """On the projectile at rest, (n,)."""
    return np.asarray((shot.filled_pressure_pa - shot.opposing_pressure_pa) * shot.area_m2 - shot.friction_n)


def ideal_velocity_m_s(shot: ShotInputs) -> Floats:
    """At the vent holes, (n,), without the efficiency; 0 for a shot that does not get there."""
    return np.asarray(np.sqrt(np.maximum(2 * net_work_j(shot, shot.travel_m) / shot.bullet_mass_kg, 0.0)))


def travel_time_s(shot: ShotInputs) -> Floats:
    """Until the vent holes, (n,), for shots that get there: the integral of dx / v."""
    phases = _PHASES[:, None]
    energy = net_work_j(shot, shot.travel_m * phases**2)
    speed = np.sqrt(2 * energy / shot.bullet_mass_kg)
    return np.asarray(_WEIGHTS @ (2 * shot.travel_m * phases / speed))


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
    """n shots: velocity at the vent holes (0 for one that does not get there), when (NaN), and `Status` of each."""

    velocity_m_s: Floats
    exit_time_s: Floats
    status: NDArray[np.int_]

    @property
    def left(self) -> NDArray[np.bool_]:
        return np.asarray(self.status == Status.LEFT)

    def put(self, rows: NDArray[np.intp], others: GunShots) -> None:
        """Writes others into some rows."""
        self.velocity_m_s[rows], self.exit_time_s[rows] = others.velocity_m_s, others.exit_time_s
        self.status[rows] = others.status

    def words(self) -> list[str]:
        """Of each status."""
        return [Status(int(code)).words for code in self.status]


def gun_velocity(
    bench: GunBench,
    tank_pressure_pa: ArrayLike,
    bullet_mass_kg: ArrayLike,
    effects: Sequence[GunEffect] = (),
    coarser: float = 1.0,
    *,
    travel_m: ArrayLike | None = None,
    valve_profiles: Sequence[ValveProfile | None] | None = None,
) -> GunShots:
    """Shots with gauge pressures (Pa) and masses (kg), broadcast to (n,): eq. 2.16, 2.18, and what effects do to it.

    `travel_m`, one for all or (n,), takes the place of the bench's where projectiles differ in it. The bench's
    efficiency still stands before the velocity: it is 1 where effects say where the losses are. In
    closed form without effects and where they only prepare the shot. `coarser`: a factor on the error that a step of
    the integration may make. `valve_profiles`, n of them, say how the valve of `gun.valve_flow` is opened and closed,
    in place of that effect's opening time; None for a shot leaves that to the effect. Where the effects give no valve,
    a profile acts on one as wide as the bore that loses one dynamic head. Raises `ValueError` as `muzzle_velocity`
    does, for an effect given twice and for parameters or profiles that are not one or n; `TypeError` for another
    stage's effect.
    """
    shot = nominal_shot(bench, tank_pressure_pa, bullet_mass_kg)
    if travel_m is not None:
        shot = shot.but(travel_m=checked("travel_m", travel_m))
    acting = checked_effects(effects, GunEffect)
    for effect in acting:
        shot = effect.prepare(shot)
    if valve_profiles is not None:
        shot = _with_profiles(shot, valve_profiles)
    return _fired(shot, acting, bench.efficiency, coarser)


def _with_profiles(shot: ShotInputs, profiles: Sequence[ValveProfile | None]) -> ShotInputs:
    if len(profiles) != len(shot):
        raise ValueError(f"{len(profiles)} valve profiles: expected one for each of {len(shot)} shots")
    stated = np.array([profile is not None for profile in profiles], dtype=bool)
    bore_m2 = np.pi / 4 * shot.bore_diameter_m**2
    area = np.where(stated & np.isinf(shot.valve_area_m2), bore_m2, shot.valve_area_m2)
    return replace(shot, valve_area_m2=area, valve_profile=profile_table(profiles))


def _fired(shot: ShotInputs, effects: Sequence[GunEffect], efficiency: float, coarser: float) -> GunShots:
    n = len(shot)
    moving = np.zeros(n, dtype=bool)
    for effect in effects:
        if effect.moves:
            moving |= ~effect.off(n)
    valve = np.isfinite(shot.valve_area_m2)
    shots = GunShots(np.zeros(n), np.full(n, np.nan), np.full(n, Status.STOPPED, dtype=np.int_))
    simulators = ((~moving & ~valve, _closed), (moving & ~valve, _one_chamber), (valve, _two_chambers))
    for mask, simulator in simulators:
        rows = np.flatnonzero(mask)
        if rows.size:
            acting = [effect.take(rows) for effect in effects if effect.has_hooks() and not effect.off(n)[rows].all()]
            shots.put(rows, simulator(shot.take(rows), acting, coarser))
    return replace(shots, velocity_m_s=efficiency * shots.velocity_m_s)


def _closed(shot: ShotInputs, _: Sequence[GunEffect], __: float) -> GunShots:
    velocity = ideal_velocity_m_s(shot)
    exited = velocity > 0
    time = np.full(len(shot), np.nan)
    time[exited] = travel_time_s(shot.take(np.flatnonzero(exited)))
    status = np.where(exited, Status.LEFT, np.where(starting_force_n(shot) > 0, Status.STOPPED, Status.NOT_STARTED))
    return GunShots(velocity, time, status)


def _one_chamber(shot: ShotInputs, effects: Sequence[GunEffect], coarser: float) -> GunShots:
    from .chambers import Chamber

    # Without a valve the pressure only falls: a projectile that does not start now never does.
    n = len(shot)
    shots = GunShots(np.zeros(n), np.full(n, np.nan), np.full(n, Status.NOT_STARTED, dtype=np.int_))
    rows = np.flatnonzero(starting_force_n(shot) > 0)
    if rows.size:
        shots.put(rows, _shots_of_chamber(Chamber(shot.take(rows), [effect.take(rows) for effect in effects], coarser)))
    return shots


def _two_chambers(shot: ShotInputs, effects: Sequence[GunEffect], coarser: float) -> GunShots:
    from .chambers import TwoChambers

    return _shots_of_chamber(TwoChambers(shot, effects, coarser))


def _shots_of_chamber(chamber: Chamber) -> GunShots:
    ends = chamber.run()
    velocity = np.where(ends.reached, ends.state[1], 0.0)
    status = np.where(ends.reached, Status.LEFT, np.where(ends.state[0] > 0, Status.STOPPED, Status.NOT_STARTED))
    return GunShots(velocity, np.where(ends.reached, ends.time, np.nan), status)
