"""Strikes of the bench as bodies of the laws."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..contact_interface import Strikes
from ..setting import Setting
from .bodies import Bodies
from .impacts import plate_impedance


def bodies_of(strikes: Strikes) -> Bodies:
    """Tip, first layer hit, impactor's mass, plate's thickness; yield strengths where all materials tell their own."""

    def each(value: Callable[[Setting], float | None]) -> Floats | None:
        values = [value(setting) for setting in strikes.settings]
        return None if None in values else np.array(values, dtype=np.float64)

    return Bodies.of(
        impactor_radius_m=each(lambda s: s.tip_radius_m),
        impactor_youngs_modulus_pa=each(lambda s: s.tip.youngs_modulus_pa),
        impactor_poisson_ratio=each(lambda s: s.tip.poisson_ratio),
        impactor_density_kg_m3=each(lambda s: s.tip.density_kg_m3),
        impactor_mass_kg=each(lambda s: s.impactor_mass_kg),
        impactor_yield_strength_pa=each(lambda s: s.tip.yield_strength_pa),
        target_youngs_modulus_pa=each(lambda s: s.target.youngs_modulus_pa),
        target_poisson_ratio=each(lambda s: s.target.poisson_ratio),
        target_density_kg_m3=each(lambda s: s.target.density_kg_m3),
        target_yield_strength_pa=each(lambda s: s.target.yield_strength_pa),
        plate_thickness_m=each(lambda s: s.plate_thickness_m),
        impact_velocity_m_s=strikes.impact_velocity_m_s,
    )


def insulated(strikes: Strikes) -> NDArray[np.bool_]:
    """Where an insulating layer lies on the target, (n,)."""
    return np.array([setting.insulator != "none" for setting in strikes.settings])


def impedance(strikes: Strikes) -> Floats:
    """Point impedance (N s/m, (n,)) of the plate's own material, whatever lies on it."""
    plates = [
        (s.plate.youngs_modulus_pa, s.plate.poisson_ratio, s.plate.density_kg_m3, s.plate_thickness_m)
        for s in strikes.settings
    ]
    return plate_impedance(*np.array(plates).reshape(-1, 4).T)
