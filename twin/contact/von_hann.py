"""The asymmetric von Hann pulse: compression as long as Hertz', restitution shorter by the coefficient of restitution.

Glossary: m impactor's mass, u impact velocity, e coefficient of restitution, tau_el and tau_an times of compression
and restitution.
"""

from __future__ import annotations

import numpy as np

from ...array_types import Floats
from .bodies import Bodies
from .hertz import contact_time
from .pulse import ContactPulse
from .restitution.base import RestitutionLaw
from .restitution.zener import zener


def von_hann(bodies: Bodies, restitution: RestitutionLaw = zener) -> ContactPulse:
    """Two halves of a raised cosine, eq. 1.26 to 1.28: tau_el = tau / 2, tau_an = e tau_el, F_max = 2 m u / tau_el.

    Impulse of the compression m u, of the whole (1 + e) m u. Errata: eq. 1.26 prints u^2 for u^(1/2) (Hertz' time);
    the second line of eq. 1.28 divides by tau_el, which neither meets the first line nor ends at zero unless e = 1:
    it is tau_an. Needs `impactor_mass_kg`, and what the restitution needs.
    """
    e = restitution(bodies)
    momentum = bodies.needed("impactor_mass_kg", "the von Hann pulse") * bodies.impact_velocity_m_s
    compression = contact_time(bodies) / 2
    return ContactPulse(
        contact_time_s=compression * (1 + e.value),
        compression_time_s=compression,
        peak_force_n=2 * momentum / compression,
        impulse_n_s=(1 + e.value) * momentum,
        restitution=e,
        shape=lambda phase: _raised_cosine(phase, e.value),
    )


def _raised_cosine(phase: Floats, restitution: Floats) -> Floats:
    """n x p; the time is in units of tau_el, and runs 1/e times as fast after the peak."""
    e = restitution[:, None]
    time = phase[None, :] * (1 + e)
    return np.asarray((1 - np.cos(np.pi * np.where(time <= 1, time, 1 + (time - 1) / e))) / 2)
