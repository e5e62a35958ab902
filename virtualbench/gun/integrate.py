"""The shot over time: LSODA between strikes on the plate, and a rebound at each.

The muzzle velocity of a shot alone: the same integration as `fire`, which ends when the tail
reaches the vents.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..effects import Effects
from .build import GunBuild, GunSetting, Projectile, setting_of
from .compiled_balances import figures_of, rates
from .motion import CREEP_M_S, TOLERANCES, Phase, V, X, initial_state

#: Output step, and how much is integrated at once between looks at the plate.
STEP_S, CHUNK_S = 2e-4, 0.1
RELATIVE_TOLERANCE = 1e-6
#: After the first strike only rebounds and the emptying of the tank are left: tolerances grow by
#: this.
LOOSER_AFTER = 30.0
#: The plate returns the projectile after this time, at rest on the scale of the barrel.
CONTACT_S = 1e-6
#: A projectile that comes back slower than this stays on the plate; a longer stay at the valve is
#: never modelled.
SLOWEST_M_S = 0.5


@dataclass(frozen=True)
class Strike:
    """The first meeting of nose and plate."""

    time_s: float
    velocity_m_s: float


def integrate(
    setting: GunSetting, until_s: float, restitution: float, tightness: float
) -> tuple[Floats, Floats, Strike | None]:
    """Times `(n,)` in s, states `(n, 12)` and the first strike of a shot.

    Parameters:
        setting: The figures of this shot.
        until_s: How long the shot is followed, from the valve's first turn.
        restitution: The plate's coefficient of restitution.
        tightness: A factor on every tolerance.

    Raises:
        RuntimeError: Where LSODA gives up.
    """
    times, states = [np.zeros(1)], [initial_state(setting)[None]]
    first, phase = None, Phase(held=False, sealed=True)
    stops = [*setting.valve_way.kinks_s, until_s]
    while (start := float(times[-1][-1])) < until_s - CONTACT_S:
        stop = min(
            moment for moment in stops if moment > start + CONTACT_S
        )  # the flow has a kink at each
        stop = stop if phase.held else min(stop, start + CHUNK_S)
        time, state = advance(setting, states[-1][-1], start, stop, phase, tightness)
        if phase.sealed and (past := _first(state[:, X] >= setting.vent_position_m)):
            time, state = up_to(setting, time, state, past, setting.vent_position_m, phase)
            phase = Phase(held=False, sealed=False)
        elif not phase.held and (past := _first(_outside(setting, state))):
            time, state = up_to(
                setting, time, state, past, setting.travel_m if state[past, V] > 0 else 0.0, phase
            )
            speed = float(state[-1, V])
            if first is None and speed > 0:
                first, tightness = Strike(float(time[-1]), speed), LOOSER_AFTER * tightness
            phase = Phase(held=speed > 0 and restitution * speed < SLOWEST_M_S, sealed=phase.sealed)
            time, state = _thrown_back(time, state, 0.0 if phase.held else -restitution * speed)
        times.append(time[1:])
        states.append(state[1:])
    return np.concatenate(times), np.concatenate(states), first


def derivative(time: float, state: Floats, figures: Floats, phase: Phase) -> Floats:
    """Rates `(12,)` of the state; `motion.derivative` says of what.

    Parameters:
        time: The time in s from the valve's first turn.
        state: The state in SI, of shape `(12,)`, in the order of `motion.initial_state`.
        figures: The figures of this shot, of shape `(29 + 2 k,)`, as `figures_of` gives them.
        phase: Whether the projectile rests against the plate, and whether its tail is before the
            vents.
    """
    return rates(time, state, figures, phase.held, phase.sealed)


def advance(
    setting: GunSetting, state: Floats, start: float, stop: float, phase: Phase, tightness: float
) -> tuple[Floats, Floats]:
    """Times `(k,)` from start to stop, both included, and states `(k, 12)`.

    Parameters:
        setting: The figures of this shot.
        state: The state at the start in SI, of shape `(12,)`, in the order of
            `motion.initial_state`.
        start: The first time in s, from the valve's first turn.
        stop: The last time in s.
        phase: Whether the projectile rests against the plate, and whether its tail is before the
            vents.
        tightness: A factor on every tolerance.

    Raises:
        RuntimeError: Where LSODA gives up.
    """
    from scipy.integrate import odeint

    steps, figures = max(1, round((stop - start) / STEP_S)), figures_of(setting)
    time = np.linspace(start, stop, steps + 1)
    run, solver_report = odeint(  # type: ignore[call-overload]
        rates,
        state,
        time,
        args=(figures, phase.held, phase.sealed),
        tfirst=True,
        full_output=True,
        rtol=tightness * RELATIVE_TOLERANCE,
        atol=tightness * TOLERANCES,
        mxstep=20_000,
    )
    if solver_report["message"] != "Integration successful.":
        raise RuntimeError(
            f"the shot could not be integrated past {start:.4g} s: {solver_report['message']}"
        )
    return time, np.asarray(run)


def _outside(setting: GunSetting, state: Floats) -> NDArray[np.bool_]:
    """Where the projectile is past either end of its way, and moves on."""
    at_plate = (state[:, X] >= setting.travel_m) & (state[:, V] > 0)
    return at_plate | ((state[:, X] <= 0) & (state[:, V] < -CREEP_M_S))


def _first(there: NDArray[np.bool_]) -> int:
    """The first point after the start that is there; 0 for none."""
    indices = np.flatnonzero(there[1:])
    return int(indices[0]) + 1 if indices.size else 0


def up_to(
    setting: GunSetting, time: Floats, state: Floats, past: int, end: float, phase: Phase
) -> tuple[Floats, Floats]:
    """The same times and states up to the moment at which the position is `end`.

    Parameters:
        setting: The figures of this shot.
        time: Times in s, of shape `(k,)`, as `advance` gives them.
        state: States in SI, of shape `(k, 12)`, in the order of `motion.initial_state`.
        past: Index of the first point past the end: the moment lies between `past - 1` and `past`.
        end: The position in m of the projectile's tail, from where it starts.
        phase: Whether the projectile rests against the plate, and whether its tail is before the
            vents.
    """
    ends = state[past - 1], state[past]
    figures = figures_of(setting)
    slopes = tuple(derivative(time[k], state[k], figures, phase) for k in (past - 1, past))
    step = float(time[past] - time[past - 1])
    onwards = 1 if ends[1][V] > 0 else -1
    low, high = 0.0, 1.0
    for _ in range(
        40
    ):  # bisection: the way is monotonous within a step, but may begin with contact
        middle = (low + high) / 2
        beyond = (_between(ends, slopes, step, middle)[X] - end) * onwards >= 0
        low, high = (low, middle) if beyond else (middle, high)
    last = _between(ends, slopes, step, high)
    last[X] = end
    moment = max(time[past - 1] + high * step, np.nextafter(time[past - 1], np.inf))
    return np.append(time[:past], moment), np.vstack([state[:past], last])


def _between(
    ends: tuple[Floats, ...], slopes: tuple[Floats, ...], step: float, share: float
) -> Floats:
    """Hermite's cubic at a share of a step: it keeps what the balances keep."""
    rest = 1 - share
    value = rest**2 * (1 + 2 * share) * ends[0] + share**2 * (3 - 2 * share) * ends[1]
    return np.asarray(value + share * rest * step * (rest * slopes[0] - share * slopes[1]))


def _thrown_back(time: Floats, state: Floats, velocity: float) -> tuple[Floats, Floats]:
    """With one more point, a contact later."""
    after = state[-1].copy()
    after[V] = velocity
    return np.append(time, time[-1] + CONTACT_S), np.vstack([state, after])


def muzzle_velocity(
    gun: GunBuild,
    effects: Effects,
    tank_pressure_pa: float,
    projectile: Projectile,
    rng: np.random.Generator,
    *,
    until_s: float = 1.2,
) -> float:
    """`fire(...).muzzle_velocity_m_s` (m/s); 0 for a projectile that does not reach the vents until
    `until_s`.

    Parameters:
        gun: The gun as it is built.
        effects: Which effects act, and how strongly.
        tank_pressure_pa: The gauge pressure of the tank before the shot.
        projectile: What is shot.
        rng: Generator of random numbers, for the scatter of this shot.
        until_s: How long the shot is followed at most, from the valve's first turn; 1.2 s by
            default.

    Raises:
        ValueError: For a projectile that the barrel cannot shoot.
        RuntimeError: Where LSODA gives up.
    """
    setting = setting_of(gun, effects, tank_pressure_pa, projectile, rng)
    stops = [*setting.valve_way.kinks_s, until_s]
    start, state, phase = 0.0, initial_state(setting), Phase(held=False, sealed=True)
    while start < until_s - 1e-9:
        stop = min(start + CHUNK_S, *(moment for moment in stops if moment > start + 1e-6))
        time, states = advance(setting, state, start, stop, phase, 1.0)
        if np.any(states[:, X] >= gun.vent_position_m):
            past = int(np.argmax(states[:, X] >= gun.vent_position_m))
            return float(up_to(setting, time, states, past, gun.vent_position_m, phase)[1][-1, V])
        if states[-1, X] < -1e-3:
            return 0.0
        start, state = stop, states[-1]
    return 0.0
