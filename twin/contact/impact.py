"""Impacts solved as motions: Hertz' on a rigid target, and what effects make of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..effects import Effect, checked_effects
from .bodies import Bodies
from .dimensionless import Numbers, scales
from .effect import ContactEffect
from .force_history import Course, peak_force
from .impacts import Impacts
from .integrate_contact import STEPS, march
from .pulse import ContactPulse
from .restitution.base import Restitution


@dataclass(frozen=True, eq=False)
class ImpactPulse(ContactPulse):
    """A `ContactPulse` of n impacts that were solved; arrays (n,).

    `restitution` is Newton's, brought into [0.01, 1] as all are; `separation_velocity_m_s` is what it comes from,
    positive away from the target. `parted` is False where the impactor stays with the plate: there the contact is said
    to end when its force has fallen to 1e-4 of that at the turn.
    """

    separation_velocity_m_s: Floats
    deepest_indentation_m: Floats
    permanent_indentation_m: Floats
    parted: NDArray[np.bool_]


def impact(
    bodies: Bodies,
    effects: Sequence[Effect] = (),
    *,
    insulated: NDArray[np.bool_] | None = None,
    plate_impedance_n_s_m: Floats | None = None,
    steps: int = STEPS,
) -> ImpactPulse:
    """n impacts of a mass on F = k delta^(3/2) and a rigid target, or as effects in their order change that.

    `insulated` (n,): where an insulating layer lies on the target, nowhere unless told. `plate_impedance_n_s_m` (n,):
    of the plate's own material; the target's unless told. With the 96 steps, peak, times, impulse and restitution are
    within 1e-6 of solve_ivp's. Needs `impactor_mass_kg`, and what the effects need.
    """
    nominal = Impacts.of(bodies, insulated, plate_impedance_n_s_m)
    prepared = reduce(lambda impacts, effect: effect.prepare(impacts), checked_effects(effects, ContactEffect), nominal)
    return solve(prepared, steps)


def solve(impacts: Impacts, steps: int = STEPS) -> ImpactPulse:
    """Impacts of any quantities. Raises `ArithmeticError` where a contact does not come to an end."""
    solved = march(Numbers.of(impacts), steps)
    length, force = scales(impacts)
    velocity, peak, back = impacts.bodies.impact_velocity_m_s, peak_force(solved.nodes), -solved.velocity
    return ImpactPulse(
        contact_time_s=solved.contact_time * length / velocity,
        compression_time_s=solved.compression_time * length / velocity,
        peak_force_n=peak * force,
        impulse_n_s=impacts.mass_kg * velocity * (1 + back),
        restitution=Restitution.bounded(np.minimum(back, 1.0)),
        shape=ForceShape(Course.of(solved), peak),
        separation_velocity_m_s=back * velocity,
        deepest_indentation_m=solved.deepest * length,
        permanent_indentation_m=solved.permanent * length,
        parted=solved.parted,
    )


@dataclass(frozen=True, eq=False)
class ForceShape:
    """Force over its peak, n x p, at phases (p,) or (n, p)."""

    course: Course
    peak: Floats

    def __call__(self, phase: Floats) -> Floats:
        return self.course.at(phase) / self.peak[:, None]
