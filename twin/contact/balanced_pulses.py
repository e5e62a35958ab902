"""Pulses of impacts with what a law leaves open, so that momentum and energy keep their balances.

Glossary: m moving mass, u impact velocity, e restitution, J impulse, tau contact time, s mean force over peak.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ..strikes import Pulses, Strikes
from .bodies import Bodies, Floats
from .effect import ContactEffect
from .effects.plate_compliance import PlateCompliance
from .impact import solve
from .impacts import Impacts
from .struck import bodies_of, impedance, insulated
from .trimming import trimmed
from .uncertain_parameters import drawn_effects, polymeric

#: Equidistant points of a pulse's contact, and steps of its solution: errors of 1e-5.
PHASES, STEPS = 65, 48
#: What the law leaves open: logarithm of a stretch of time, logit of the restitution, logarithm of the shape's power.
DISCREPANCIES = ("time", "restitution", "shape")
#: Restitutions that a logit moves.
_LEAST, _MOST = 0.03, 0.99
#: Powers of the shape: from a pulse with a broad top to one with a narrow one.
_POWERS = (0.2, 15.0)
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

    @classmethod
    def of(cls, strikes: Strikes) -> Self:
        polymer = np.array([polymeric(setting) for setting in strikes.settings])
        return cls(_with_strengths(strikes), insulated(strikes), impedance(strikes), polymer)

    def repeated(self, count: int, impact_velocity_m_s: Floats) -> Self:
        """Each impact `count` times in a row, of other velocities (n * count,)."""
        arrays = {name: np.repeat(values, count) for name, values in vars(self.bodies).items() if values is not None}
        return replace(
            self,
            bodies=Bodies(**arrays | {"impact_velocity_m_s": impact_velocity_m_s}),
            insulated=np.repeat(self.insulated, count),
            impedance_n_s_m=np.repeat(self.impedance_n_s_m, count),
            polymer=np.repeat(self.polymer, count),
        )


def balanced_pulses(
    struck: StruckBodies,
    names: Sequence[str],
    latent: Floats,
    fixed: Sequence[ContactEffect],
    solver: Callable[[Impacts], Pulses] | None = None,
) -> Pulses:
    """Pulses at latent numbers (n, names): columns of `COLUMNS` and `DISCREPANCIES`; `fixed` effects act on all.

    The impulse is (1 + e) m u with e in [0, 1] to rounding: a stretch of time lowers the force as it lengthens the
    contact, and a shape with a narrower top has a higher peak. `solver` gives the pulses of impacts on a plate that it
    knows: then the plate's own compliance does not act, and an impactor that does not come back keeps its impulse.
    """
    columns = dict(zip(names, latent.T, strict=True))
    drawn = drawn_effects(columns, struck.polymer)
    impacts = Impacts.of(struck.bodies, struck.insulated, struck.impedance_n_s_m)
    for effect in (*drawn[:1], *fixed, *drawn[1:]) if "mass" in columns else (*fixed, *drawn):
        if solver is None or effect.id != PlateCompliance.id:
            impacts = effect.prepare(impacts)  # the mass first, since others refer to the momentum
    velocity = struck.bodies.impact_velocity_m_s
    if solver is None:
        solved = solve(impacts, STEPS)
        pulses, rebound = trimmed(solved, PHASES), solved.separation_velocity_m_s / velocity
    else:
        pulses = solver(impacts)
        rebound = pulses.impulse_n_s / (impacts.mass_kg * velocity) - 1
    restitution = np.clip(rebound, _LEAST, _MOST)
    odds = restitution / (1 - restitution) * np.exp(np.clip(columns["restitution"], -_FAR, _FAR))
    impulse = impacts.mass_kg * velocity * (1 + odds / (1 + odds))
    if solver is not None:  # an impactor that follows the plate gives it less than its momentum
        impulse *= np.minimum((1 + rebound) / (1 + restitution), 1.0)
    stretch = np.exp(np.clip(columns["time"], -_FAR, _FAR))
    power = np.exp(np.clip(columns["shape"], *np.log(_POWERS)))
    shape = pulses.force_n / pulses.peak_force_n[:, None]
    sharpened = np.maximum(shape, 0.0) ** power[:, None]
    mean, sharpened_mean = (np.trapezoid(course, axis=1) / (course.shape[1] - 1) for course in (shape, sharpened))
    longer = stretch * mean / sharpened_mean
    time = pulses.contact_time_s * longer
    peak = impulse / (time * sharpened_mean)
    return Pulses(time, sharpened * peak[:, None], pulses.compression_time_s * longer)


def _with_strengths(strikes: Strikes) -> Bodies:
    """Bodies that do not yield where a yield strength is not known."""
    bodies = bodies_of(strikes)
    if bodies.impactor_yield_strength_pa is not None and bodies.target_yield_strength_pa is not None:
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
        bodies, impactor_yield_strength_pa=strengths[:, 0].copy(), target_yield_strength_pa=strengths[:, 1].copy()
    )
