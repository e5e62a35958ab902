"""An impact in its own units.

Glossary: lengths are in l = (m u^2 / k)^(1/(p+1)), velocities in u, forces in m u^2 / l, times in l / u; p exponent,
xi indentation, eta the impactor's velocity, a damping number chi u, lambda = m u / (l Z) Zener's inelasticity, beta
compliance of the layer, h by how much it grows stiffer with force, f static force, phi force.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from ...array_types import Floats
from .impacts import Impacts


@dataclass(frozen=True, eq=False)
class Numbers:
    """What the motions of n impacts depend on, arrays (n,)."""

    exponent: Floats
    damping: Floats
    inelasticity: Floats
    compliance: Floats
    stiffening: Floats
    yield_depth: Floats

    @classmethod
    def of(cls, impacts: Impacts) -> Self:
        length, force = scales(impacts)
        velocity = impacts.bodies.impact_velocity_m_s
        return cls(
            exponent=impacts.exponent,
            damping=impacts.rate_loss_s_m * velocity,
            inelasticity=impacts.plate_mobility_m_n_s * force / velocity,
            compliance=impacts.layer_compliance_m_n * force / length,
            stiffening=impacts.layer_stiffening_1_n * force,
            yield_depth=(impacts.yield_load_n / force) ** (1 / impacts.exponent),
        )


def scales(impacts: Impacts) -> tuple[Floats, Floats]:
    """l (m) and m u^2 / l (N), (n,)."""
    energy = impacts.mass_kg * impacts.bodies.impact_velocity_m_s**2
    length = (energy / impacts.stiffness_n_mp) ** (1 / (impacts.exponent + 1))
    return length, energy / length
