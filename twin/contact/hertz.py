"""Hertz' impact: the impactor on a spring that hardens with the contact's area, and nothing is
lost.

Glossary: m impactor's mass, u impact velocity, k stiffness of F = k delta^1.5 (eq. 1.16), l = (m
u^2 / k)^(2/5).

How much damping a restitution takes in Hunt and Crossley's law, and the other way round.

Glossary: a damping number of F = k delta^1.5 (1 + a delta' / u), e restitution that the motion ends
with. The motion has the integral a (1 + e) = ln((1 + a) / (1 - e a)); with q = -ln(1 - e a) it
reads a - ln(1 + a) = q + exp(-q) - 1, which keeps its digits where e a comes close to one.

The motion of one contact without units: xi'' = -xi^1.5 (1 + a xi'), xi(0) = 0, xi'(0) = 1.

Every impact of Hertz (a = 0) and of Hunt and Crossley is this motion, with lengths in units of l =
(m u^2 / k)^(2/5), velocities in units of u and forces in units of m u^2 / l. It depends on one
number, the damping a or the restitution that it ends with; it is solved once for a list of them,
and interpolated in between.

Where a ball begins to yield.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from ...array_types import Floats
from .bodies import Bodies
from .pulse import ContactPulse
from .restitution_laws import LEAST, elastic

#: Restitutions (n,) in (0, 1] to damping numbers (n,).
DampingLaw = Callable[[Floats], Floats]

_NEARLY_ELASTIC = 1e-4  # below this loss the first terms of the series are exact to 1e-8


def low_loss_damping(restitution: Floats) -> Floats:
    """a = (3/2) (1 - e), for small losses.

    The motion ends with more than the e asked for: 0.748 for 2/3, 0.516 for 0.1.

    Parameters:
        restitution: e (n,), in (0, 1].

    Returns:
        Damping numbers a (n,).

    Source:
        Eq. 1.20: Hunt and Crossley, J. Appl. Mech. 42 (1975) 440.
    """
    return np.asarray(1.5 * (1 - restitution))


def matched_damping(restitution: Floats) -> Floats:
    """The a (n,) whose motion ends with e exactly.

    Parameters:
        restitution: e (n,), in (0, 1].

    Source:
        Gonthier, McPhee, Lange and Piedboeuf, Multibody System Dynamics 11 (2004) 209; Zhang and
        Sharf, J. Appl. Mech. 76 (2009).
    """
    from scipy.optimize.elementwise import find_root

    def excess(q: Floats, e: Floats) -> Floats:
        a = -np.expm1(-q) / e
        return np.asarray(a - np.log1p(a) - q - np.expm1(-q))

    lossy = np.minimum(restitution, 1 - _NEARLY_ELASTIC)
    q = find_root(excess, (1 - lossy, 1 / lossy + 1), args=(lossy,)).x
    nearly = 1.5 * (1 - restitution) / restitution
    return np.where(restitution > 1 - _NEARLY_ELASTIC, nearly, -np.expm1(-q) / lossy)


def restitution_of(damping: Floats) -> Floats:
    """The e (n,) with which motions end.

    Parameters:
        damping: Damping numbers a (n,), not negative.
    """
    from scipy.optimize.elementwise import find_root

    def excess(q: Floats, a: Floats) -> Floats:
        return np.asarray(q + np.expm1(-q) - (a - np.log1p(a)))

    damped = np.maximum(damping, _NEARLY_ELASTIC)
    q = find_root(excess, (np.zeros_like(damped), damped + 1), args=(damped,)).x
    return np.where(damping < _NEARLY_ELASTIC, 1 / (1 + damping / 1.5), -np.expm1(-q) / damped)


# Denser where the curves bend: near the elastic impact, and at the steep begin of a pulse with much
# damping.
_RESTITUTIONS = np.exp(np.log(LEAST) * np.linspace(1.0, 0.0, 65) ** 2)
_PHASES = np.linspace(0.0, 1.0, 201) ** 2


@dataclass(frozen=True, eq=False)
class ContactMotion:
    """Motions of n contacts: times and greatest force (n,), and the force's course."""

    contact_time: Floats
    compression_time: Floats
    peak_force: Floats
    # n x 201: (force over peak)^(2/3) at `_PHASES`; smooth at both ends, as force is not
    course: Floats

    def shape(self, phase: Floats) -> Floats:
        """Force over peak, (n, p).

        Parameters:
            phase: Phases of the contact (p,), 0 its begin and 1 its end.
        """
        from scipy.interpolate import CubicSpline

        return np.asarray(np.maximum(CubicSpline(_PHASES, self.course, axis=1)(phase), 0.0) ** 1.5)


def motion(restitution: Floats) -> ContactMotion:
    """Motions that end with given restitutions.

    Interpolated: times and peaks to 1e-7, forces to 2e-5 of the peak, from e = 0.014 downwards to
    2e-4.

    Parameters:
        restitution: e (n,), all in [0.01, 1].
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
    """One motion (n = 1), by a Runge-Kutta method of order 8, until the bodies part.

    Parameters:
        damping: The damping number a, 0 or more.
    """
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

    events = (
        _Falls(lambda _, state: state[0], terminal=True),
        _Falls(lambda _, state: state[1]),
        _Falls(steepness),
    )
    run = solve_ivp(
        rate,
        (0.0, np.inf),
        [0.0, 1.0],
        "DOP853",
        events=events,
        dense_output=True,
        rtol=1e-11,
        atol=1e-13,
    )
    assert run.sol is not None and run.t_events is not None  # both asked for
    end, turn, summit = (float(times[0]) for times in run.t_events)
    peak = force(run.sol(summit))
    course = np.maximum(force(run.sol(_PHASES * end)) / peak, 0.0) ** (2 / 3)
    return ContactMotion(np.array([end]), np.array([turn]), np.array([peak]), course[None, :])


#: Contact time in units of the greatest indentation over u: (4/5) B(2/5, 1/2), the 2.9432 of eq.
#: 1.26.
_TIME = 0.8 * math.sqrt(math.pi) * math.gamma(0.4) / math.gamma(0.9)


def length_scale(bodies: Bodies, law: str) -> Floats:
    """l (m, (n,)); the greatest indentation without loss is (5/4)^(2/5) l.

    Parameters:
        bodies: n impacts.
        law: What the message calls the law that wants the mass.

    Raises:
        MissingQuantityError: Where `impactor_mass_kg` is unknown.
    """
    energy = bodies.needed("impactor_mass_kg", law) * bodies.impact_velocity_m_s**2
    return np.asarray((energy / bodies.hertz_stiffness_n_m15) ** 0.4)


def contact_time(bodies: Bodies, law: str = "Hertz' impact") -> Floats:
    """Contact time (s, (n,)) without loss.

    Parameters:
        bodies: n impacts.
        law: What the message calls the law that wants the mass; "Hertz' impact" by default.

    Raises:
        MissingQuantityError: Where `impactor_mass_kg` is unknown.

    Source:
        Eq. 1.26 with the u^(1/2) that dimensions and its source ask for u^2. The same as 2.87 (m^2
        / (R E*^2 u))^(1/5), Johnson, Contact Mechanics (1985), eq. 11.24.
    """
    return np.asarray(_TIME * 1.25**0.4 * length_scale(bodies, law) / bodies.impact_velocity_m_s)


def impactor_of_pulse(
    contact_time_s: Floats, impulse_n_s: Floats, stiffness_n_m15: Floats
) -> tuple[Floats, Floats]:
    """Mass (kg) and velocity (m/s) whose impact without loss has a given contact time and impulse,
    (n,) each.

    From the impulse 2 m u and `contact_time`: of a measured force they are what Hertz' law would
    have needed for it.

    Parameters:
        contact_time_s: Contact times (n,).
        impulse_n_s: Impulses (n,), N s.
        stiffness_n_m15: k of F = k delta^1.5 (n,), N / m^1.5.
    """
    factor = _TIME * 1.25**0.4 * 2 / 4**0.4
    mass = (contact_time_s * impulse_n_s**0.2 * stiffness_n_m15**0.4 / factor) ** (1 / 0.6)
    return mass, impulse_n_s / (2 * mass)


def hertz(bodies: Bodies) -> ContactPulse:
    """m x'' = -k x^1.5 from impact to rebound with -u; the impulse is 2 m u.

    The target stands still and neither body yields, vibrates or carries waves away.

    Parameters:
        bodies: n impacts.

    Raises:
        MissingQuantityError: Where `impactor_mass_kg` is unknown.
    """
    length = length_scale(bodies, "Hertz' impact")
    velocity = bodies.impact_velocity_m_s
    momentum = bodies.needed("impactor_mass_kg", "Hertz' impact") * velocity
    unit_impact = solve(0.0)
    return ContactPulse(
        contact_time_s=unit_impact.contact_time * length / velocity,
        compression_time_s=unit_impact.compression_time * length / velocity,
        peak_force_n=unit_impact.peak_force * momentum * velocity / length,
        impulse_n_s=2 * momentum,
        restitution=elastic(bodies),
        shape=unit_impact.shape,
    )


#: Pressure at the centre of the contact over the yield strength when yield begins (Johnson, 1985,
#: eq. 6.9, von Mises).
FIRST_YIELD = 1.6


def yield_load(
    bodies: Bodies, pressure_over_yield_strength: Floats | float = FIRST_YIELD, law: str = "yield"
) -> Floats:
    """F_y = (pi p_y)^3 R^2 / (6 E*^2) (N, (n,)): Hertz' load of the pressure p_y.

    Parameters:
        bodies: n impacts.
        pressure_over_yield_strength: p_y as a multiple of the lesser yield strength, a number or
            (n,); 1.6 by default, where yield begins.
        law: What the message calls the law that wants the strengths; "yield" by default.

    Raises:
        MissingQuantityError: Where one of the two yield strengths is unknown.

    Source:
        Johnson, Contact Mechanics (1985), eq. 4.24 and 6.10.
    """
    tip, target = (
        bodies.needed(f"{body}_yield_strength_pa", law) for body in ("impactor", "target")
    )
    pressure = pressure_over_yield_strength * np.minimum(tip, target)
    return np.asarray(
        (np.pi * pressure) ** 3 * bodies.impactor_radius_m**2 * bodies.compliance_1_pa**2 / 6
    )


def yield_velocity(bodies: Bodies, law: str = "yield") -> Floats:
    """Impact velocity (m/s, (n,)) at which Hertz' impact first reaches the load of `yield_load`.

    m u^2 / 2 = (2/5) F_y^(5/3) / k^(2/3).

    Parameters:
        bodies: n impacts.
        law: What the message calls the law that wants mass and strengths; "yield" by default.

    Raises:
        MissingQuantityError: Where `impactor_mass_kg` or one of the two yield strengths is unknown.
    """
    load = yield_load(bodies, FIRST_YIELD, law)
    energy = 0.4 * load ** (5 / 3) / bodies.hertz_stiffness_n_m15 ** (2 / 3)
    return np.asarray(np.sqrt(2 * energy / bodies.needed("impactor_mass_kg", law)))
