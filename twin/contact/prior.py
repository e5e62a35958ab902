"""The contact before and after measured shots: what is likely, narrowed by what was seen."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..contact_interface import Extrapolation, ForcePulses, ImpactBatch, OutOfDomain
from ..effects import Effect, checked_effects
from ..measured_shots import MeasuredShots
from ..setting import Setting
from .balanced_pulses import PHASES, StruckBodies, balanced_pulses, narrowed_pulses
from .coupled import COUPLED_PHASES, ImpactSolver
from .impacts import ContactEffect
from .shot_update import (
    DISCREPANCIES,
    LatentPosterior,
    ShotFeatures,
    lower_roots,
    updated_posterior,
)
from .uncertain_parameters import effect_of, uncertain_columns

#: Steps of ln velocity between which a posterior is straight: much shorter than a discrepancy's
#: length.
_GRID = 0.2
#: Posteriors that are kept: settings by steps of velocity.
_KEPT = 4096
#: Relative uncertainty of a velocity of which none is stated.
_UNSTATED, _LEAST_U = 0.02, 1e-3
#: Measured pulses that a contact learns from: the cost of `PriorContact.updated` grows faster than
#: their number.
MOST_PULSES = 160


@dataclass(frozen=True, eq=False)
class LearnedShots:
    """n shots: settings, those of one `configuration` (n,) repeating each other; measured velocity
    (m/s) and its relative uncertainty, (n,); logarithms of peak force (N), contact time (s) and
    impulse (N s), (n, 3), NaN for none.
    """

    settings: tuple[Setting, ...]
    configuration: NDArray[np.intp]
    velocity_m_s: Floats
    velocity_u: Floats
    logarithms: Floats

    @classmethod
    def of(cls, shots: MeasuredShots) -> LearnedShots:
        """Shots with a velocity and at least one of the three quantities."""
        values = np.column_stack([shots.peak_force_n, shots.contact_time_s, shots.impulse_n_s])
        logarithms = np.full(values.shape, np.nan)
        np.log(values, out=logarithms, where=values > 0)
        usable = (shots.impact_velocity_m_s > 0) & np.isfinite(logarithms).any(axis=1)
        rows = np.flatnonzero(usable)
        velocity = shots.impact_velocity_m_s[rows]
        relative = shots.impact_velocity_u_m_s[rows] / velocity
        relative = np.where(np.isfinite(relative), np.maximum(relative, _LEAST_U), _UNSTATED)
        settings = tuple(shots.settings[row] for row in rows)
        return cls(settings, shots.configuration[rows], velocity, relative, logarithms[rows])

    def __len__(self) -> int:
        return len(self.settings)

    def within_bounds(self, mass_known: bool) -> LearnedShots:
        """Impulses of known masses brought between m u and 2 m u, where velocity and sensor put
        them beside."""
        if not mass_known:
            return self
        momentum = np.log([s.impactor_mass_kg for s in self.settings]) + np.log(self.velocity_m_s)
        least = np.where([s.anvil is None for s in self.settings], momentum + 0.01, -np.inf)
        logarithms = self.logarithms.copy()
        logarithms[:, 2] = np.clip(logarithms[:, 2], least, momentum + math.log(1.98))
        return replace(self, logarithms=logarithms)

    def joined(self, other: LearnedShots) -> LearnedShots:
        return LearnedShots(
            self.settings + other.settings,
            np.concatenate([self.configuration, other.configuration]),
            np.concatenate([self.velocity_m_s, other.velocity_m_s]),
            np.concatenate([self.velocity_u, other.velocity_u]),
            np.concatenate([self.logarithms, other.logarithms]),
        )


_NO_SHOTS = LearnedShots((), np.zeros(0, dtype=np.intp), np.zeros(0), np.zeros(0), np.zeros((0, 3)))


@dataclass(frozen=True, eq=False)
class PriorContact:
    """A `ContactStage` that draws yield, loss, the plate's and the layer's compliance, and solves
    each draw's impact.

    The parameters are log-normal over their likely ranges (`uncertain_parameters`), what the law
    leaves open is a stretch of time, a shift of the restitution within 0 to 1 and another power of
    the shape; so every draw's impulse is (1 + e) m u with e from 0 to 1. `updated` narrows them by
    measured shots. `effects` act in every draw: their parameters are not drawn. `hand_held`: a
    hammer in a hand, whose effective mass is drawn, too, and whose force is felt at the tip.
    """

    effects: Sequence[Effect] = ()
    hand_held: bool = False
    learned: LearnedShots = _NO_SHOTS
    posterior: LatentPosterior | None = None
    _cache: dict[tuple[Setting, int], tuple[Floats, Floats]] = field(
        default_factory=dict, init=False, repr=False
    )

    def __post_init__(self) -> None:
        object.__setattr__(self, "effects", checked_effects(self.effects, ContactEffect))
        if self.posterior is None:
            object.__setattr__(self, "posterior", LatentPosterior.prior(self.names))

    @property
    def shots(self) -> int:
        """How many measured shots it has learned from."""
        return len(self.learned)

    @property
    def label(self) -> str:
        """ "prior of 4 effects", "contact law updated by 12 shots", and the effects that are
        fixed."""
        drawn = {effect_id for name in self.names if (effect_id := effect_of(name))}
        state = (
            f"contact law updated by {self.shots} shots"
            if self.shots
            else f"prior of {len(drawn)} effects"
        )
        return " + ".join([state, *(effect.id for effect in self.effects)])

    @property
    def normals(self) -> int:
        return len(self.names)

    @property
    def names(self) -> tuple[str, ...]:
        """What its normal numbers stand for, in order: columns of `COLUMNS`, and
        `DISCREPANCIES`."""
        fixed = {effect.id for effect in self.effects}
        return (*uncertain_columns(fixed, self.hand_held), *DISCREPANCIES)

    def pulses(self, strikes: ImpactBatch, z: Floats | None = None) -> ForcePulses:
        """Force at 65 phases; for `z` None of the mean of all that is drawn. Raises `ValueError`
        for another `z`."""
        return self._solved(strikes, z, at_tip=self.hand_held)

    def pulses_on_plate(
        self, solver: ImpactSolver, strikes: ImpactBatch, z: Floats | None = None
    ) -> ForcePulses:
        """As `pulses`, where `solver` gives the pulses of impacts on a plate that it knows, but for
        those on an anvil.

        `contact.plate_compliance` does not act on them. Measured shots have narrowed the other
        parameters beside it, without that plate.
        """
        return self._solved(strikes, z, at_tip=self.hand_held, phases=COUPLED_PHASES, solver=solver)

    def plate_pulses(
        self, strikes: ImpactBatch, z: Floats | None, pulses: ForcePulses
    ) -> ForcePulses:
        """What of `pulses`, those of the same strikes and `z`, acts on the plate: below an anvil,
        what its joint carries; else the same."""
        rows = [row for row, setting in enumerate(strikes.settings) if setting.anvil is not None]
        if not self.hand_held or not rows:
            return pulses
        below = ImpactBatch(
            [strikes.settings[row] for row in rows], strikes.impact_velocity_m_s[rows]
        )
        carried = self._solved(
            below, None if z is None else z[rows], at_tip=False, phases=pulses.force_n.shape[1]
        )
        time, force, turn = (
            x.copy() for x in (pulses.contact_time_s, pulses.force_n, pulses.compression_time_s)
        )
        time[rows], force[rows], turn[rows] = (
            carried.contact_time_s,
            carried.force_n,
            carried.compression_time_s,
        )
        return ForcePulses(time, force, turn)

    def _solved(
        self,
        strikes: ImpactBatch,
        z: Floats | None,
        *,
        at_tip: bool,
        phases: int = PHASES,
        solver: ImpactSolver | None = None,
    ) -> ForcePulses:
        mean, root = self._latent(strikes)
        struck = StruckBodies.of(strikes)

        def pulses(latent: Floats) -> ForcePulses:
            return balanced_pulses(
                struck, self.names, latent, self._fixed, at_tip=at_tip, phases=phases, solver=solver
            )

        if z is None:
            return pulses(mean)
        if z.shape != (len(strikes), self.normals):
            raise ValueError(f"z has shape {z.shape}: expected ({len(strikes)}, {self.normals})")
        assert self.posterior is not None  # made with the stage
        random, narrowing = (
            pulses(mean + np.einsum("nlk,nk->nl", root, z)),
            self.posterior.narrowing,
        )
        return random if narrowing == 1 else narrowed_pulses(random, pulses(mean), narrowing)

    def outside(self, strikes: ImpactBatch) -> list[tuple[OutOfDomain, ...]]:
        """Nothing: yield, loss and layer are drawn."""
        return [() for _ in range(len(strikes))]

    def extrapolation(self, strikes: ImpactBatch) -> list[tuple[Extrapolation, ...]]:
        """For each strike the quantities beyond those of the learned shots; none where nothing was
        learned."""
        if not self.shots:
            return [() for _ in range(len(strikes))]
        learned = _quantities(self.learned.settings, self.learned.velocity_m_s)
        requested_values = _quantities(strikes.settings, strikes.impact_velocity_m_s)
        ranges = {
            name: (float(values.min()), float(values.max())) for name, values in learned.items()
        }
        return [
            tuple(
                Extrapolation(name, float(values[row]), *ranges[name])
                for name, values in requested_values.items()
                if not (1 - 1e-9) * ranges[name][0] <= values[row] <= (1 + 1e-9) * ranges[name][1]
            )
            for row in range(len(strikes))
        ]

    def updated(self, shots: MeasuredShots) -> PriorContact:
        """The same contact after these shots as well; itself where none of them tells anything of a
        contact."""
        new = LearnedShots.of(shots)
        if not len(new):
            return self
        learned = self.learned.joined(new)
        posterior = updated_posterior(
            self.names,
            ShotFeatures(learned.settings, learned.velocity_m_s),
            learned.configuration,
            learned.velocity_u,
            learned.within_bounds("mass" not in self.names).logarithms,
            self._observables(learned),
        )
        return replace(self, learned=learned, posterior=posterior)

    @property
    def _fixed(self) -> tuple[ContactEffect, ...]:
        return checked_effects(self.effects, ContactEffect)

    def _observables(self, learned: LearnedShots) -> Callable[[Floats, Floats], Floats]:
        struck = StruckBodies.of(ImpactBatch(learned.settings, learned.velocity_m_s))

        def logarithms(latent: Floats, log_velocity: Floats) -> Floats:
            repeated = struck.repeated(len(latent) // len(learned), np.exp(log_velocity))
            pulses = balanced_pulses(
                repeated, self.names, latent, self._fixed, at_tip=self.hand_held
            )
            return np.log(
                np.column_stack([pulses.peak_force_n, pulses.contact_time_s, pulses.impulse_n_s])
            )

        return logarithms

    def _latent(self, strikes: ImpactBatch) -> tuple[Floats, Floats]:
        """Mean (n, latents) and lower root of the covariance (n, latents, latents) of each
        strike."""
        position = np.log(strikes.impact_velocity_m_s) / _GRID
        step = np.floor(position).astype(np.intp)
        share = position - step
        keys = [(setting, int(row)) for setting, row in zip(strikes.settings, step, strict=True)]
        wanted = dict.fromkeys(
            key for setting, row in keys for key in ((setting, row), (setting, row + 1))
        )
        latent_values = {key: at for key in wanted if (at := self._cache.get(key)) is not None}
        latent_values |= self._at([key for key in wanted if key not in latent_values])
        if len(self._cache) > _KEPT:
            self._cache.clear()
        self._cache.update(latent_values)
        ends = [
            [latent_values[setting, row + further] for setting, row in keys] for further in (0, 1)
        ]
        means, roots = ([np.array([end[part] for end in rows]) for rows in ends] for part in (0, 1))
        mean = means[0] + share[:, None] * (means[1] - means[0])
        return mean, roots[0] + share[:, None, None] * (roots[1] - roots[0])

    def _at(
        self, keys: Sequence[tuple[Setting, int]]
    ) -> dict[tuple[Setting, int], tuple[Floats, Floats]]:
        """Mean and root of the posterior at settings and steps of velocity."""
        if not keys:
            return {}
        assert self.posterior is not None  # made with the stage
        velocity = np.exp(_GRID * np.array([row for _, row in keys], dtype=np.float64))
        mean, covariance = self.posterior.at(
            ShotFeatures(tuple(setting for setting, _ in keys), velocity)
        )
        return dict(zip(keys, zip(mean, lower_roots(covariance), strict=True), strict=True))


def _quantities(settings: Sequence[Setting], velocity_m_s: Floats) -> dict[str, Floats]:
    return {
        "impact_velocity_m_s": velocity_m_s,
        "impactor_mass_kg": np.array([setting.impactor_mass_kg for setting in settings]),
        "tip_radius_m": np.array([setting.tip_radius_m for setting in settings]),
    }
