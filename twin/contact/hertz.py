"""Hertz' impact: the impactor on a spring that hardens with the contact's area, and nothing is lost.

Glossary: m impactor's mass, u impact velocity, k stiffness of F = k delta^1.5 (eq. 1.16), l = (m u^2 / k)^(2/5).
"""

from __future__ import annotations

import math

import numpy as np

from ...array_types import Floats
from .bodies import Bodies
from .motion import solve
from .pulse import ContactPulse
from .restitution.base import elastic

#: Contact time in units of the greatest indentation over u: (4/5) B(2/5, 1/2), the 2.9432 of eq. 1.26.
_TIME = 0.8 * math.sqrt(math.pi) * math.gamma(0.4) / math.gamma(0.9)


def length_scale(bodies: Bodies, law: str) -> Floats:
    """l (m, (n,)); the greatest indentation without loss is (5/4)^(2/5) l. Needs `impactor_mass_kg`, for `law`."""
    energy = bodies.needed("impactor_mass_kg", law) * bodies.impact_velocity_m_s**2
    return np.asarray((energy / bodies.hertz_stiffness_n_m15) ** 0.4)


def contact_time(bodies: Bodies, law: str = "Hertz' impact") -> Floats:
    """Contact time (s, (n,)) without loss, eq. 1.26 with the u^(1/2) that dimensions and its source ask for u^2.

    The same as 2.87 (m^2 / (R E*^2 u))^(1/5), Johnson, Contact Mechanics (1985), eq. 11.24.
    """
    return np.asarray(_TIME * 1.25**0.4 * length_scale(bodies, law) / bodies.impact_velocity_m_s)


def impactor_of_pulse(contact_time_s: Floats, impulse_n_s: Floats, stiffness_n_m15: Floats) -> tuple[Floats, Floats]:
    """Mass (kg) and velocity (m/s) whose impact without loss has this contact time and impulse, (n,) each.

    From the impulse 2 m u and `contact_time`: of a measured force they are what Hertz' law would have needed for it.
    """
    factor = _TIME * 1.25**0.4 * 2 / 4**0.4
    mass = (contact_time_s * impulse_n_s**0.2 * stiffness_n_m15**0.4 / factor) ** (1 / 0.6)
    return mass, impulse_n_s / (2 * mass)


def hertz(bodies: Bodies) -> ContactPulse:
    """m x'' = -k x^1.5 from impact to rebound with -u; the impulse is 2 m u. Needs `impactor_mass_kg`.

    The target stands still and neither body yields, vibrates or carries waves away.
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
