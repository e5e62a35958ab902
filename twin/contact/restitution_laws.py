"""What a law of restitution gives.

Zener's restitution: a sphere on a thin plate that carries flexural waves away and never sends them
back.

Glossary: lambda inelasticity parameter, rho density, R sphere's radius, t plate's thickness, u
impact velocity, E' = E / (1 - nu^2), s sphere, p plate.

Weir and Tallon's restitution: a sphere on a thick block, where the softer of the two yields.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .bodies import Bodies

#: Least restitution that pulses are made of: no law here describes an impactor that stays where it
#: struck.
LEAST = 0.01


@dataclass(frozen=True, eq=False)
class Restitution:
    """Coefficient of restitution of n impacts, in [0.01, 1]; `clipped` where the law gave a value
    outside of it."""

    value: Floats
    clipped: NDArray[np.bool_]

    @classmethod
    def bounded(cls, raw: Floats) -> Restitution:
        """What a law gave, brought into the interval that the pulses allow.

        Parameters:
            raw: Coefficients of restitution (n,), of any size.
        """
        return cls(np.clip(raw, LEAST, 1.0), (raw < LEAST) | (raw > 1.0))


RestitutionLaw = Callable[[Bodies], Restitution]


def constant(value: float) -> RestitutionLaw:
    """The same restitution for every impact: a measured one, say.

    Parameters:
        value: The coefficient of restitution, in [0.01, 1].

    Returns:
        A law of restitution.

    Raises:
        ValueError: For a value outside of that range.
    """
    if not LEAST <= value <= 1:
        raise ValueError(f"restitution = {value!r}: expected in [{LEAST}, 1]")
    return lambda bodies: Restitution.bounded(np.full(len(bodies), value))


#: Nothing is lost.
elastic = constant(1.0)


def zener(bodies: Bodies) -> Restitution:
    """e = exp(-1.719 lambda), eq. 1.13.

    The exponential is a fit to Zener's equation of motion, xi'' + (1 + lambda d/ds) xi^1.5 = 0; the
    tests solve that: within 0.014 up to lambda = 1.4, too large by 0.011 at 2.

    Parameters:
        bodies: n impacts.

    Raises:
        MissingQuantityError: Where `plate_thickness_m` is unknown.

    Source:
        Zener, Phys. Rev. 59 (1941) 669, for waves that do not come back while the contact lasts.
    """
    return Restitution.bounded(np.exp(-1.719 * inelasticity(bodies)))


def inelasticity(bodies: Bodies) -> Floats:
    """lambda (n,): m / (Z T) of a sphere of the tip's radius and density.

    Z = 8 sqrt(D rho_p t) is the plate's point impedance, T = (m^2 / (k^2 u))^(1/5) the time scale
    of Hertz' contact. A hammer's or a bullet's own mass is not in it: the thesis takes the tip for
    the whole impactor.

    Parameters:
        bodies: n impacts.

    Raises:
        MissingQuantityError: Where `plate_thickness_m` is unknown.

    Source:
        Eq. 1.14, which is right as printed.
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


def weir_tallon(bodies: Bodies) -> Restitution:
    """e = 3.1 (Y / E*)^(1/2) (Y / (rho_s u^2))^(1/8), Y the lesser of the two yield strengths: eq.
    1.15, mended.

    Erratum: eq. 1.15 prints the compliance 1/E* to the power -1/2; only +1/2 makes e a pure number,
    and is in line with Johnson's 3.8 (Y / E*)^(1/2) (m u^2 / (2 Y R^3))^(-1/8) (Contact Mechanics,
    1985, eq. 11.37), which for a sphere is this with 3.47 for 3.1. It holds for fully plastic
    impacts; slower ones and soft tips give more than 1, which is clipped and reported.

    Parameters:
        bodies: n impacts.

    Raises:
        MissingQuantityError: Where one of the two yield strengths is unknown.

    Source:
        Weir and Tallon, Chem. Eng. Sci. 60 (2005) 3637.
    """
    law = "Weir and Tallon's restitution"
    tip, target = (
        bodies.needed(f"{body}_yield_strength_pa", law) for body in ("impactor", "target")
    )
    strength = np.minimum(tip, target)
    dynamic_pressure = bodies.impactor_density_kg_m3 * bodies.impact_velocity_m_s**2
    raw = 3.1 * np.sqrt(strength * bodies.compliance_1_pa) * (strength / dynamic_pressure) ** 0.125
    return Restitution.bounded(np.asarray(raw))
