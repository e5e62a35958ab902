"""Impacts solved as motions: Hertz' on a rigid target, and what effects make of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats, Index
from ..contact_interface import ForcePulses
from ..effects import Effect, checked_effects
from .bodies import Bodies
from .impacts import ContactEffect, Impacts
from .integrate_contact import STEPS, March, Nodes, Numbers, march, scales
from .pulse import ContactPulse
from .restitution_laws import Restitution


@dataclass(frozen=True, eq=False)
class ForceHistory:
    """Force at the nodes of n contacts, one contact after the other; between them, cubics through
    force and rate.

    Each contact's first node is its begin, phase 0, its last one its end, phase 1.
    """

    first: Index  # (n + 1,): where the nodes of a contact begin
    phase: Floats  # (all nodes,)
    force: Floats
    rate: Floats  # of the force, for a phase

    @classmethod
    def of(cls, march: March) -> Self:
        """The forces of solved motions, in the units of the march.

        Parameters:
            march: The solved motions of n contacts, in their own units.
        """
        nodes = march.nodes
        last = np.repeat(march.contact_time, np.diff(nodes.first))
        return cls(
            nodes.first, np.minimum(nodes.time / last, 1.0), nodes.force, nodes.force_rate * last
        )

    def at(self, phase: Floats) -> Floats:
        """Force (n, p), in the units of the nodes.

        Parameters:
            phase: Phases of the contact (p,) for all contacts, or (n, p) of each; 0 its begin and 1
                its end.
        """
        from .kernel import at_phases

        wanted = np.array(np.atleast_2d(phase), dtype=np.float64, order="C")
        force = np.empty((len(self.first) - 1, wanted.shape[1]))
        at_phases(self.first, self.phase, self.force, self.rate, wanted, force)
        return force


def peak_force(nodes: Nodes) -> Floats:
    """Greatest force of each contact (n,): of its nodes, and of the cubics between them.

    Parameters:
        nodes: Times, forces and rates of n contacts.
    """
    force, rate = nodes.force, nodes.force_rate
    peak = np.maximum.reduceat(force, nodes.first[:-1])
    falls = (rate[:-1] > 0) & (rate[1:] <= 0)
    falls[nodes.first[1:-1] - 1] = False  # from one contact's last node to the next one's first
    top = np.flatnonzero(falls)
    width = nodes.time[top + 1] - nodes.time[top]
    summits = _summit(force[top], force[top + 1], width * rate[top], width * rate[top + 1])
    np.maximum.at(peak, np.searchsorted(nodes.first, top, side="right") - 1, summits)
    return peak


def _summit(begin: Floats, end: Floats, rise: Floats, fall: Floats) -> Floats:
    """The greatest value of a cubic that rises at first, and falls or is level at last."""
    # The cubic's slope, rise + b t + c t^2; its root in the form that keeps its digits where c is
    # small.
    step = end - begin
    b, c = 6 * step - 4 * rise - 2 * fall, 3 * (rise + fall - 2 * step)
    root = np.sqrt(np.maximum(b**2 - 4 * rise * c, 0.0))  # below nothing by rounding alone
    return _hermite(2 * rise / (root - b), begin, end, rise, fall)


def _hermite(share: Floats, begin: Floats, end: Floats, rise: Floats, fall: Floats) -> Floats:
    """A cubic by its values at 0 and 1, and by its slopes there."""
    back = 1 - share
    blend = begin * (1 + 2 * share) * back**2 + end * (3 - 2 * share) * share**2
    return np.asarray(blend + share * back * (rise * back - fall * share))


@dataclass(frozen=True, eq=False)
class ImpactPulse(ContactPulse):
    """A `ContactPulse` of n impacts that were solved; arrays (n,).

    `restitution` is Newton's, brought into [0.01, 1] as all are; `separation_velocity_m_s` is what
    it comes from, positive away from the target. `parted` is False where the impactor stays with
    the plate: there the contact is said to end when its force has fallen to 1e-4 of that at the
    turn.
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
    """n impacts of a mass on F = k delta^(3/2) and a rigid target, or as effects in their order
    change that.

    Parameters:
        bodies: n impacts.
        effects: Effects of the contact, each at most once; none by default.
        insulated: Where an insulating layer lies on the target (n,); by default None, nowhere.
        plate_impedance_n_s_m: Force over velocity at a point of the plate's own material (n,), N
            s/m; by default None, that of the target's material.
        steps: Steps for each contact's own time. With the default 96, peak, times, impulse and
            restitution are within 1e-6 of solve_ivp's.

    Raises:
        MissingQuantityError: Where `impactor_mass_kg`, or what an effect needs, is unknown.
        ValueError: For arrays of another length, and for an effect given twice.
        TypeError: For an effect of another stage.
        ArithmeticError: Where a contact does not come to an end.
    """
    nominal = Impacts.of(bodies, insulated, plate_impedance_n_s_m)
    prepared = reduce(
        lambda impacts, effect: effect.prepare(impacts),
        checked_effects(effects, ContactEffect),
        nominal,
    )
    return solve(prepared, steps)


def solve(impacts: Impacts, steps: int = STEPS) -> ImpactPulse:
    """Impacts of any quantities.

    Parameters:
        impacts: n impacts, as effects have changed them.
        steps: Steps for each contact's own time; 96 by default.

    Raises:
        ArithmeticError: Where a contact does not come to an end.
    """
    solved = march(Numbers.of(impacts), steps)
    length, force = scales(impacts)
    velocity, peak, back = (
        impacts.bodies.impact_velocity_m_s,
        peak_force(solved.nodes),
        -solved.velocity,
    )
    return ImpactPulse(
        contact_time_s=solved.contact_time * length / velocity,
        compression_time_s=solved.compression_time * length / velocity,
        peak_force_n=peak * force,
        impulse_n_s=impacts.mass_kg * velocity * (1 + back),
        restitution=Restitution.bounded(np.minimum(back, 1.0)),
        shape=ForceShape(ForceHistory.of(solved), peak),
        separation_velocity_m_s=back * velocity,
        deepest_indentation_m=solved.deepest * length,
        permanent_indentation_m=solved.permanent * length,
        parted=solved.parted,
    )


@dataclass(frozen=True, eq=False)
class ForceShape:
    """Force over its peak, n x p, at phases (p,) or (n, p)."""

    course: ForceHistory
    peak: Floats

    def __call__(self, phase: Floats) -> Floats:
        return self.course.at(phase) / self.peak[:, None]


#: Force over peak below which a slow end is cut off.
LEAST_SHARE = 1e-3
#: A contact ends slowly where its compression is less than this share of it.
_SLOW = 0.25
_DENSE = np.linspace(0.0, 1.0, 1001) ** 2


def trimmed(pulse: ContactPulse, points: int) -> ForcePulses:
    """Force at equidistant phases, (n, points).

    With little restitution bodies part slowly: the contact lasts many times as long as the pulse,
    most of it with next to no force, and a few phases of it would miss the pulse. Such contacts end
    here where the force falls below 1e-3 of the peak for good.

    Parameters:
        pulse: n pulses of a law.
        points: Number of phases, both ends of the contact included.
    """
    force, time = pulse.force_n(points), pulse.contact_time_s.copy()
    slow = np.flatnonzero(pulse.compression_time_s < _SLOW * time)
    if len(slow):
        for row, dense in zip(slow, pulse.force_at(_DENSE)[slow], strict=True):
            share = _end(dense)
            time[row] *= share
            force[row] = np.interp(share * np.linspace(0, 1, points), _DENSE, dense)
            force[row, -1] = 0.0
    return ForcePulses(time, force, pulse.compression_time_s)


def _end(force: Floats) -> float:
    """Phase after which the force at the dense phases is small for good."""
    last = int(np.flatnonzero(force > LEAST_SHARE * force.max())[-1])
    return float(_DENSE[min(last + 1, len(_DENSE) - 1)])
