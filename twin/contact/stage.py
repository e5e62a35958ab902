"""The contact as a stage of the chain: strikes to pulses, by a law."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...array_types import Floats
from ..contact_interface import ForcePulses, ImpactBatch, OutOfDomain
from ..effects import Effect, checked_effects
from .bodies import MissingQuantityError
from .coupled import ImpactSolver
from .effects.plate_compliance import PlateCompliance
from .hertz import yield_velocity
from .impact import impact, trimmed
from .impacts import ContactEffect, Impacts, bodies_of, impedance, insulated
from .laws import contact_law
from .pulse import ContactPulse
from .restitution_laws import LEAST


def out_of_domain(
    strikes: ImpactBatch, pulse: ContactPulse, effects: frozenset[str]
) -> list[tuple[OutOfDomain, ...]]:
    """For each strike, what of it lies outside of what a law was made for.

    Parameters:
        strikes: n impacts.
        pulse: The n pulses of the law.
        effects: Ids of the effects that act; what one of them takes into account is left out.
    """
    checks = [
        _restitution(pulse),
        _yield(strikes) if "contact.plastic_yield" not in effects else {},
        _insulator(strikes) if "contact.layer_compliance" not in effects else {},
    ]
    return [tuple(check[row] for check in checks if row in check) for row in range(len(strikes))]


def _restitution(pulse: ContactPulse) -> dict[int, OutOfDomain]:
    restitution = pulse.restitution
    return {
        row: OutOfDomain("restitution", float(restitution.value[row]), f"{LEAST:g} to 1; clipped")
        for row in _rows(restitution.clipped)
    }


def _yield(strikes: ImpactBatch) -> dict[int, OutOfDomain]:
    """Impacts fast enough to leave a mark; nothing where a yield strength is not known."""
    try:
        fastest = yield_velocity(bodies_of(strikes))
    except MissingQuantityError:
        return {}
    velocity = strikes.impact_velocity_m_s
    return {
        row: OutOfDomain(
            "impact_velocity_m_s",
            float(velocity[row]),
            f"up to {fastest[row]:.3g}; faster impacts yield",
        )
        for row in _rows(velocity > fastest)
    }


def _insulator(strikes: ImpactBatch) -> dict[int, OutOfDomain]:
    valid_range = "none; the law knows no layer"
    return {
        row: OutOfDomain("insulator", strikes.settings[row].insulator, valid_range)
        for row in _rows(insulated(strikes))
    }


def _rows(chosen: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> Iterator[int]:
    return (int(row) for row in np.flatnonzero(chosen))


@dataclass(frozen=True)
class LawUncertainty:
    """Mean absolute errors of a law's peak force and contact time, relative to what was measured; 0
    knows no spread.

    Raises `ValueError` for an error that is negative or not finite.
    """

    force: float
    time: float
    source: str

    def __post_init__(self) -> None:
        for name in ("force", "time"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0):
                raise ValueError(f"spread of {name} = {getattr(self, name)!r}: expected 0 or more")

    @property
    def stretch(self) -> float:
        """Standard deviation of the logarithm of a stretch of time that divides the force: the
        quadratic mean of those of force and time, which cannot differ where the impulse is kept."""
        return math.hypot(_log_deviation(self.force), _log_deviation(self.time)) / math.sqrt(2)


def _log_deviation(error: float) -> float:
    """s of a log-normal factor X of median 1 whose mean of |X - 1| is the error: exp(s^2 / 2) erf(s
    / sqrt 2).

    About sqrt(pi / 2) times the error where that is small.
    """
    if error == 0:
        return 0.0
    low, high = 0.0, 1 + math.sqrt(2 * math.log1p(error))
    while high - low > 1e-12:
        middle = (low + high) / 2
        if math.exp(middle**2 / 2) * math.erf(middle / math.sqrt(2)) < error:
            low = middle
        else:
            high = middle
    return (low + high) / 2


NO_SPREAD = LawUncertainty(0.0, 0.0, "none")

_TABLES = "thesis, Tables 5.2 (time) and 5.3 (force): 180 hammer blows"
_ASSUMED = "assumed as the von Hann pulse's, of which it shares mass and stiffness"

#: By the law's name. A table's mean error counts a law's bias as spread: most of Hunter's and
#: Reed's is bias.
SPREADS: Mapping[str, LawUncertainty] = {
    "hann": LawUncertainty(0.2578, 0.25, _TABLES),
    "hunter": LawUncertainty(0.5224, 0.27, _TABLES),
    "reed": LawUncertainty(0.8153, 0.27, _TABLES),
    "hertz": LawUncertainty(0.2578, 0.25, _ASSUMED),
    "hunt-crossley": LawUncertainty(0.2578, 0.25, _ASSUMED),
}


#: Equidistant points of a pulse's contact.
PHASES = 65
#: Of each contact's own time: half of those that `impact` takes, since 1e-5 is more than enough
#: here.
_STEPS = 48


@dataclass(frozen=True)
class LawContact:
    """A nominal law by name, or Hertz' impact with effects: a `ContactStage`.

    `restitution` names a law of restitution for the laws that lose energy. `spread` is the law's
    typical error unless told otherwise (`SPREADS`); `NO_SPREAD` for none. Raises `LookupError` for
    names there are none of, `ValueError` for effects on another law than "hertz", `TypeError` for
    effects of another stage.
    """

    law: str = "hertz"
    restitution: str | None = None
    effects: Sequence[Effect] = ()
    spread: LawUncertainty | None = None

    def __post_init__(self) -> None:
        contact_law(self.law, self.restitution)
        object.__setattr__(self, "effects", checked_effects(self.effects, ContactEffect))
        if self.effects and self.law != "hertz":
            raise ValueError(
                f"effects of the contact on {self.law!r}: "
                f"expected 'hertz', the law that they change"
            )

    @property
    def label(self) -> str:
        lost = [] if self.restitution is None else [self.restitution]
        return " + ".join([self.law, *lost, *(effect.id for effect in self.effects)])

    @property
    def normals(self) -> int:
        """1 where the law knows a spread: contact time and peak force are stretched against each
        other."""
        return 1 if self._spread.stretch else 0

    @property
    def _spread(self) -> LawUncertainty:
        return SPREADS.get(self.law, NO_SPREAD) if self.spread is None else self.spread

    def pulses(self, strikes: ImpactBatch, z: Floats | None = None) -> ForcePulses:
        """Force at 65 phases. A random pulse is the mean one, longer and lower or shorter and
        higher by a log-normal factor: its impulse is the mean one's.

        Parameters:
            strikes: n impacts.
            z: Standard normal numbers (n, normals) of random pulses; by default None, for the mean
                ones.

        Raises:
            MissingQuantityError: For what these strikes do not tell.
            ValueError: For a `z` of another shape.
        """
        return self._stretched(trimmed(self._solved(strikes), PHASES), z)

    def pulses_on_plate(
        self, solver: ImpactSolver, strikes: ImpactBatch, z: Floats | None = None
    ) -> ForcePulses:
        """As `pulses`, of Hertz' impacts on a plate that a solver knows.

        `contact.plate_compliance` does not act: the solver's plate stands in its place.

        Parameters:
            solver: Gives the mean pulses of impacts on its plate.
            strikes: n impacts.
            z: Standard normal numbers (n, normals) of random pulses; by default None, for the mean
                ones.

        Raises:
            MissingQuantityError: As `pulses`.
            ValueError: For another law than "hertz", and as `pulses`.
        """
        if self.law != "hertz":
            raise ValueError(
                f"law {self.law!r} on the modes of a "
                f"plate: expected 'hertz', which is solved in time"
            )
        impacts = Impacts.of(bodies_of(strikes), insulated(strikes), impedance(strikes))
        for effect in checked_effects(self.effects, ContactEffect):
            if effect.id != PlateCompliance.id:
                impacts = effect.prepare(impacts)
        return self._stretched(solver(impacts, np.arange(len(strikes))), z)

    def outside(self, strikes: ImpactBatch) -> list[tuple[OutOfDomain, ...]]:
        """For each strike: restitution that had to be clipped, impacts that yield and a layer that
        the law does not know.

        Parameters:
            strikes: n impacts.

        Raises:
            MissingQuantityError: As `pulses`.
        """
        return out_of_domain(
            strikes, self._solved(strikes), frozenset(effect.id for effect in self.effects)
        )

    def _solved(self, strikes: ImpactBatch) -> ContactPulse:
        bodies = bodies_of(strikes)
        if not self.effects:
            return contact_law(self.law, self.restitution)(bodies)
        place = impedance(strikes)
        return impact(
            bodies,
            self.effects,
            insulated=insulated(strikes),
            plate_impedance_n_s_m=place,
            steps=_STEPS,
        )

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
