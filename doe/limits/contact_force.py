"""Peak force of an impact, and the acceleration that it gives the plate (thesis eq. 2.4-2.6, 1.26,
2.9).

Glossary: m bullet mass, u impact velocity, tau contact time, e coefficient of restitution, R tip
radius, E* contact modulus, delta indentation, k contact stiffness, D flexural rigidity, rho h mass
per area, r distance from the impact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from .ballistic import positive

#: tau u / delta of the elastic contact, (4/5) B(2/5, 1/2) = 2.9433: the number in eq. 1.26.
HERTZ_TIME = 0.8 * math.sqrt(math.pi) * math.gamma(0.4) / math.gamma(0.9)


@dataclass(frozen=True)
class Elastic:
    """Young's modulus and Poisson's ratio of an isotropic solid. Raises `ValueError` where they are
    unphysical."""

    youngs_modulus_pa: float
    poisson_ratio: float

    def __post_init__(self) -> None:
        positive(youngs_modulus_pa=self.youngs_modulus_pa)
        if not -1 < self.poisson_ratio < 0.5:
            raise ValueError(f"poisson_ratio = {self.poisson_ratio!r}: expected between -1 and 0.5")

    @property
    def compliance(self) -> float:
        """(1 - nu^2) / E, in 1/Pa."""
        return (1 - self.poisson_ratio**2) / self.youngs_modulus_pa


class HertzContact(NamedTuple):
    """Duration and peak of an elastic impact."""

    contact_time_s: float
    peak_force_n: float


def raised_sine_peak_force(
    bullet_mass_kg: float,
    impact_velocity_m_s: float,
    contact_time_s: float,
    *,
    restitution: float = 0.0,
) -> float:
    """Peak (N) of the sin^2 pulse that carries the impulse (1 + e) m u: 2 (1 + e) m u / tau.

    The thesis lets the bullet give its momentum and stay (e = 0): 1600 kN for 1 kg, 80 m/s and 0.1
    ms (eq. 2.6). A bullet that comes back gives more.

    Parameters:
        bullet_mass_kg: The mass m of the bullet.
        impact_velocity_m_s: The velocity u at which the bullet strikes.
        contact_time_s: The duration tau of the pulse.
        restitution: The coefficient of restitution e; by default 0, with which the bullet stays.

    Raises:
        ValueError: For values that are not positive, and for e outside [0, 1].

    Source:
        Thesis eq. 2.4-2.5.
    """
    positive(
        bullet_mass_kg=bullet_mass_kg,
        impact_velocity_m_s=impact_velocity_m_s,
        contact_time_s=contact_time_s,
    )
    if not 0 <= restitution <= 1:
        raise ValueError(f"restitution = {restitution!r}: expected in [0, 1]")
    return 2 * (1 + restitution) * bullet_mass_kg * impact_velocity_m_s / contact_time_s


def hertz_contact(
    tip: Elastic,
    target: Elastic,
    *,
    tip_radius_m: float,
    bullet_mass_kg: float,
    impact_velocity_m_s: float,
) -> HertzContact:
    """Contact time and peak force of a spherical tip on a flat target that is held still, without
    any loss.

    m u^2 / 2 = (2/5) k delta^(5/2), k = (4/3) E* sqrt(R), F = k delta^(3/2), tau = 2.9433 delta /
    u. Nothing yields and nothing gives way, so that the force is above what a bench sees and the
    contact shorter: metals yield from less than 1 m/s on, a thin plate recedes, an insulator
    softens. That is what a guard wants; it is no prediction.

    Erratum: eq. 1.26 prints u^2 where dimensions and its source have u^(1/2).

    Parameters:
        tip: The material of the bullet's tip.
        target: The material of what the tip meets.
        tip_radius_m: The radius R of the tip.
        bullet_mass_kg: The mass m of the bullet.
        impact_velocity_m_s: The velocity u at which the bullet strikes.

    Raises:
        ValueError: For values that are not positive.

    Source:
        Johnson, Contact Mechanics (1985), 11.4; thesis eq. 1.23 and 1.25 are the same for a sphere.
    """
    positive(
        tip_radius_m=tip_radius_m,
        bullet_mass_kg=bullet_mass_kg,
        impact_velocity_m_s=impact_velocity_m_s,
    )
    stiffness = 4 / 3 * math.sqrt(tip_radius_m) / (tip.compliance + target.compliance)
    indentation_m = (5 * bullet_mass_kg * impact_velocity_m_s**2 / (4 * stiffness)) ** 0.4
    return HertzContact(
        HERTZ_TIME * indentation_m / impact_velocity_m_s, stiffness * indentation_m**1.5
    )


@dataclass(frozen=True)
class ResonantPlate:
    """A plate that hangs in the frame. Raises `ValueError` where a value is unphysical."""

    material: Elastic
    density_kg_m3: float
    thickness_m: float
    area_m2: float

    def __post_init__(self) -> None:
        positive(
            density_kg_m3=self.density_kg_m3, thickness_m=self.thickness_m, area_m2=self.area_m2
        )

    @property
    def mass_per_area_kg_m2(self) -> float:
        return self.density_kg_m3 * self.thickness_m

    @property
    def mass_kg(self) -> float:
        return self.mass_per_area_kg_m2 * self.area_m2

    @property
    def rigidity_n_m(self) -> float:
        """D = E h^3 / (12 (1 - nu^2))."""
        return self.thickness_m**3 / (12 * self.material.compliance)

    @property
    def impedance_kg_s(self) -> float:
        """Force over velocity where an endless thin plate is struck: 8 sqrt(D rho h) (Cremer and
        Heckl)."""
        return 8 * math.sqrt(self.rigidity_n_m * self.mass_per_area_kg_m2)

    def rigid_acceleration(self, peak_force_n: float) -> float:
        """Acceleration (m/s2) of the plate as one body, F / m.

        Parameters:
            peak_force_n: The largest force F on the plate.

        Source:
            Thesis eq. 2.9, read backwards.
        """
        return peak_force_n / self.mass_kg

    def wave_acceleration(
        self, peak_force_n: float, contact_time_s: float, distance_m: float
    ) -> float:
        """Bound (m/s2) on the bending wave of a sin^2 pulse at a distance from the impact, before
        any edge answers.

        Where the plate is struck its acceleration is F' / Z, at most pi F / (tau Z). The wave
        spreads from there with the kernel sin(r^2 / (4 b t)) / t, b = sqrt(D / rho h); the peak of
        the sin^2 pulse folded with it stays below 1.6 sqrt(b tau) / r of the value at r = 0, which
        the tests integrate. A free edge can double it.

        Parameters:
            peak_force_n: The largest force F of the pulse.
            contact_time_s: The duration tau of the pulse.
            distance_m: The distance r from the point of impact, 0 or more.

        Raises:
            ValueError: For a force or a time that is not positive, and a distance that is negative
                or not finite.

        Source:
            Medick 1961, for the kernel.
        """
        positive(peak_force_n=peak_force_n, contact_time_s=contact_time_s)
        if not (math.isfinite(distance_m) and distance_m >= 0):
            raise ValueError(f"distance_m = {distance_m!r}: expected not negative and finite")
        struck = math.pi * peak_force_n / (contact_time_s * self.impedance_kg_s)
        reach_m = 1.6 * math.sqrt(
            math.sqrt(self.rigidity_n_m / self.mass_per_area_kg_m2) * contact_time_s
        )
        return struck if distance_m <= reach_m else struck * reach_m / distance_m
