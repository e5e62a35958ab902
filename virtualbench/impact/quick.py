"""The contact forces of many impacts alone: those of `strike_many`, as the compiled solver has them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...array_types import Floats
from ..effects import Effects
from .assemble import assemble
from .build import Impactor, ImpactTarget
from .integrate import CREEPING, LOOK, longest_s, steps_for
from .kernel import figures_of, run

__all__ = ["contact_forces"]


def contact_forces(
    impactors: Sequence[Impactor],
    targets: Sequence[ImpactTarget],
    effects: Effects,
    velocities_m_s: Floats,
    rng: np.random.Generator,
    *,
    steps_per_contact: int = 250,
) -> list[tuple[float, Floats]]:
    """Of each impact the step (s) and the force (n,) in N between tip and target, from first contact until it lets go.

    Raises `RuntimeError` as `strike_many` does.
    """
    chain = assemble(impactors, targets, effects, rng)
    steps = steps_for(chain, velocities_m_s, steps_per_contact)
    limits = (longest_s(chain, velocities_m_s) / steps).astype(np.int64)
    forces = []
    for figures, speed, step, limit in zip(figures_of(chain), velocities_m_s, steps, limits, strict=True):
        count, _, history = run(figures, float(speed), float(step), int(limit) + LOOK, LOOK, CREEPING)
        if not count:
            raise RuntimeError(f"an impact at {speed!r} m/s has not ended after {limit} steps")
        forces.append((float(step), history[0]))
    return forces
