"""Weir and Tallon's restitution: a sphere on a thick block, where the softer of the two yields."""

from __future__ import annotations

import numpy as np

from ..bodies import Bodies
from .base import Restitution


def weir_tallon(bodies: Bodies) -> Restitution:
    """e = 3.1 (Y / E*)^(1/2) (Y / (rho_s u^2))^(1/8), Y the lesser of the two yield strengths: eq. 1.15, mended.

    Erratum: eq. 1.15 prints the compliance 1/E* to the power -1/2; only +1/2 makes e a pure number, and is in line
    with Johnson's 3.8 (Y / E*)^(1/2) (m u^2 / (2 Y R^3))^(-1/8) (Contact Mechanics, 1985, eq. 11.37), which for a
    sphere is this with 3.47 for 3.1. It holds for fully plastic impacts; slower ones and soft tips give more than 1,
    which is clipped and told. Needs both yield strengths. Source: Weir and Tallon, Chem. Eng. Sci. 60 (2005) 3637.
    """
    law = "Weir and Tallon's restitution"
    tip, target = (bodies.needed(f"{body}_yield_strength_pa", law) for body in ("impactor", "target"))
    strength = np.minimum(tip, target)
    dynamic_pressure = bodies.impactor_density_kg_m3 * bodies.impact_velocity_m_s**2
    raw = 3.1 * np.sqrt(strength * bodies.compliance_1_pa) * (strength / dynamic_pressure) ** 0.125
    return Restitution.bounded(np.asarray(raw))
