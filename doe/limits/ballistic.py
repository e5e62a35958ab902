"""The safety plate: the velocity at which a projectile perforates it (thesis eq. 2.1-2.3).

A ballistic limit velocity is where half of the projectiles get through: it is no safe velocity, and
whoever compares a shot with it keeps a margin. Both laws hold for a blunt or conical projectile
that does not deform.

Glossary: m projectile mass, d its diameter, h plate thickness, rho plate density, u velocity, P
static resistance, sigma_s stress that opens a cylindrical hole, Y yield strength, E Young's
modulus, nu Poisson's ratio, K bulk modulus.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

STANDARD_GRAVITY_M_S2 = 9.80665

#: P0 of eq. 2.1, in kgf/m2. The thesis gives no value and the publication (Nishiwaki 1951) was not
#: at hand: identified from the thesis's own figure, 10 mm for 1 kg of 48 mm at 150 m/s, rounded up
#: from 6.04e7. As "around 10 mm" covers
#: 9.5-10.5 mm, it is known within 6 %.
STATIC_RESISTANCE_KGF_M2 = 6.05e7

#: (projectile_mass_kg, projectile_diameter_m, thickness_m) -> m/s
BallisticLaw = Callable[[float, float, float], float]


def positive(**values: float) -> None:
    """Check that all values are positive and finite.

    Parameters:
        values: The numbers, by the names that an error message has for them.

    Raises:
        ValueError: For the first value that is not positive and finite; the message names it.
    """
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0):
            raise ValueError(f"{name} = {value!r}: expected positive and finite")


def _poisson(poisson_ratio: float) -> None:
    if not 0 < poisson_ratio < 0.5:
        raise ValueError(f"poisson_ratio = {poisson_ratio!r}: expected between 0 and 0.5")


def nishiwaki_limit(
    projectile_mass_kg: float,
    projectile_diameter_m: float,
    thickness_m: float,
    *,
    density_kg_m3: float = 2700.0,
    static_resistance_pa: float = STANDARD_GRAVITY_M_S2 * STATIC_RESISTANCE_KGF_M2,
) -> float:
    """Ballistic limit (m/s) of an aluminium plate: u^2 = P / rho [exp(rho pi d^2 h / (2 m)) - 1].

    It is m u du/dx = -(pi d^2 / 4) (P + rho u^2) over the thickness. The g of eq. 2.1 converts a
    coefficient in kgf/m2 (`STATIC_RESISTANCE_KGF_M2`) to P in pascal, which is what this takes.

    Parameters:
        projectile_mass_kg: The mass m of what strikes the plate.
        projectile_diameter_m: The diameter d of what strikes the plate.
        thickness_m: The thickness h of the plate.
        density_kg_m3: The density rho of the plate; 2700 by default, which is aluminium's.
        static_resistance_pa: The static resistance P of the plate; by default
            `STATIC_RESISTANCE_KGF_M2` in pascal.

    Raises:
        ValueError: For values that are not positive.

    Source:
        Nishiwaki, J. Phys. Soc. Japan 6 (1951) 374, as quoted by the thesis [37], eq. 2.1.
    """
    positive(
        density_kg_m3=density_kg_m3,
        static_resistance_pa=static_resistance_pa,
        thickness_m=thickness_m,
    )
    mass_ratio = (
        density_kg_m3 * thickness_m / _areal_mass(projectile_mass_kg, projectile_diameter_m)
    )
    return math.sqrt(static_resistance_pa / density_kg_m3 * math.expm1(mass_ratio))


def nishiwaki_thickness(
    projectile_mass_kg: float,
    projectile_diameter_m: float,
    velocity_m_s: float,
    *,
    density_kg_m3: float = 2700.0,
    static_resistance_pa: float = STANDARD_GRAVITY_M_S2 * STATIC_RESISTANCE_KGF_M2,
) -> float:
    """Thickness (m) of an aluminium plate whose `nishiwaki_limit` is a velocity.

    Parameters:
        projectile_mass_kg: The mass of what strikes the plate.
        projectile_diameter_m: The diameter of what strikes the plate.
        velocity_m_s: The ballistic limit of the plate.
        density_kg_m3: The density of the plate; 2700 by default, which is aluminium's.
        static_resistance_pa: The static resistance of the plate; by default
            `STATIC_RESISTANCE_KGF_M2` in pascal.

    Raises:
        ValueError: For values that are not positive.
    """
    positive(
        density_kg_m3=density_kg_m3,
        static_resistance_pa=static_resistance_pa,
        velocity_m_s=velocity_m_s,
    )
    mass_ratio = math.log1p(density_kg_m3 * velocity_m_s**2 / static_resistance_pa)
    return mass_ratio * _areal_mass(projectile_mass_kg, projectile_diameter_m) / density_kg_m3


def bulk_modulus(youngs_modulus_pa: float, poisson_ratio: float) -> float:
    """K = E / (3 (1 - 2 nu)), in pascal.

    Parameters:
        youngs_modulus_pa: Young's modulus E.
        poisson_ratio: Poisson's ratio nu.

    Raises:
        ValueError: Outside 0 < nu < 0.5, and for E that is not positive.
    """
    positive(youngs_modulus_pa=youngs_modulus_pa)
    _poisson(poisson_ratio)
    return youngs_modulus_pa / (3 * (1 - 2 * poisson_ratio))


def hole_opening_stress(
    yield_strength_pa: float, bulk_modulus_pa: float, poisson_ratio: float
) -> float:
    """Stress (Pa) that opens a cylindrical hole: Y/2 (1 + ln[6 (1 - 2 nu) K / ((5 - 4 nu) Y)]).

    Erratum: eq. 2.3 prints (1 - nu) for (1 - 2 nu). With (1 - 2 nu) the numerator is 2 E, which is
    what expanding a hole from nothing in a Tresca solid gives, and the incompressible limit is Y/2
    (1 + ln[2 E / (3 Y)]); as printed it would grow without bound there. For steel the printed form
    is 8 % too strong.

    Parameters:
        yield_strength_pa: The yield strength Y of the plate.
        bulk_modulus_pa: The bulk modulus K of the plate, as `bulk_modulus` gives it.
        poisson_ratio: Poisson's ratio nu of the plate.

    Raises:
        ValueError: For values that are not positive, and outside 0 < nu < 0.5.

    Source:
        Thesis eq. 2.3; Hill, The Mathematical Theory of Plasticity, 1950, after Bishop, Hill and
        Mott 1945.
    """
    positive(yield_strength_pa=yield_strength_pa, bulk_modulus_pa=bulk_modulus_pa)
    _poisson(poisson_ratio)
    stiffness = 6 * (1 - 2 * poisson_ratio) * bulk_modulus_pa
    return (
        yield_strength_pa
        / 2
        * (1 + math.log(stiffness / ((5 - 4 * poisson_ratio) * yield_strength_pa)))
    )


#: Steel of Table 4.2 (E 200 GPa, nu 0.3, Y 400 MPa). The least yield strength of S355 (EN 10025-2,
#: 355 MPa) gives 1.19 instead of 1.31 GPa, and 5.2 instead of 4.7 mm for 150 m/s: "around 5 mm" is
#: both, but 5.0 mm of it stop 147 m/s.
STEEL_OPENING_STRESS_PA = hole_opening_stress(400e6, bulk_modulus(200e9, 0.3), 0.3)


def forrestal_limit(
    projectile_mass_kg: float,
    projectile_diameter_m: float,
    thickness_m: float,
    *,
    opening_stress_pa: float = STEEL_OPENING_STRESS_PA,
) -> float:
    """Ballistic limit (m/s) of a steel plate: u^2 = pi d^2 h sigma_s / (2 m).

    Parameters:
        projectile_mass_kg: The mass m of what strikes the plate.
        projectile_diameter_m: The diameter d of what strikes the plate.
        thickness_m: The thickness h of the plate.
        opening_stress_pa: The stress sigma_s that opens a hole in the plate, as
            `hole_opening_stress` gives it; by default that of the steel of Table 4.2.

    Raises:
        ValueError: For values that are not positive.

    Source:
        Forrestal, as quoted by the thesis [36], eq. 2.2.
    """
    positive(opening_stress_pa=opening_stress_pa, thickness_m=thickness_m)
    return math.sqrt(
        opening_stress_pa * thickness_m / _areal_mass(projectile_mass_kg, projectile_diameter_m)
    )


def forrestal_thickness(
    projectile_mass_kg: float,
    projectile_diameter_m: float,
    velocity_m_s: float,
    *,
    opening_stress_pa: float = STEEL_OPENING_STRESS_PA,
) -> float:
    """Thickness (m) of a steel plate whose `forrestal_limit` is a velocity.

    Parameters:
        projectile_mass_kg: The mass of what strikes the plate.
        projectile_diameter_m: The diameter of what strikes the plate.
        velocity_m_s: The ballistic limit of the plate.
        opening_stress_pa: The stress that opens a hole in the plate, as `hole_opening_stress` gives
            it; by default that of the steel of Table 4.2.

    Raises:
        ValueError: For values that are not positive.
    """
    positive(opening_stress_pa=opening_stress_pa, velocity_m_s=velocity_m_s)
    return (
        velocity_m_s**2 * _areal_mass(projectile_mass_kg, projectile_diameter_m) / opening_stress_pa
    )


#: The law of each material that a safety plate can be made of; a lab with another plate adds its
#: own.
BALLISTIC_LAWS: Mapping[str, BallisticLaw] = {"aluminum": nishiwaki_limit, "steel": forrestal_limit}


def _areal_mass(projectile_mass_kg: float, projectile_diameter_m: float) -> float:
    """2 m / (pi d^2), in kg/m2."""
    positive(projectile_mass_kg=projectile_mass_kg, projectile_diameter_m=projectile_diameter_m)
    return 2 * projectile_mass_kg / (math.pi * projectile_diameter_m**2)
