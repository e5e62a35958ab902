"""Impacts on a plate that moves and rings under them: contact law and modes in one integration over
time.

The plate as a contact feels it: its modes at the point of impact, the continuum above them, and
exact steps.

Glossary: g = phi^2 (1/kg) the squared mass-normalised shape at the point of impact; s the complex
state of a mode with s' = lambda s + (g / omega_d) F, lambda = -zeta omega + i omega_d, so that its
part of the surface's displacement is Im(s), of the velocity Im(lambda s), of the acceleration g F +
Im(lambda^2 s).

The force of a step is the cubic through force and rate at both ends (Hermite), and the answer of
every mode to it is exact. What a table of modes does not hold is the plate without edges: its
mobility 1/Z is that of modes spread evenly over frequency, with g = 2 / (pi Z) for each unit of
circular frequency (Cremer, Heckl and Petersson, Structure-Borne Sound, 2005, ch. 5: Re Y = pi/2
times modal density times mean g). From the table's end on, octave by octave up to `limit`, they are
gathered by Gauss' rule, which is exact for a window of time; by its end they have faded, since what
they stand for sends nothing back. Beyond `limit` they follow at once, and are the compliance 2 /
(pi Z limit).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Complexes, Floats
from ..contact_interface import ForcePulses
from .impact import ForceHistory, ForceShape, ImpactPulse, peak_force
from .impacts import Impacts
from .integrate_contact import LEAST_FORCE, March, Nodes, Numbers, own_time, scales
from .restitution_laws import Restitution

#: Below this |lambda h| the functions of a step are summed as series of so many terms.
_SMALL, _TERMS = 1.5, 22
#: Modes lie in blocks of so many, so that a processor takes several at once.
_BLOCK = 8
#: Gauss' rule over a band of circular frequency B is exact for times up to t with B t / 4 points
#: and some more.
_MORE_POINTS, _MOST_POINTS = 6, 200
#: Decay of an octave of the continuum over its lowest circular frequency, and up to which decay a
#: window matters.
_FADING, _FADED = 0.1, 5.0


@dataclass(frozen=True, eq=False)
class PlatePoint:
    """m modes at a point of impact: `frequency_hz` (rigid ones at 0), `damping_ratio`, `shape`
    (1/sqrt(kg)).

    `impedance_n_s_m` is that of the plate without edges, which stands for all that the modes do not
    hold; infinite for a body that has no other modes. Raises `ValueError` naming what does not fit.
    """

    frequency_hz: Floats
    damping_ratio: Floats
    shape: Floats
    impedance_n_s_m: float

    def __post_init__(self) -> None:
        for name in ("damping_ratio", "shape"):
            if getattr(self, name).shape != self.frequency_hz.shape or self.frequency_hz.ndim != 1:
                raise ValueError(
                    f"{name} has shape {getattr(self, name).shape}: expected that of frequency_hz, "
                    "(m,)"
                )
        if not self.impedance_n_s_m > 0:
            raise ValueError(
                f"impedance_n_s_m = {self.impedance_n_s_m!r}: expected a positive number, or "
                "infinity"
            )
        if np.any(self.frequency_hz < 0) or np.any(
            (self.damping_ratio < 0) | (self.damping_ratio >= 1)
        ):
            raise ValueError(
                "expected frequency_hz of 0 or more and damping_ratio from 0 to below 1"
            )

    @property
    def end_rad_s(self) -> float:
        """Up to where the table is whole: half of the mean distance of its modes beyond the last
        one."""
        if not self.frequency_hz.size:
            return 0.0
        return float(2 * np.pi * self.frequency_hz.max() * (1 + 0.5 / self.frequency_hz.size))

    @property
    def rigid_1_kg(self) -> float:
        """Inverse of the mass that the point feels as a rigid body's: the sum of g at 0 Hz."""
        return float(np.sum(self.shape[self.frequency_hz == 0] ** 2))


@dataclass(frozen=True, eq=False)
class StepTables:
    """What m modes need to go on by steps h, h/2, h/4...: the same for all impacts on a point with
    these steps.

    `modes` (4, m): omega_d, -sigma, and real and imaginary part of lambda^2. `steps` (levels, 10,
    m): real and imaginary parts of exp(lambda h) and of what F and F' at the begin, and F and F' at
    the end, add to s. `answers` (levels, 6): displacement, velocity and acceleration for F, and for
    F', at the end of a step. `rigid_1_kg`, `compliance_m_n`: of what has no modes here. `energies`
    (2, m) take s to modal energy.
    """

    step_s: float
    modes: Floats
    steps: Floats
    answers: Floats
    energies: Floats
    rigid_1_kg: float
    compliance_m_n: float

    @classmethod
    def of(
        cls, point: PlatePoint, step_s: float, levels: int, limit_rad_s: float, window_s: float
    ) -> Self:
        """For steps of `step_s` and its halves, modes up to `limit_rad_s`, and contacts that last
        `window_s`."""
        pole, weight, compliance = _gathered(point, limit_rad_s, window_s)
        damped, square = pole.imag, pole**2
        steps = np.empty((levels, 14, pole.size))
        answers = np.empty((levels, 6))
        for level in range(levels):
            turn, *parts = _hermite_step(pole, step_s / 2**level)
            scaled = [part * weight / damped for part in parts]
            between = (turn * scaled[2] + scaled[0], turn * scaled[3] + scaled[1])
            steps[level] = [
                half for part in (turn, *scaled, *between) for half in (part.real, part.imag)
            ]
            answers[level] = [
                np.sum((by * end).imag) for end in scaled[2:] for by in (1.0, pole, square)
            ]
            answers[level, 2] += weight.sum()
        # q = Im(s) / phi, q' = Im(lambda s) / phi, energy (q'^2 + omega^2 q^2) / 2
        energies = np.array([0.5 / weight, np.abs(pole) ** 2 * 0.5 / weight])
        return cls(
            step_s,
            _padded(np.array([damped, pole.real, square.real, square.imag])),
            _padded(steps),
            answers,
            _padded(energies),
            point.rigid_1_kg,
            compliance,
        )


def _gathered(point: PlatePoint, limit: float, window: float) -> tuple[Complexes, Floats, float]:
    """Poles and g of modes up to the limit, the continuum's among them; the compliance of all
    others."""
    omega, weight = 2 * np.pi * point.frequency_hz, point.shape**2
    moving = (omega > 0) & (omega < limit) & (weight > 0)
    beyond = omega >= limit
    compliance = float(np.sum(weight[beyond] / omega[beyond] ** 2))
    begin, density = point.end_rad_s, 2 / (np.pi * point.impedance_n_s_m)
    compliance += density / max(begin, limit)
    damping = point.damping_ratio[moving]
    poles, weight = omega[moving] * (1j * np.sqrt(1 - damping**2) - damping), weight[moving]
    while begin < limit and density > 0:
        end = (
            min(2 * begin, limit) if begin > 0 else limit
        )  # without any table: all at once, and nothing fades
        half, fading = (end - begin) / 2, _FADING * begin
        lasting = min(window, _FADED / fading) if fading > 0 else window
        points = min(math.ceil(half * lasting / 2) + _MORE_POINTS, _MOST_POINTS)
        nodes, shares = np.polynomial.legendre.leggauss(points)
        poles = np.concatenate([poles, 1j * (begin + half * (1 + nodes)) - fading])
        weight = np.concatenate([weight, density * half * shares])
        begin = end
    return np.asarray(poles), np.asarray(weight), compliance


def _hermite_step(pole: Complexes, step: float) -> tuple[Complexes, ...]:
    """exp(lambda h), and the integrals of exp(lambda (h - t)) times the four cubics of Hermite."""
    x = pole * step
    level, ramp, square, cube = (step * math.factorial(n) * part for n, part in enumerate(_phi(x)))
    return (
        np.exp(x),
        level - 3 * square + 2 * cube,
        step * (ramp - 2 * square + cube),
        3 * square - 2 * cube,
        step * (cube - square),
    )


def _phi(x: Complexes) -> list[Complexes]:
    """phi_1 to phi_4 of x: phi_k = sum of x^j / (j + k)!, phi_(k+1) = (phi_k - 1/k!) / x."""
    small = np.abs(x) < _SMALL
    safe = np.where(small, 1.0, x)
    functions, last = [], np.exp(x)
    for k in range(1, 5):
        last = (last - 1 / math.factorial(k - 1)) / safe
        series = np.polynomial.polynomial.polyval(
            x, [1 / math.factorial(j + k) for j in range(_TERMS)]
        )
        functions.append(np.where(small, series, last))
    return functions


def _padded(rows: Floats) -> Floats:
    """Up to a whole number of blocks of modes, with modes that do nothing."""
    padding = -rows.shape[-1] % _BLOCK
    return np.ascontiguousarray(np.pad(rows, [(0, 0)] * (rows.ndim - 1) + [(0, padding)]))


#: Steps for each contact's own time, about that of its loading.
STEPS = 48
#: Modes of more than so many cycles in a contact's own time follow the force at once.
CYCLES = 8.0
#: The bodies stay apart for this share of all that was before when the contact is over.
APART = 0.5
#: A step is halved so many times where the force is not smooth.
_HALVINGS = 4
#: Times that modes above the table are right for, and after which an impactor touches for good: in
#: own times, or in m / Z, the time in which the plate slows the impactor down, where that is
#: longer.
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

    The contact is from the first touch to the last parting; in between the bodies may part and meet
    again, `contacts` times in all. It is over when they stay apart for half of the time since the
    first touch; what comes later is another impact. `impulse_n_s` counts all of it.
    `plate_energy_j` is what the plate has then, in motion and bent.
    """

    contacts: NDArray[np.intp]
    plate_energy_j: Floats


def coupled_impact(
    impacts: Impacts, points: Sequence[PlatePoint], *, steps: int = STEPS, cycles: float = CYCLES
) -> CoupledPulse:
    """n impacts on n points of plates; points that are the same object share their tables.

    The impactor obeys m x'' = -F, each mode q'' + 2 zeta omega q' + omega^2 q = phi F, and the
    approach x - sum(phi q) gives F by the law of `Impacts`. `plate_mobility_m_n_s` acts beside the
    modes, as a dashpot in series: it is the contact's own, never the plate's. The loss acts on the
    rate of the approach. Raises `ValueError` for another number of points than of impacts.
    """
    from . import coupled_kernel
    from .kernel import by_contact

    if len(points) != len(impacts.bodies):
        raise ValueError(
            f"{len(points)} points of impact for {len(impacts.bodies)} "
            f"impacts: expected one for each"
        )
    length, _ = scales(impacts)
    figures = np.stack(
        [
            impacts.mass_kg,
            impacts.bodies.impact_velocity_m_s,
            impacts.stiffness_n_mp,
            impacts.exponent,
            impacts.rate_loss_s_m,
            (impacts.yield_load_n / impacts.stiffness_n_mp) ** (1 / impacts.exponent),
            impacts.hardening_up_to_elastic,
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
        tables = StepTables.of(
            point, longest, doublings + _HALVINGS + 1, limit, _WINDOW * steps * longest
        )
        results[:, rows], group = coupled_kernel.together(
            figures[rows], longest, doublings, tables.modes, tables.steps, tables.answers,
            tables.energies,
            tables.rigid_1_kg, tables.compliance_m_n, ending,
        )  # fmt: skip
        group[:, 0] = rows[group[:, 0].astype(np.intp)]
        nodes.append(group)
    first, ordered = by_contact(np.concatenate(nodes), len(points))
    time, compression, deepest, permanent, velocity, parted, contacts, impulse, energy = results
    solved = March(
        time, compression, deepest, permanent, velocity, parted == 1, Nodes(first, *ordered)
    )
    peak, back = peak_force(solved.nodes), -velocity
    return CoupledPulse(
        contact_time_s=time,
        compression_time_s=compression,
        peak_force_n=peak,
        impulse_n_s=impulse,
        restitution=Restitution.bounded(np.minimum(back / impacts.bodies.impact_velocity_m_s, 1.0)),
        shape=ForceShape(ForceHistory.of(solved), peak),
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
    """Impacts that go in the same steps on the same point: which they are, the point, the step (s),
    its doublings."""
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


#: Equidistant points of a pulse: more than a single contact needs, since the bodies may part and
#: meet again.
COUPLED_PHASES = 129
#: Mean pulses, at so many phases, of some impacts and of the rows that they are of the stage's
#: strikes.
ImpactSolver = Callable[[Impacts, NDArray[np.intp]], ForcePulses]
