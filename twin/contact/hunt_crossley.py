"""Hunt and Crossley's impact: Hertz' spring with a damping that grows with the indentation.

Glossary: m impactor's mass, u impact velocity, k and l as for Hertz, a damping number, e restitution.
"""

from __future__ import annotations

import numpy as np

from .bodies import Bodies
from .damping import DampingLaw, matched_damping, restitution_of
from .hertz import length_scale
from .motion import motion
from .pulse import ContactPulse
from .restitution.base import RestitutionLaw
from .restitution.zener import zener


def hunt_crossley(
    bodies: Bodies, restitution: RestitutionLaw = zener, damping: DampingLaw = matched_damping
) -> ContactPulse:
    """m x'' = -k x^1.5 (1 + a x' / u), eq. 1.21; the force has no jump at either end.

    The thesis's a = (3/2) (1 - e) (`low_loss_damping`) loses less than e says; the one taken here ends with e itself,
    so that the impulse is (1 + e) m u. Where e is small the bodies part slowly: the contact lasts about as 1/e, most
    of it with next to no force. Needs `impactor_mass_kg`, and what the restitution needs.
    """
    law = "Hunt and Crossley's impact"
    e = restitution(bodies)
    velocity = bodies.impact_velocity_m_s
    momentum = bodies.needed("impactor_mass_kg", law) * velocity
    length = length_scale(bodies, law)
    ends_with = restitution_of(damping(e.value))
    unit_impact = motion(ends_with)
    return ContactPulse(
        contact_time_s=unit_impact.contact_time * length / velocity,
        compression_time_s=unit_impact.compression_time * length / velocity,
        peak_force_n=np.asarray(unit_impact.peak_force * momentum * velocity / length),
        impulse_n_s=(1 + ends_with) * momentum,
        restitution=e,
        shape=unit_impact.shape,
    )
