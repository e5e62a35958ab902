"""Pulses of impacts with what a law leaves open, so that momentum and energy keep their balances.

Glossary: m moving mass, u impact velocity, e restitution, J impulse, tau contact time, s mean force
over peak.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..contact_interface import ForcePulses, ImpactBatch
from .anvil import anvil_pulses
from .bodies import Bodies
from .coupled import ImpactSolver
from .effects.plate_compliance import PlateCompliance
from .impact import solve, trimmed
from .impacts import ContactEffect, Impacts, bodies_of, impedance, insulated
from .uncertain_parameters import ANVIL_VOLUME, JOINT, drawn_effects, polymeric

#: Equidistant points of a pulse's contact, and steps of its solution: errors of 1e-5.
PHASES, STEPS = 65, 48
#: What the law leaves open: logarithm of a stretch of time, logit of the restitution, logarithm of
#: the shape's power.
DISCREPANCIES = ("time", "restitution", "shape")
#: Where the impulse lies from the least to the greatest one: what a logit moves.
_LEAST, _MOST = 0.03, 0.99
#: Powers of the shape: from a pulse with a broad top to one with a narrow one.
_POWERS = (0.2, 15.0)
#: Halvings of the powers that a narrowed shape may have: to 0.02 of its power.
_HALVINGS = 8
#: Beyond this a discrepancy goes no further: 0.0005 to 0.9995 of a restitution.
_FAR = 7.5
#: Stands for a yield strength that is not known: such impacts do not yield.
_NEVER_YIELDS_PA = 1e15


@dataclass(frozen=True, eq=False)
class StruckBodies:
    """n impacts as arrays, ready to be solved with parameters that differ from draw to draw."""

    bodies: Bodies
    insulated: NDArray[np.bool_]
    impedance_n_s_m: Floats
    polymer: NDArray[np.bool_]
    anvil: NDArray[np.bool_]

    @classmethod
    def of(cls, strikes: ImpactBatch) -> Self:
        polymer = np.array([polymeric(setting) for setting in strikes.settings])
        anvil = np.array([setting.anvil is not None for setting in strikes.settings])
        return cls(_with_strengths(strikes), insulated(strikes), impedance(strikes), polymer, anvil)

    def repeated(self, count: int, impact_velocity_m_s: Floats) -> Self:
        """Each impact `count` times in a row, of other velocities (n * count,)."""
        arrays = {
            name: np.repeat(values, count)
            for name, values in vars(self.bodies).items()
            if values is not None
        }
        return replace(
            self,
            bodies=Bodies(**arrays | {"impact_velocity_m_s": impact_velocity_m_s}),
            insulated=np.repeat(self.insulated, count),
            impedance_n_s_m=np.repeat(self.impedance_n_s_m, count),
            polymer=np.repeat(self.polymer, count),
            anvil=np.repeat(self.anvil, count),
        )


def balanced_pulses(
    bodies: StruckBodies,
    names: Sequence[str],
    latent: Floats,
    fixed: Sequence[ContactEffect],
    *,
    at_tip: bool = False,
    phases: int = PHASES,
    solver: ImpactSolver | None = None,
) -> ForcePulses:
    """Pulses at latent numbers (n, names): columns of `COLUMNS` and `DISCREPANCIES`; `fixed`
    effects act on all. `at_tip`: the force on an anvil, not on the plate below it.

    The impulse is (1 + e) m u with e in [0, 1] to rounding: a stretch of time lowers the force as
    it lengthens the contact, and a greater restitution or a shape with a narrower top lengthens it
    below the same peak. On an anvil of mass M, which may fly on with the impactor when the pulse on
    the plate ends, e begins at -m / (m + M): there it is the reduced mass that stops. `solver`
    gives the pulses of impacts on a plate that it knows, but for those on an anvil: then the
    plate's own compliance does not act, and an impactor that does not come back keeps its impulse.
    """
    columns = dict(zip(names, latent.T, strict=True))
    effects = drawn_effects(columns, bodies.polymer)
    mass_first = 1 if "mass" in columns else 0  # others refer to the momentum
    effects = [*effects[:mass_first], *fixed, *effects[mass_first:]]
    natural, momentum, least = _natural_pulses(bodies, effects, columns, at_tip, phases, solver)
    share = np.clip((natural.impulse_n_s - least) / (2 * momentum - least), _LEAST, _MOST)
    odds = share / (1 - share) * np.exp(np.clip(columns["restitution"], -_FAR, _FAR))
    impulse = least + (2 * momentum - least) * odds / (1 + odds)
    peak = natural.peak_force_n * np.exp(-np.clip(columns["time"], -_FAR, _FAR))
    power = np.exp(np.clip(columns["shape"], *np.log(_POWERS)))
    shape = (natural.force_n / natural.peak_force_n[:, None]) ** power[:, None]
    time = impulse / (peak * _mean_share(shape, np.ones(len(shape))))
    return ForcePulses(
        time, shape * peak[:, None], natural.compression_time_s * time / natural.contact_time_s
    )


def narrowed_pulses(pulses: ForcePulses, mean: ForcePulses, share: float) -> ForcePulses:
    """Random pulses whose ln contact time deviates from that of the `mean` ones by a share of what
    it did.

    Peak and impulse stay. The shape gets the power with which they give the contact time, and the
    contact time is what fulfils the impulse to rounding.
    """
    peak, impulse = pulses.peak_force_n, pulses.impulse_n_s
    time = pulses.contact_time_s**share * mean.contact_time_s ** (1 - share)
    shape = pulses.force_n / pulses.peak_force_n[:, None]
    low, high = np.full(len(shape), np.log(_POWERS[0])), np.full(len(shape), np.log(_POWERS[1]))
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        broad = _mean_share(shape, np.exp(middle)) > impulse / (peak * time)
        low, high = np.where(broad, middle, low), np.where(broad, high, middle)
    power = np.exp((low + high) / 2)
    time = impulse / (peak * _mean_share(shape, power))
    force = shape ** power[:, None] * peak[:, None]
    return ForcePulses(time, force, pulses.compression_time_s * time / pulses.contact_time_s)


def _mean_share(shape: Floats, power: Floats) -> Floats:
    """Mean force over peak (n,) of shapes (n, p) to powers (n,)."""
    return np.asarray(np.trapezoid(shape ** power[:, None], axis=1) / (shape.shape[1] - 1))


def _natural_pulses(
    bodies: StruckBodies,
    effects: Sequence[ContactEffect],
    columns: Mapping[str, Floats],
    at_tip: bool,
    phases: int,
    solver: ImpactSolver | None,
) -> tuple[ForcePulses, Floats, Floats]:
    """Pulses as they are solved, the momentum (N s, (n,)) before, and the least impulse."""
    on_rigid_plate = _prepared(
        bodies, [effect for effect in effects if effect.id != PlateCompliance.id]
    )
    impacts = _prepared(bodies, effects)
    momentum = np.asarray(impacts.mass_kg * bodies.bodies.impact_velocity_m_s)
    time, compression = np.empty(len(momentum)), np.empty(len(momentum))
    force, least = np.empty((len(momentum), phases)), momentum.copy()
    rows = np.flatnonzero(~bodies.anvil)
    if rows.size:
        if solver is None:
            pulses = trimmed(solve(impacts.take(rows), STEPS), phases)
        else:
            pulses = solver(on_rigid_plate.take(rows), rows)
            least[rows] = np.minimum(momentum[rows], pulses.impulse_n_s)
        time[rows], force[rows], compression[rows] = (
            pulses.contact_time_s,
            pulses.force_n,
            pulses.compression_time_s,
        )
    rows = np.flatnonzero(bodies.anvil)
    if rows.size:
        volume, stiffness = (
            ANVIL_VOLUME.values(columns["anvil"][rows]),
            JOINT.values(columns["joint"][rows]),
        )
        mobility = (impacts.plate_mobility_m_n_s - on_rigid_plate.plate_mobility_m_n_s)[rows]
        mass = bodies.bodies.target_density_kg_m3[rows] * volume
        least[rows] *= mass / (impacts.mass_kg[rows] + mass)
        pulses = anvil_pulses(
            on_rigid_plate.take(rows), mass, stiffness, mobility, phases, at_tip=at_tip
        )
        time[rows], force[rows], compression[rows] = (
            pulses.contact_time_s,
            pulses.force_n,
            pulses.compression_time_s,
        )
    return ForcePulses(time, np.maximum(force, 0.0), compression), momentum, least


def _prepared(bodies: StruckBodies, effects: Sequence[ContactEffect]) -> Impacts:
    nominal = Impacts.of(bodies.bodies, bodies.insulated, bodies.impedance_n_s_m)
    return reduce(lambda impacts, effect: effect.prepare(impacts), effects, nominal)


def _with_strengths(strikes: ImpactBatch) -> Bodies:
    """Bodies that do not yield where a yield strength is not known."""
    bodies = bodies_of(strikes)
    if (
        bodies.impactor_yield_strength_pa is not None
        and bodies.target_yield_strength_pa is not None
    ):
        return bodies
    strengths = np.array(
        [
            (s.tip.yield_strength_pa, s.target.yield_strength_pa)
            if None not in (s.tip.yield_strength_pa, s.target.yield_strength_pa)
            else (_NEVER_YIELDS_PA, _NEVER_YIELDS_PA)
            for s in strikes.settings
        ]
    )
    return replace(
        bodies,
        impactor_yield_strength_pa=strengths[:, 0].copy(),
        target_yield_strength_pa=strengths[:, 1].copy(),
    )
