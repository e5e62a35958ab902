"""Zener's and Weir and Tallon's restitution."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.twin.contact.bodies import MissingQuantityError
from pyroshock.twin.contact.restitution_laws import (
    LEAST,
    Restitution,
    constant,
    inelasticity,
    weir_tallon,
    zener,
)
from support.records.contact_bodies import ball, impacts

STEEL = {
    "impactor_youngs_modulus_pa": 200e9,
    "impactor_poisson_ratio": 0.3,
    "impactor_density_kg_m3": 7800.0,
    "impactor_yield_strength_pa": 400e6,
}


def test_inelasticity_is_mass_over_impedance_and_time() -> None:
    """Eq. 1.14 is m / (Z T): Z = 8 sqrt(D rho t) of the plate, T = (m^2 / (k^2 u))^(1/5) of the
    contact."""
    bodies = ball(plate_thickness_m=[0.004, 0.01], **STEEL)
    rigidity = np.array([0.004, 0.01]) ** 3 * 69.9e9 / (12 * (1 - 0.33**2))
    impedance = 8 * np.sqrt(rigidity * 2700 * np.array([0.004, 0.01]))
    mass = bodies.sphere_mass_kg
    time = (mass**2 / (bodies.hertz_stiffness_n_m15**2 * 1.2)) ** 0.2
    assert inelasticity(bodies) == pytest.approx(mass / (impedance * time), rel=1e-12)


def test_restitution_beyond_its_bounds_is_clipped_and_told_and_quantities_are_asked_for() -> None:
    """Zener's on a sheet, Weir and Tallon's above one; the bounds themselves are allowed."""
    assert zener(impacts(plate_thickness_m=[0.01, 0.1, 10.0])).value == pytest.approx(
        [0.5, 1, 1], abs=0.05
    )
    sheet = zener(impacts(plate_thickness_m=[0.01, 0.001]))
    assert sheet.clipped.tolist() == [False, True]
    assert sheet.value[1] == LEAST
    above = weir_tallon(impacts(impact_velocity_m_s=[0.5, 200.0]))
    assert above.clipped.tolist() == [True, False]
    assert above.value[0] == 1.0
    beyond = Restitution.bounded(np.array([0.999 * LEAST, LEAST, 0.5, 1.0, 1.001]))
    assert beyond.value.tolist() == [LEAST, LEAST, 0.5, 1.0, 1.0]
    assert beyond.clipped.tolist() == [True, False, False, False, True]
    assert constant(LEAST)(ball()).value.tolist() == [LEAST]
    for value in (0.0, 1.01, float("nan")):
        with pytest.raises(ValueError, match="restitution = "):
            constant(value)
    for quantity in _STRENGTHS:
        with pytest.raises(
            MissingQuantityError, match=f"Weir and Tallon's restitution needs {quantity}"
        ):
            weir_tallon(impacts(**{quantity: None}))
    with pytest.raises(MissingQuantityError, match="Zener's restitution needs plate_thickness_m"):
        zener(impacts(plate_thickness_m=None))


def test_weir_tallon_in_johnsons_form_of_either_body() -> None:
    """Johnson's eq. 11.37, 3.8 (Y/E*)^(1/2) (m u^2 / (2 Y R^3))^(-1/8), with 3.1 for what is 3.47
    for a sphere."""
    bodies = ball(impact_velocity_m_s=np.array([5.0, 50.0]), **STEEL)
    strength = 276e6  # of the plate, the softer one
    johnson = 3.8 * np.sqrt(strength * bodies.compliance_1_pa)
    johnson *= (
        bodies.sphere_mass_kg * bodies.impact_velocity_m_s**2 / (2 * strength * 0.03**3)
    ) ** -0.125
    found = weir_tallon(bodies)
    assert found.value / johnson == pytest.approx(
        3.1 / (3.8 * (2 * np.pi / 3) ** -0.125), rel=1e-12
    )
    assert not found.clipped.any()
    tip, target = (
        weir_tallon(impacts(impact_velocity_m_s=90.0, **{name: 1e6})).value for name in _STRENGTHS
    )
    assert tip == pytest.approx(target)
    assert tip < weir_tallon(impacts(impact_velocity_m_s=90.0)).value


_STRENGTHS = ("impactor_yield_strength_pa", "target_yield_strength_pa")
