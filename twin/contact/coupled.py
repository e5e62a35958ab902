"""Impacts on a plate that moves and rings under them: contact law and modes in one integration over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .coupled_tables import PlatePoint, StepTables
from .dimensionless import Numbers, scales
from .force_history import Course, peak_force
from .impact import ForceShape, ImpactPulse
from .impacts import Impacts
from .integrate_contact import LEAST_FORCE, March, Nodes, own_time
from .restitution.base import Restitution

#: Steps for each contact's own time, about that of its loading.
STEPS = 48
#: Modes of more than so many cycles in a contact's own time follow the force at once.
CYCLES = 8.0
#: The bodies stay apart for this share of all that was before when the contact is over.
APART = 0.5
#: A step is halved so many times where the force is not smooth.
_HALVINGS = 4
#: Times that modes above the table are right for, and after which an impactor touches for good: in own times, or in
#: m / Z, the time in which the plate slows the impactor down, where that is longer.
_WINDOW, _LONGEST = 3.0, 200.0
#: Most doublings of the step while an impactor creeps.
_DOUBLINGS = 12
#: Steps come in these ratios, so that many impacts share the modes' tables.
_PER_OCTAVE = 4
#: A contact creeps when it takes more than this share of its time to come to its end.
_CREEPING = 0.5


@dataclass(frozen=True, eq=False)
class CoupledPulse(ImpactPulse):
    """An `ImpactPulse` of n impacts on plates that move; arrays (n,).

    The contact is from the first touch to the last parting; in between the bodies may part and meet again, `contacts`
    times in all. It is over when they stay apart for half of the time since the first touch; what comes later is
    another impact. `impulse_n_s` counts all of it. `plate_energy_j` is what the plate has then, in motion and bent.
    """

    contacts: NDArray[np.intp]
    plate_energy_j: Floats


def coupled_impact(
    impacts: Impacts, points: Sequence[PlatePoint], *, steps: int = STEPS, cycles: float = CYCLES
) -> CoupledPulse:
    """n impacts on n points of plates; points that are the same object share their tables.

    The impactor obeys m x'' = -F, each mode q'' + 2 zeta omega q' + omega^2 q = phi F, and the approach x - sum(phi q)
    gives F by the law of `Impacts`. `plate_mobility_m_n_s` acts beside the modes, as a dashpot in series: it is the
    contact's own, never the plate's. The loss acts on the rate of the approach. Raises `ValueError` for another number
    of points than of impacts.
    """
    from . import coupled_kernel
    from .kernel import by_contact

    if len(points) != len(impacts.bodies):
        raise ValueError(f"{len(points)} points of impact for {len(impacts.bodies)} impacts: expected one for each")
    length, _ = scales(impacts)
    figures = np.stack(
        [
            impacts.mass_kg,
            impacts.bodies.impact_velocity_m_s,
            impacts.stiffness_n_mp,
            impacts.exponent,
            impacts.rate_loss_s_m,
            (impacts.yield_load_n / impacts.stiffness_n_mp) ** (1 / impacts.exponent),
            impacts.layer_compliance_m_n,
            impacts.layer_stiffening_1_n,
            impacts.plate_mobility_m_n_s,
            length,
        ],
        axis=1,
    )
    results, nodes = np.empty((9, len(points))), []
    ending = np.array([_LONGEST * steps, APART, LEAST_FORCE, _CREEPING])
    for rows, point, step, doublings in _groups(impacts, points, steps):
        longest = step * 2**doublings
        limit = 2 * np.pi * cycles / (steps * step)
        tables = StepTables.of(point, longest, doublings + _HALVINGS + 1, limit, _WINDOW * steps * longest)
        results[:, rows], group = coupled_kernel.together(
            figures[rows], longest, doublings, tables.modes, tables.steps, tables.answers, tables.energies,
            tables.rigid_1_kg, tables.compliance_m_n, ending,
        )  # fmt: skip
        group[:, 0] = rows[group[:, 0].astype(np.intp)]
        nodes.append(group)
    first, ordered = by_contact(np.concatenate(nodes), len(points))
    time, compression, deepest, permanent, velocity, parted, contacts, impulse, energy = results
    solved = March(time, compression, deepest, permanent, velocity, parted == 1, Nodes(first, *ordered))
    peak, back = peak_force(solved.nodes), -velocity
    return CoupledPulse(
        contact_time_s=time,
        compression_time_s=compression,
        peak_force_n=peak,
        impulse_n_s=impulse,
        restitution=Restitution.bounded(np.minimum(back / impacts.bodies.impact_velocity_m_s, 1.0)),
        shape=ForceShape(Course.of(solved), peak),
        separation_velocity_m_s=back,
        deepest_indentation_m=deepest,
        permanent_indentation_m=permanent,
        parted=solved.parted,
        contacts=contacts.astype(np.intp),
        plate_energy_j=energy,
    )


def _groups(
    impacts: Impacts, points: Sequence[PlatePoint], steps: int
) -> list[tuple[NDArray[np.intp], PlatePoint, float, int]]:
    """Impacts that go in the same steps on the same point: which they are, the point, the step (s), its doublings."""
    mobility = np.array([1 / point.impedance_n_s_m for point in points])
    on_plate = replace(impacts, plate_mobility_m_n_s=impacts.plate_mobility_m_n_s + mobility)
    length, _ = scales(impacts)
    contact_scale_s = own_time(Numbers.of(on_plate)) * length / impacts.bodies.impact_velocity_m_s
    slowness = impacts.mass_kg * on_plate.plate_mobility_m_n_s / contact_scale_s
    doublings = np.clip(np.round(np.log2(np.maximum(slowness, 1.0))), 0, _DOUBLINGS).astype(np.intp)
    grid = np.floor(_PER_OCTAVE * np.log2(contact_scale_s / steps)).astype(np.intp)
    rows: dict[tuple[int, int, int], list[int]] = {}
    for row, (point, place, more) in enumerate(zip(points, grid, doublings, strict=True)):
        rows.setdefault((id(point), int(place), int(more)), []).append(row)
    return [
        (np.array(group), points[group[0]], 2.0 ** (place / _PER_OCTAVE), more)
        for (_, place, more), group in rows.items()
    ]
