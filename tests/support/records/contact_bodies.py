"""Impacts for tests of the laws of contact: a delrin tip on a plate of aluminium, unless told
otherwise."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from numpy.typing import ArrayLike
from pyroshock.twin.contact.bodies import Bodies
from pyroshock.twin.setting import ElasticMaterial

DELRIN = {
    "impactor_radius_m": 0.03, "impactor_youngs_modulus_pa": 3.2e9, "impactor_poisson_ratio": 0.35,
    "impactor_density_kg_m3": 1410.0, "impactor_mass_kg": 0.32,
    "impactor_yield_strength_pa": 71.7e6,
    "target_youngs_modulus_pa": 69.9e9, "target_poisson_ratio": 0.33,
    "target_density_kg_m3": 2700.0,
    "target_yield_strength_pa": 276e6, "plate_thickness_m": 0.01, "impact_velocity_m_s": 1.2,
}  # fmt: skip


def impacts(**changes: ArrayLike | None) -> Bodies:
    return Bodies.of(**{**DELRIN, **changes})


def of_materials(
    tip: ElasticMaterial, target: ElasticMaterial, **others: ArrayLike | None
) -> Bodies:
    bodies = {}
    for body, material in (("impactor", tip), ("target", target)):
        for name in ("youngs_modulus_pa", "poisson_ratio", "density_kg_m3", "yield_strength_pa"):
            bodies[f"{body}_{name}"] = getattr(material, name)
    return Bodies.of(**bodies | others)


def ball(**changes: ArrayLike | None) -> Bodies:
    """An impactor that is the sphere its tip is a part of."""
    return impacts(impactor_mass_kg=impacts(**changes).sphere_mass_kg, **changes)


def impulse(time_s: np.ndarray, force_n: np.ndarray) -> np.ndarray:
    """Integral of the force over n contacts of equidistant points."""
    return np.trapezoid(force_n, dx=1 / (force_n.shape[1] - 1), axis=1) * time_s


#: Impacts of any tip, mass and speed that a bench may have.
any_impacts = st.builds(
    impacts, impactor_radius_m=st.floats(0.002, 0.05), impactor_youngs_modulus_pa=st.floats(1e7,
    4e11),
    impactor_poisson_ratio=st.floats(0.0, 0.5), impactor_density_kg_m3=st.floats(900, 8000),
    impactor_mass_kg=st.floats(0.01, 10), impactor_yield_strength_pa=st.floats(1e7, 1e9),
    target_youngs_modulus_pa=st.floats(1e9, 4e11), plate_thickness_m=st.floats(0.003, 0.1),
    impact_velocity_m_s=st.floats(0.05, 100),
)  # fmt: skip
