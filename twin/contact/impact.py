"""Impacts solved as motions: Hertz' on a rigid target, and what effects make of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from ..effects import Effect, checked_effects
from .bodies import Bodies, Floats
from .course import Course, peak_force
from .effect import ContactEffect
from .impacts import Impacts
from .marching import STEPS, March, march
from .numbers import Numbers, scales
from .pulse import ContactPulse
from .restitution.base import Restitution

_BLOCK = 10_000  # impacts solved at once: some 100 MB


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
    numbers = Numbers.of(impacts)
    n = len(impacts.bodies)
    blocks = [np.arange(start, min(start + _BLOCK, n)) for start in range(0, n, _BLOCK)]
    marches = [march(numbers.take(block), steps) for block in blocks]
    return _in_si(impacts, marches)


@dataclass(eq=False)
class _Shape:
    """Force over its peak, n x p, at phases (p,). The course takes the place of the marches when first asked for."""

    known: Sequence[March] | Course
    peak: Floats

    def __call__(self, phase: Floats) -> Floats:
        if not isinstance(self.known, Course):
            self.known = Course.joined([Course.of(one) for one in self.known])
        return np.asarray(self.known.at(phase) / self.peak[:, None])


def _in_si(impacts: Impacts, marches: Sequence[March]) -> ImpactPulse:
    length, force = scales(impacts)
    velocity, peak = impacts.bodies.impact_velocity_m_s, np.concatenate([peak_force(one) for one in marches])
    back = -np.concatenate([one.velocity for one in marches])

    def times(name: str) -> Floats:
        return np.concatenate([getattr(one, name) for one in marches])

    return ImpactPulse(
        contact_time_s=times("contact_time") * length / velocity,
        compression_time_s=times("compression_time") * length / velocity,
        peak_force_n=peak * force,
        impulse_n_s=impacts.mass_kg * velocity * (1 + back),
        restitution=Restitution.bounded(np.minimum(back, 1.0)),
        shape=_Shape(marches, peak),
        separation_velocity_m_s=back * velocity,
        deepest_indentation_m=times("deepest") * length,
        permanent_indentation_m=times("permanent") * length,
        parted=np.concatenate([one.parted for one in marches]),
    )
