"""The contact as a stage of the chain: strikes to pulses, by a law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...array_types import Floats
from ..contact_interface import ForcePulses, OutOfDomain, Strikes
from ..effects import Effect, checked_effects
from .coupled_solver import ImpactSolver
from .domain import outside
from .effect import ContactEffect
from .effects.plate_compliance import PlateCompliance
from .impact import impact
from .impacts import Impacts
from .law_uncertainty import NO_SPREAD, SPREADS, Spread
from .laws import contact_law
from .pulse import ContactPulse
from .strikes_to_bodies import bodies_of, impedance, insulated
from .trimming import trimmed

#: Equidistant points of a pulse's contact.
PHASES = 65
#: Of each contact's own time: half of those that `impact` takes, since 1e-5 is more than enough here.
_STEPS = 48


@dataclass(frozen=True)
class LawContact:
    """A nominal law by name, or Hertz' impact with effects: a `ContactStage`.

    `restitution` names a law of restitution for the laws that lose energy. `spread` is the law's typical error unless
    told otherwise (`SPREADS`); `NO_SPREAD` for none. Raises `LookupError` for names there are none of, `ValueError`
    for effects on another law than "hertz", `TypeError` for effects of another stage.
    """

    law: str = "hertz"
    restitution: str | None = None
    effects: Sequence[Effect] = ()
    spread: Spread | None = None

    def __post_init__(self) -> None:
        contact_law(self.law, self.restitution)
        object.__setattr__(self, "effects", checked_effects(self.effects, ContactEffect))
        if self.effects and self.law != "hertz":
            raise ValueError(f"effects of the contact on {self.law!r}: expected 'hertz', the law that they change")

    @property
    def label(self) -> str:
        lost = [] if self.restitution is None else [self.restitution]
        return " + ".join([self.law, *lost, *(effect.id for effect in self.effects)])

    @property
    def normals(self) -> int:
        """1 where the law knows a spread: contact time and peak force are stretched against each other."""
        return 1 if self._spread.stretch else 0

    @property
    def _spread(self) -> Spread:
        return SPREADS.get(self.law, NO_SPREAD) if self.spread is None else self.spread

    def pulses(self, strikes: Strikes, z: Floats | None = None) -> ForcePulses:
        """Force at 65 phases. A random pulse is the mean one, longer and lower or shorter and higher by a log-normal
        factor: its impulse is the mean one's.

        Raises `MissingQuantityError` for what these strikes do not tell, `ValueError` for a `z` of another shape.
        """
        return self._stretched(trimmed(self._solved(strikes), PHASES), z)

    def pulses_on_plate(self, solver: ImpactSolver, strikes: Strikes, z: Floats | None = None) -> ForcePulses:
        """As `pulses`, where `solver` gives the mean pulses of Hertz' impacts on a plate that it knows.

        `contact.plate_compliance` does not act: the solver's plate stands in its place. Raises `ValueError` for another
        law than "hertz", and as `pulses`.
        """
        if self.law != "hertz":
            raise ValueError(f"law {self.law!r} on the modes of a plate: expected 'hertz', which is solved in time")
        impacts = Impacts.of(bodies_of(strikes), insulated(strikes), impedance(strikes))
        for effect in checked_effects(self.effects, ContactEffect):
            if effect.id != PlateCompliance.id:
                impacts = effect.prepare(impacts)
        return self._stretched(solver(impacts, np.arange(len(strikes))), z)

    def outside(self, strikes: Strikes) -> list[tuple[OutOfDomain, ...]]:
        """Restitution that had to be clipped, impacts that yield and a layer that the law does not know."""
        return outside(strikes, self._solved(strikes), frozenset(effect.id for effect in self.effects))

    def _solved(self, strikes: Strikes) -> ContactPulse:
        bodies = bodies_of(strikes)
        if not self.effects:
            return contact_law(self.law, self.restitution)(bodies)
        place = impedance(strikes)
        return impact(bodies, self.effects, insulated=insulated(strikes), plate_impedance_n_s_m=place, steps=_STEPS)

    def _stretched(self, mean: ForcePulses, z: Floats | None) -> ForcePulses:
        stretch = self._stretch(len(mean.contact_time_s), z)
        return ForcePulses(
            contact_time_s=mean.contact_time_s * stretch,
            force_n=mean.force_n / stretch[:, None],
            compression_time_s=mean.compression_time_s * stretch,
        )

    def _stretch(self, n: int, z: Floats | None) -> Floats:
        if z is None or not self.normals:
            return np.ones(n)
        if z.shape != (n, self.normals):
            raise ValueError(f"z has shape {z.shape}: expected ({n}, {self.normals})")
        return np.asarray(np.exp(z[:, 0] * self._spread.stretch))
