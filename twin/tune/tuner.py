"""From a prescribed spectrum to ranked settings, and those to avoid."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...array_types import Floats
from ..setting import Setting
from .attainability import AT_LEAST, Attainability, Evidence, attainability
from .distinct import distinct
from .forward import Forward, Outside, Progress, Refusals, level_db, nothing_refused
from .goal import Goal
from .likelihood import ENOUGH_SHOTS, fitted
from .probability import DRAWS, Proposal, proposals
from .search import Effort, Searcher, search
from .settings_to_avoid import Avoid, avoided
from .shot_correction import Discrepancy, ShotCorrection
from .space import TuningSpace

#: Draws of the forward model at the settings that are nearest without any shot.
_SPREAD_DRAWS, _SPREAD_SETTINGS = 32, 4


@dataclass(frozen=True, eq=False)
class FiredShots:
    """Shots that have been fired: settings, and the measured levels (n, f) in dB re 1 m/s2 at the goal's lines."""

    settings: tuple[Setting, ...] = ()
    level_db: Floats = field(default_factory=lambda: np.empty((0, 0)))

    def __len__(self) -> int:
        return len(self.settings)

    def __add__(self, other: FiredShots) -> FiredShots:
        """Both together, in order."""
        parts = [m.level_db for m in (self, other) if len(m)]
        return FiredShots((*self.settings, *other.settings), np.concatenate(parts) if parts else np.empty((0, 0)))


@dataclass(frozen=True, eq=False)
class Tuned:
    """Proposals that differ, best first, and settings to avoid with the reason; `learned` is what the shots taught.

    `attainability` says whether any proposal meets the goal; there is no proposal where the bench refuses all settings.
    """

    proposals: tuple[Proposal, ...]
    avoid: tuple[Avoid, ...]
    learned: ShotCorrection
    attainability: Attainability


def tune(
    forward: Forward,
    space: TuningSpace,
    goal: Goal,
    rng: np.random.Generator,
    *,
    measured: FiredShots | None = None,
    refusals: Refusals = nothing_refused,
    outside: Outside = nothing_refused,
    extrapolate: bool = False,
    effort: Effort | None = None,
    draws: int = DRAWS,
    at_least: float = AT_LEAST,
    calibrated: bool = False,
    progress: Progress | None = None,
) -> Tuned:
    """Settings for a spectrum, each with its probability, after what has been measured.

    Settings outside of the model's domain are to avoid unless `extrapolate`, or unless there is no other. A setting
    meets the goal from a probability of `at_least` on. `calibrated`: the model has learned from shots itself, and its
    draws hold all that is not known of its spectra. Raises `ValueError` where the goal's lines are not the model's.
    """
    if goal.frequency_hz.shape != forward.frequency_hz.shape or not np.allclose(
        goal.frequency_hz, forward.frequency_hz, rtol=1e-6
    ):
        raise ValueError("the goal's lines are not those of the model: expected the same frequencies")
    shots = measured or FiredShots()
    learned = learn(forward, goal, shots, rng, space, calibrated=calibrated)
    searcher = Searcher(forward, learned, goal, refusals, progress)
    measured_settings = [
        s for s in dict.fromkeys(shots.settings) if s.plate == space.plate and s.tank_pressure_pa is not None
    ]
    result = search(searcher, space, measured_settings, effort)
    best = result.best
    ranked = proposals(best, learned, goal, rng, outside=outside([c.setting for c in best]), draws=draws)
    kept = [p for p in ranked if extrapolate or not p.outside] or ranked
    stay = {id(proposal) for proposal in kept}
    apart = [p for p in ranked if id(p) not in stay]
    normals = rng.standard_normal((draws, goal.frequency_hz.size))
    evidence = Evidence(searcher, space, result, kept, apart, len(shots), at_least, normals)
    avoid = tuple(avoided(apart, kept, result.refused, goal))
    return Tuned(tuple(distinct(kept)), avoid, learned, attainability(evidence, rng))


def learn(
    forward: Forward,
    goal: Goal,
    shots: FiredShots,
    rng: np.random.Generator,
    space: TuningSpace,
    *,
    calibrated: bool = False,
) -> ShotCorrection:
    """The discrepancy after the shots. Few shots: stated deviations and the model's own spread; many: fitted ones.

    Of a calibrated model without more shots, nothing but the model's own spread and what a shot has for itself.
    """
    prior = Discrepancy(forward.frequency_hz)
    if not len(shots):
        prior = prior.of_shots_alone() if calibrated else prior
        return with_model_spread(prior, forward, goal, rng, space).after((), np.empty((0, 0)))
    residual = shots.level_db - level_db(forward.spectra(shots.settings))
    if len(shots) < ENOUGH_SHOTS:
        return with_model_spread(prior, forward, goal, rng, space).after(shots.settings, residual)
    return fitted(prior, shots.settings, residual).after(shots.settings, residual)


def with_model_spread(
    prior: Discrepancy, forward: Forward, goal: Goal, rng: np.random.Generator, space: TuningSpace
) -> Discrepancy:
    """The prior with the forward model's own spread where it comes nearest to the goal."""
    coarse = space.grid(4, 2)
    coarse = coarse[:: max(1, len(coarse) // 256)]
    apart = np.mean((level_db(forward.spectra(coarse)) - goal.level_db) ** 2, axis=1)
    nearest = [coarse[i] for i in np.argsort(apart)[:_SPREAD_SETTINGS]]
    return prior.with_spread(level_db(forward.draws(nearest, _SPREAD_DRAWS, rng)))
