"""Bodies: broadcast, or refused by name."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.twin.contact.bodies import Bodies, MissingQuantityError
from support.records.contact_bodies import DELRIN, impacts


def test_numbers_broadcast_to_impacts_of_balls_and_tips() -> None:
    bodies = impacts(impact_velocity_m_s=[0.5, 1.0, 2.0])
    assert len(bodies) == 3
    assert bodies.plate_thickness_m is not None
    assert bodies.plate_thickness_m.tolist() == [0.01] * 3
    # A bearing ball of 1 inch weighs 66.8 g.
    assert impacts(impactor_radius_m=0.0127, impactor_density_kg_m3=7790).sphere_mass_kg == pytest.approx(0.0668, 1e-3)
    rigid = impacts(target_youngs_modulus_pa=1e30)
    assert rigid.compliance_1_pa == pytest.approx((1 - 0.35**2) / 3.2e9, rel=1e-12)


@pytest.mark.parametrize("name", [name for name in DELRIN if not name.endswith("poisson_ratio")])
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_unphysical_bodies_are_refused_by_name(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{name} = {value!r}: expected positive and finite"):
        impacts(**{name: [DELRIN[name], value]})


def test_impossible_unlike_and_missing_quantities_are_refused_by_name() -> None:
    """A quantity after one that is not known is looked at, too."""
    with pytest.raises(ValueError, match=r"plate_thickness_m = -2\.0: expected positive"):
        impacts(impactor_yield_strength_pa=None, plate_thickness_m=[0.01, -2.0, -3.0])
    for value in (-1.0, 0.51, math.nan):
        with pytest.raises(ValueError, match=f"target_poisson_ratio = {value!r}"):
            impacts(target_poisson_ratio=value)
    with pytest.raises(ValueError, match="impactor_radius_m has shape"):
        replace(impacts(), impactor_radius_m=np.ones(2))
    bodies = Bodies.of(**{name: value for name, value in DELRIN.items() if name != "impactor_mass_kg"})
    with pytest.raises(MissingQuantityError, match="Hertz' impact needs impactor_mass_kg") as caught:
        bodies.needed("impactor_mass_kg", "Hertz' impact")
    assert caught.value.quantity == "impactor_mass_kg"
