"""One shot of the virtual gun.

Position over time between the points of a shot: cubics that have its positions and velocities
(Hermite).

What the gun's two sensors have before them during a recording: the tank's pressure and the laser's
distance.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..effects import Effects
from .build import GunBuild, GunSetting, Projectile, setting_of
from .gas import GAMMA, ValveWay
from .integrate import integrate
from .motion import ENERGY_OUT, HEAT_IN, MASS_OUT, RESISTED, V, X, volumes


def position_at(
    time_s: Floats, position_m: Floats, velocity_m_s: Floats, moment_s: Floats
) -> Floats:
    """Position (m) at moments `(k,)`; before the first point and after the last it stays where it
    is.

    Parameters:
        time_s: Times of the points, rising, of shape `(n,)`.
        position_m: Positions at the points, of shape `(n,)`.
        velocity_m_s: Velocities at the points, of shape `(n,)`.
        moment_s: The moments, of shape `(k,)`.
    """
    k, step, share = _step_of_moment(time_s, moment_s)
    return _position_on_step(position_m, velocity_m_s, k, step, share)


def _position_on_step(
    position_m: Floats, velocity_m_s: Floats, k: NDArray[np.intp], step_s: Floats, share: Floats
) -> Floats:
    rest = 1 - share
    ends = (
        rest**2 * (1 + 2 * share) * position_m[k] + share**2 * (3 - 2 * share) * position_m[k + 1]
    )
    return np.asarray(
        ends + share * rest * step_s * (rest * velocity_m_s[k] - share * velocity_m_s[k + 1])
    )


def velocity_at(
    time_s: Floats, position_m: Floats, velocity_m_s: Floats, moment_s: Floats
) -> Floats:
    """The slope (m/s) of `position_at` at moments `(k,)`.

    Parameters:
        time_s: Times of the points, rising, of shape `(n,)`.
        position_m: Positions at the points, of shape `(n,)`.
        velocity_m_s: Velocities at the points, of shape `(n,)`.
        moment_s: The moments, of shape `(k,)`.
    """
    k, step, share = _step_of_moment(time_s, moment_s)
    rest = 1 - share
    chord = 6 * share * rest * (position_m[k + 1] - position_m[k]) / step
    return np.asarray(
        chord
        + rest * (1 - 3 * share) * velocity_m_s[k]
        + share * (3 * share - 2) * velocity_m_s[k + 1]
    )


def _step_of_moment(time_s: Floats, moment_s: Floats) -> tuple[NDArray[np.intp], Floats, Floats]:
    """The step in which each moment lies, its length, and the share of it that has gone."""
    moment = np.clip(moment_s, time_s[0], time_s[-1])
    k = np.clip(np.searchsorted(time_s, moment, side="right") - 1, 0, time_s.size - 2)
    step = time_s[k + 1] - time_s[k]
    return k, step, (moment - time_s[k]) / step


def crossings(time_s: Floats, position_m: Floats, velocity_m_s: Floats, level_m: float) -> Floats:
    """Moments `(k,)` in s at which the way passes a level, in order, by bisection within the steps
    that straddle it.

    Parameters:
        time_s: Times of the points, rising, of shape `(n,)`.
        position_m: Positions at the points, of shape `(n,)`.
        velocity_m_s: Velocities at the points, of shape `(n,)`.
        level_m: The position that is passed, either way.
    """
    side = np.sign(position_m - level_m)
    k = np.flatnonzero(side[:-1] * side[1:] < 0)
    low, high, start = time_s[k].copy(), time_s[k + 1].copy(), side[k]
    step = time_s[k + 1] - time_s[k]
    for _ in range(50):
        middle = (low + high) / 2
        share = (middle - time_s[k]) / step
        position = _position_on_step(position_m, velocity_m_s, k, step, share)
        on_start_side = np.sign(position - level_m) == start
        low, high = np.where(on_start_side, middle, low), np.where(on_start_side, high, middle)
    return np.sort(np.append(high, time_s[side == 0]))


@dataclass(frozen=True)
class Ledger:
    """The books of a shot (n,): what the chambers hold, and what has left them since the start."""

    gas_mass_kg: Floats
    gas_energy_j: Floats
    mass_out_kg: Floats
    energy_out_j: Floats
    heat_in_j: Floats
    resisted_j: Floats


@dataclass(frozen=True)
class ShotTruth:
    """Arrays are (n,) over `time_s`, which increases from 0, the moment at which the valve begins
    to turn.

    Pressures are gauge against the surroundings. A projectile that does not reach the vents has
    muzzle velocity 0 and exit time NaN; one that does not reach the plate has impact velocity 0 and
    impact time NaN.
    """

    time_s: Floats
    tank_pressure_pa: Floats
    breech_pressure_pa: Floats
    ahead_pressure_pa: Floats
    position_m: Floats  # of the projectile's tail, from where it starts
    velocity_m_s: Floats
    muzzle_velocity_m_s: float  # when the tail reaches the vents (thesis, section 2.3)
    exit_time_s: float
    impact_velocity_m_s: float  # when the nose first meets the plate
    impact_time_s: float
    laser_blocked: tuple[
        tuple[float, float], ...
    ]  # (start_s, stop_s) of each whole passage, there and back
    laser_position_m: float
    ledger: Ledger
    port_opens_s: float = 0.0  # the ball turns before its port opens; infinite where it never does


def fire(
    gun: GunBuild,
    effects: Effects,
    tank_pressure_pa: float,
    projectile: Projectile,
    rng: np.random.Generator,
    *,
    until_s: float = 1.2,
    restitution: float = 0.35,
    tightness: float = 1.0,
    valve_way: ValveWay | None = None,
) -> ShotTruth:
    """A shot, followed from the valve's first turn on.

    Open chambers with balances of mass and energy (perfect gas), flow by ISO 6358 (valve) and the
    isentropic nozzle (clearance, vents, muzzle), friction with a Stribeck hump.

    Parameters:
        gun: The gun as it is built.
        effects: Which effects act, and how strongly; `build.setting_of` says what each strength
            means.
        tank_pressure_pa: The gauge pressure of the tank before the shot, 0 or more.
        projectile: What is shot.
        rng: Generator of random numbers, for the scatter of this shot.
        until_s: How long the shot is followed; 1.2 s by default.
        restitution: The plate's coefficient of restitution, from 0 to below 1; 0.35 by default.
        tightness: A factor on the integrator's tolerances; 1 by default.
        valve_way: What the controller lets the valve do; by default it opens within the gun's own
            time and stays open.

    Raises:
        ValueError: For a pressure that is negative or not finite, a time that is not positive, a
            restitution out of its range, and what the barrel cannot shoot.
        RuntimeError: Where LSODA gives up.
    """
    _check(tank_pressure_pa, until_s, restitution)
    setting = setting_of(gun, effects, float(tank_pressure_pa), projectile, rng, valve_way)
    time, state, strike = integrate(setting, until_s, restitution, tightness)
    tank, breech, ahead = _gauge_pressures(setting, state)
    projectile_motion = time, state[:, X], state[:, V]
    exits = crossings(*projectile_motion, gun.vent_position_m)
    return ShotTruth(
        time_s=time,
        tank_pressure_pa=tank,
        breech_pressure_pa=breech,
        ahead_pressure_pa=ahead,
        position_m=state[:, X],
        velocity_m_s=state[:, V],
        muzzle_velocity_m_s=float(velocity_at(*projectile_motion, exits[:1])[0])
        if exits.size
        else 0.0,
        exit_time_s=float(exits[0]) if exits.size else math.nan,
        impact_velocity_m_s=strike.velocity_m_s if strike else 0.0,
        impact_time_s=strike.time_s if strike else math.nan,
        laser_blocked=_passages(projectile_motion, gun.laser_position_m, projectile.length_m),
        laser_position_m=gun.laser_position_m,
        ledger=_ledger(state),
        port_opens_s=setting.valve_way.port_opens_s,
    )


def _check(tank_pressure_pa: float, until_s: float, restitution: float) -> None:
    if not (math.isfinite(tank_pressure_pa) and tank_pressure_pa >= 0):
        raise ValueError(f"tank_pressure_pa = {tank_pressure_pa!r}: expected 0 or more, gauge")
    if not (math.isfinite(until_s) and until_s > 0):
        raise ValueError(f"until_s = {until_s!r}: expected a positive time")
    if not 0 <= restitution < 1:
        raise ValueError(f"restitution = {restitution!r}: expected 0 or more and less than 1")


def _gauge_pressures(setting: GunSetting, state: Floats) -> tuple[Floats, Floats, Floats]:
    tank, breech, ahead = volumes(setting, state[:, X])
    energy = (GAMMA - 1) * state[:, 1:6:2].T
    if setting.merged:
        first = second = (energy[0] + energy[1]) / (tank + breech)
    else:
        first, second = energy[0] / tank, energy[1] / breech
    ambient = setting.ambient.pressure
    return first - ambient, second - ambient, energy[2] / ahead - ambient


def _passages(
    motion: tuple[Floats, Floats, Floats], laser: float, length: float
) -> tuple[tuple[float, float], ...]:
    """From one end of the projectile in the beam to the other, whichever way it moves."""
    edges = np.sort(np.concatenate([crossings(*motion, laser - length), crossings(*motion, laser)]))
    middles = position_at(*motion, (edges[:-1] + edges[1:]) / 2)
    inside = (laser - length < middles) & (middles < laser)
    return tuple(
        (a, b) for (a, b), within in zip(pairwise(edges.tolist()), inside, strict=True) if within
    )


def _ledger(state: Floats) -> Ledger:
    return Ledger(
        gas_mass_kg=state[:, 0:6:2].sum(axis=1),
        gas_energy_j=state[:, 1:6:2].sum(axis=1),
        mass_out_kg=state[:, MASS_OUT],
        energy_out_j=state[:, ENERGY_OUT],
        heat_in_j=state[:, HEAT_IN],
        resisted_j=state[:, RESISTED],
    )


#: From the sensor's face to the barrel's far wall: it measures 80 to 180 mm.
LASER_REST_M = 0.130
#: Width of the beam (four standard deviations): it dims the edges of a passage.
BEAM_WIDTH_M = 0.6e-3
#: Standard deviations of the beam beyond which its tail is less than a number of 64 bits resolves.
_BEAM_REACH = 9.0
#: The recorder triggers when this share of the pressure is gone.
TRIGGER_SHARE = 0.05
#: Less than this is no drop: an empty tank does not trigger on rounding errors.
SMALLEST_DROP_PA = 1.0


@dataclass(frozen=True)
class Trigger:
    """A recording begins `pre_trigger_s` before the tank has lost `share` of its pressure.

    With a `share` of None nothing triggers: the recording is begun by hand, `pre_trigger_s` before
    the valve's first turn or earlier. Raises `ValueError` for a share outside of 0 to 1 and for a
    time that is negative.
    """

    share: float | None = TRIGGER_SHARE
    pre_trigger_s: float = 0.3

    def __post_init__(self) -> None:
        if self.share is not None and not 0 < self.share < 1:
            raise ValueError(f"trigger: share = {self.share!r}; expected above 0 and below 1")
        if not 0 <= self.pre_trigger_s < math.inf:
            raise ValueError(f"trigger: pre_trigger_s = {self.pre_trigger_s!r}; expected 0 or more")

    def begin_s(self, truth: ShotTruth) -> float:
        """When the recording begins, in s from the valve's first turn.

        Parameters:
            truth: The shot that is recorded.

        Raises:
            ValueError: As `trigger_time_s` raises it.
        """
        moment = 0.0 if self.share is None else trigger_time_s(truth, self.share)
        return moment - self.pre_trigger_s


def shot_signals(
    truth: ShotTruth,
    projectile: Projectile,
    sampling_rate_hz: float,
    duration_s: float,
    trigger: Trigger,
    *,
    trigger_offset_s: float = 0.0,
) -> dict[str, Floats]:
    """What the gun's two sensors have before them during a recording.

    The distance falls by the bullet's diameter while the beam is blocked, going and coming back;
    before the shot all is at rest.

    Parameters:
        truth: The shot that is recorded.
        projectile: What was shot.
        sampling_rate_hz: The rate of the grid.
        duration_s: The length of the recording.
        trigger: When the recording begins.
        trigger_offset_s: By how much later the recording begins (jitter); 0 by default.

    Returns:
        `tank_pressure` (Pa gauge, at the transducer, before its calibration) and `laser` (m,
        distance) on a uniform grid `(n,)`, n = duration times rate.

    Raises:
        ValueError: For a record that the shot was not followed for, for times or rates that are not
            positive, and as `trigger_time_s` raises it.
    """
    for name, value in (("sampling_rate_hz", sampling_rate_hz), ("duration_s", duration_s)):
        if not (np.isfinite(value) and value > 0):
            raise ValueError(f"{name} = {value!r}: expected a positive number")
    if not trigger.pre_trigger_s < duration_s:
        raise ValueError(
            f"pre_trigger_s = {trigger.pre_trigger_s!r}: expected less than {duration_s} s"
        )
    begin = trigger.begin_s(truth) + trigger_offset_s
    moment = begin + np.arange(round(duration_s * sampling_rate_hz)) / sampling_rate_hz
    if moment[-1] > truth.time_s[-1]:
        raise ValueError(
            f"the recording ends {moment[-1]:.4g} s after the valve's first turn, and the shot was "
            f"followed for {truth.time_s[-1]:.4g} s: fire it with a larger until_s"
        )
    blocked = _blocked_share(truth, projectile, moment)
    return {
        "tank_pressure": np.interp(moment, truth.time_s, truth.tank_pressure_pa),
        "laser": LASER_REST_M - projectile.diameter_m * blocked,
    }


def trigger_time_s(truth: ShotTruth, share: float = TRIGGER_SHARE) -> float:
    """When the tank has lost a share of its pressure, in s from the valve's first turn.

    Parameters:
        truth: The shot that is recorded.
        share: The share of the gauge pressure before the shot, from 0 to 1; 0.05 by default. Less
            than 1 Pa is no loss.

    Raises:
        ValueError: Where the tank never loses it.
    """
    level = truth.tank_pressure_pa[0] - max(share * truth.tank_pressure_pa[0], SMALLEST_DROP_PA)
    below = np.flatnonzero(truth.tank_pressure_pa < level)
    if not below.size:
        raise ValueError(f"no trigger: the tank's pressure never falls below {level:.4g} Pa")
    k = slice(below[0] - 1, below[0] + 1)
    return float(np.interp(-level, -truth.tank_pressure_pa[k], truth.time_s[k]))


def _blocked_share(truth: ShotTruth, projectile: Projectile, moment: Floats) -> Floats:
    """Share of the beam (n,) between the projectile's ends; the beam is Gaussian across."""
    from scipy.special import ndtr

    width = BEAM_WIDTH_M / 4
    blocked = np.zeros(moment.size)
    for stretch in _near_beam(truth, projectile, moment):
        position = position_at(truth.time_s, truth.position_m, truth.velocity_m_s, moment[stretch])
        past = (position - truth.laser_position_m) / width
        blocked[stretch] = ndtr(past + projectile.length_m / width) - ndtr(past)
    return blocked


def _near_beam(truth: ShotTruth, projectile: Projectile, moment: Floats) -> Iterator[slice]:
    """Stretches of the moments in which the projectile is in the beam or near it; elsewhere it
    blocks less than a number of 64 bits resolves.

    Between two points of a shot the position lies between the least and the largest of the four
    control points of its cubic (Bézier).
    """
    step = np.diff(truth.time_s)
    ends, slopes = truth.position_m, truth.velocity_m_s / 3
    control = np.stack(
        [ends[:-1], ends[:-1] + step * slopes[:-1], ends[1:] - step * slopes[1:], ends[1:]]
    )
    reach = _BEAM_REACH * BEAM_WIDTH_M / 4
    near = (control.min(axis=0) < truth.laser_position_m + reach) & (
        control.max(axis=0) > truth.laser_position_m - projectile.length_m - reach
    )
    turns = np.flatnonzero(np.diff(near, prepend=False, append=False))
    for first, stop in turns.reshape(-1, 2):
        begin = np.searchsorted(moment, truth.time_s[first]) if first else 0
        yield slice(int(begin), int(np.searchsorted(moment, truth.time_s[stop], side="right")))
