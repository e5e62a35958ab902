"""Zener's restitution: a sphere on a thin plate that carries flexural waves away and never sends them back.

Glossary: lambda inelasticity parameter, rho density, R sphere's radius, t plate's thickness, u impact velocity,
E' = E / (1 - nu^2), s sphere, p plate.
"""

from __future__ import annotations

import numpy as np

from ....array_types import Floats
from ..bodies import Bodies
from .base import Restitution


def zener(bodies: Bodies) -> Restitution:
    """e = exp(-1.719 lambda), eq. 1.13.

    The exponential is a fit to Zener's equation of motion, xi'' + (1 + lambda d/ds) xi^1.5 = 0; the tests solve that:
    within 0.014 up to lambda = 1.4, too large by 0.011 at 2. Needs `plate_thickness_m`. Source: Zener, Phys. Rev. 59
    (1941) 669, for waves that do not come back while the contact lasts.
    """
    return Restitution.bounded(np.exp(-1.719 * inelasticity(bodies)))


def inelasticity(bodies: Bodies) -> Floats:
    """lambda (n,), eq. 1.14, which is right as printed: m / (Z T) of a sphere of the tip's radius and density.

    Z = 8 sqrt(D rho_p t) is the plate's point impedance, T = (m^2 / (k^2 u))^(1/5) the time scale of Hertz' contact.
    A hammer's or a bullet's own mass is not in it: the thesis takes the tip for the whole impactor.
    """
    thickness = bodies.needed("plate_thickness_m", "Zener's restitution")
    sphere = bodies.impactor_youngs_modulus_pa / (1 - bodies.impactor_poisson_ratio**2)
    plate = bodies.target_youngs_modulus_pa / (1 - bodies.target_poisson_ratio**2)
    density = bodies.target_density_kg_m3
    return np.asarray(
        (np.pi * bodies.impactor_density_kg_m3 / density) ** 0.6
        / (4 * np.sqrt(3))
        * (2 * bodies.impactor_radius_m / thickness) ** 2
        * (bodies.impact_velocity_m_s**2 * density / plate) ** 0.1
        * (1 + plate / sphere) ** -0.4
    )
