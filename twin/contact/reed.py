"""Reed's pulse: a sine to the power 3/2 that has the peak of Hertz' sphere."""

from __future__ import annotations

import math

import numpy as np

from .bodies import Bodies
from .hunter import sphere_contact_time
from .pulse import ContactPulse
from .restitution.base import elastic

#: Mean of sin^1.5 over half a period, 0.5564.
_MEAN = math.gamma(1.25) / (math.gamma(1.75) * math.sqrt(math.pi))


def reed(bodies: Bodies) -> ContactPulse:
    """F = F_max sin^1.5(pi t / tau), eq. 1.24 with the contact time of eq. 1.23 and F_max of eq. 1.25.

    F_max = 1.917 rho_s^(3/5) (d_s + d_p)^(-2/5) R^2 u^(6/5), d = (1 - nu^2) / (pi E). Peak and time are Hertz' own,
    the shape is not quite: the impulse is 2.3 % above 2 m_s u, the most that a sphere can give. Without loss; the
    impactor's mass beyond the tip's does not enter. Source: Reed, J. Phys. D 18 (1985) 2329.
    """
    time = sphere_contact_time(bodies)
    velocity, density = bodies.impact_velocity_m_s, bodies.impactor_density_kg_m3
    softness = (bodies.compliance_1_pa / np.pi) ** -0.4
    peak = 1.917 * density**0.6 * softness * bodies.impactor_radius_m**2 * velocity**1.2
    return ContactPulse(
        contact_time_s=time,
        compression_time_s=time / 2,
        peak_force_n=np.asarray(peak),
        impulse_n_s=_MEAN * peak * time,
        restitution=elastic(bodies),
        shape=lambda phase: np.sin(np.pi * phase)[None, :] ** 1.5,
    )
