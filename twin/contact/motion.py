"""The motion of one contact without units: xi'' = -xi^1.5 (1 + a xi'), xi(0) = 0, xi'(0) = 1.

Every impact of Hertz (a = 0) and of Hunt and Crossley is this motion, with lengths in units of l = (m u^2 / k)^(2/5),
velocities in units of u and forces in units of m u^2 / l. It depends on one number, the damping a or the restitution
that it ends with; it is solved once for a list of them, and interpolated in between.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from ...array_types import Floats
from .damping import matched_damping
from .restitution.base import LEAST

# Denser where the curves bend: near the elastic impact, and at the steep begin of a pulse with much damping.
_RESTITUTIONS = np.exp(np.log(LEAST) * np.linspace(1.0, 0.0, 65) ** 2)
_PHASES = np.linspace(0.0, 1.0, 201) ** 2


@dataclass(frozen=True, eq=False)
class ContactMotion:
    """Motions of n contacts: times and greatest force (n,), and the force's course."""

    contact_time: Floats
    compression_time: Floats
    peak_force: Floats
    course: Floats  # n x 201: (force over peak)^(2/3) at `_PHASES`; smooth at both ends, as force is not

    def shape(self, phase: Floats) -> Floats:
        """Force over peak, n x p, at phases (p,)."""
        from scipy.interpolate import CubicSpline

        return np.asarray(np.maximum(CubicSpline(_PHASES, self.course, axis=1)(phase), 0.0) ** 1.5)


def motion(restitution: Floats) -> ContactMotion:
    """Motions that end with the restitutions (n,), all in [0.01, 1].

    Interpolated: times and peaks to 1e-7, forces to 2e-5 of the peak, from e = 0.014 downwards to 2e-4.
    """
    from scipy.interpolate import CubicSpline

    rows = CubicSpline(*_table())(np.log(restitution))
    contact_time, compression_time, peak_force = np.exp(rows[:, :3].T)
    return ContactMotion(contact_time, compression_time, peak_force, rows[:, 3:])


@cache
def _table() -> tuple[Floats, Floats]:
    """Logarithms of restitutions; for each, those of the times and of the peak, and the course."""
    solved = [solve(float(a)) for a in matched_damping(_RESTITUTIONS)]
    scales = np.log([[m.contact_time[0], m.compression_time[0], m.peak_force[0]] for m in solved])
    return np.log(_RESTITUTIONS), np.hstack([scales, [m.course[0] for m in solved]])


@dataclass(frozen=True)
class _Falls:
    """An instant at which a quantity falls through zero, as `solve_ivp` reads it."""

    quantity: Callable[[float, Floats], float]
    terminal: bool = False
    direction: float = -1.0

    def __call__(self, time: float, state: Floats) -> float:
        return self.quantity(time, state)


@cache
def solve(damping: float) -> ContactMotion:
    """One motion (n = 1) of a damping number, by a Runge-Kutta method of order 8, until the bodies part."""
    from scipy.integrate import solve_ivp

    def rate(_: float, state: Floats) -> list[float]:
        xi, velocity = state
        return [velocity, -xi * abs(xi) ** 0.5 * (1 + damping * velocity)]

    def force(state: Floats) -> Floats:
        return np.asarray(np.maximum(state[0], 0.0) ** 1.5 * (1 + damping * state[1]))

    def steepness(_: float, state: Floats) -> float:
        """Sign of the force's rate: 1.5 xi' (1 + a xi') + a xi xi''."""
        drag = 1 + damping * state[1]
        return float((1.5 * state[1] - damping * state[0] ** 2 * abs(state[0]) ** 0.5) * drag)

    events = (_Falls(lambda _, state: state[0], terminal=True), _Falls(lambda _, state: state[1]), _Falls(steepness))
    run = solve_ivp(rate, (0.0, np.inf), [0.0, 1.0], "DOP853", events=events, dense_output=True, rtol=1e-11, atol=1e-13)
    assert run.sol is not None and run.t_events is not None  # both asked for
    end, turn, summit = (float(times[0]) for times in run.t_events)
    peak = force(run.sol(summit))
    course = np.maximum(force(run.sol(_PHASES * end)) / peak, 0.0) ** (2 / 3)
    return ContactMotion(np.array([end]), np.array([turn]), np.array([peak]), course[None, :])
