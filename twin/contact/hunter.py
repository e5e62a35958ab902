"""Hunter's pulse: half a sine over the contact time of Hertz' sphere."""

from __future__ import annotations

import numpy as np

from ...array_types import Floats
from .bodies import Bodies
from .pulse import ContactPulse
from .restitution.base import elastic


def sphere_contact_time(bodies: Bodies) -> Floats:
    """Contact time (s, (n,)) of a sphere of the tip's radius and density, eq. 1.23.

    tau = 4.53 [(4/3) pi rho_s (d_s + d_p)]^(2/5) R u^(-1/5), d = (1 - nu^2) / (pi E): Hertz' time with the sphere's
    own mass, to the three digits of 4.53 (4.534).
    """
    inertia = 4 / 3 * np.pi * bodies.impactor_density_kg_m3 * bodies.compliance_1_pa / np.pi
    return np.asarray(4.53 * inertia**0.4 * bodies.impactor_radius_m * bodies.impact_velocity_m_s**-0.2)


def hunter(bodies: Bodies) -> ContactPulse:
    """F = F_max sin(pi t / tau), eq. 1.22, with F_max = pi m_s u / tau of the sphere's mass m_s.

    The thesis gives no F_max for it; this one returns the sphere's momentum, 2 m_s u. (Two conventions in use: the
    second derivative of a sinusoidal indentation, 1.140 m u^2 / delta against 1.067 here, and Hertz' peak itself,
    1.25. Neither conserves momentum.) Without loss; the impactor's mass beyond the tip's does not enter.
    Source: Hunter, J. Mech. Phys. Solids 5 (1957) 162.
    """
    time = sphere_contact_time(bodies)
    momentum = bodies.sphere_mass_kg * bodies.impact_velocity_m_s
    return ContactPulse(
        contact_time_s=time,
        compression_time_s=time / 2,
        peak_force_n=np.pi * momentum / time,
        impulse_n_s=2 * momentum,
        restitution=elastic(bodies),
        shape=lambda phase: np.sin(np.pi * phase)[None, :],
    )
