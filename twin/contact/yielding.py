"""Where a ball begins to yield."""

from __future__ import annotations

import numpy as np

from ...array_types import Floats
from .bodies import Bodies

#: Pressure at the centre of the contact over the yield strength when yield begins (Johnson, 1985, eq. 6.9, von Mises).
FIRST_YIELD = 1.6


def yield_load(
    bodies: Bodies, pressure_over_yield_strength: Floats | float = FIRST_YIELD, law: str = "yield"
) -> Floats:
    """F_y = (pi p_y)^3 R^2 / (6 E*^2) (N, (n,)): Hertz' load of the pressure p_y (Johnson, eq. 4.24 and 6.10).

    p_y is a multiple of the lesser yield strength. Needs both of them, for `law`.
    """
    tip, target = (bodies.needed(f"{body}_yield_strength_pa", law) for body in ("impactor", "target"))
    pressure = pressure_over_yield_strength * np.minimum(tip, target)
    return np.asarray((np.pi * pressure) ** 3 * bodies.impactor_radius_m**2 * bodies.compliance_1_pa**2 / 6)


def yield_velocity(bodies: Bodies, law: str = "yield") -> Floats:
    """Impact velocity (m/s, (n,)) at which Hertz' impact first reaches the load of `yield_load`.

    m u^2 / 2 = (2/5) F_y^(5/3) / k^(2/3). Needs `impactor_mass_kg`, too.
    """
    load = yield_load(bodies, FIRST_YIELD, law)
    energy = 0.4 * load ** (5 / 3) / bodies.hertz_stiffness_n_m15 ** (2 / 3)
    return np.asarray(np.sqrt(2 * energy / bodies.needed("impactor_mass_kg", law)))
