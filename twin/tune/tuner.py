"""From a prescribed spectrum to ranked settings, and those to avoid.

Proposals that differ: what the bench cannot set apart, or a sensor cannot tell apart, is one
proposal.

Settings that look right and are not: near in level, but refused, outside of the model, or likely to
overtest.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...array_types import Floats
from ..discrepancy.likelihood import ENOUGH_SHOTS, fitted
from ..discrepancy.shot_correction import Discrepancy, ShotCorrection
from ..setting import Setting
from .attainability import AT_LEAST, Attainability, Evidence, attainability
from .choices import Choice, choices
from .goal import Forward, Goal, Outside, Progress, Refusals, level_db, nothing_refused
from .probability import DRAWS, Proposal, proposals
from .search import Candidate, Effort, Searcher, search
from .space import TuningSpace, set_alike

#: Expected spectra that lie nearer than this at every line are the same: a third of the scatter
#: from shot to shot.
SAME_SPECTRUM_DB = 0.25


def distinct(ranked: Sequence[Proposal]) -> list[Proposal]:
    """Ranked proposals, in their order; of those that are alike the first, with the others as its
    `alternatives`.

    Parameters:
        ranked: Proposals, best first.
    """
    kept: list[Proposal] = []
    for proposal in ranked:
        for place, better in enumerate(kept):
            if alike(better, proposal):
                kept[place] = replace(better, alternatives=(*better.alternatives, proposal.setting))
                break
        else:
            kept.append(proposal)
    return kept


def alike(first: Proposal, second: Proposal) -> bool:
    """Whether two proposals are set alike, or promise the same spectrum; both inside or both
    outside of the domain.

    Parameters:
        first: One proposal.
        second: The other proposal.
    """
    if bool(first.outside) != bool(second.outside):
        return False
    nearest_db = float(np.abs(first.level_db - second.level_db).max())
    return nearest_db < SAME_SPECTRUM_DB or set_alike(first.setting, second.setting)


#: How near (dB, mean over the lines) a spectrum's level is to the goal's for a setting to look
#: right.
NEAR_DB = 3.0
#: Settings to choose from.
MOST_CHOICES = 10
#: From this probability on a setting is said to overtest.
OVERTEST = 0.9
#: Of each kind, the nearest.
_EACH = 5


@dataclass(frozen=True)
class SettingToAvoid:
    """A setting not to fire, and why."""

    setting: Setting
    reason: str
    level_error_db: float


def settings_to_avoid(
    outside: Sequence[Proposal], kept: Sequence[Proposal], refused: Sequence[Candidate], goal: Goal
) -> list[SettingToAvoid]:
    """The nearest of each kind: beyond the bench, outside of the model's domain, and likely to
    overtest.

    Parameters:
        outside: Proposals outside of the model's domain.
        kept: The other proposals, best first, of which those likely to overtest are to avoid; the
            first one never is.
        refused: Candidates that the bench refuses.
        goal: The prescribed spectrum.
    """
    beyond_bench = [
        SettingToAvoid(
            c.setting, f"beyond the bench: {'; '.join(c.refused)}", _level_error_db(c, goal)
        )
        for c in refused
    ]
    beyond_model = [
        SettingToAvoid(
            p.setting, f"outside of the model: {'; '.join(p.outside)}", _level_error_db(p, goal)
        )
        for p in outside
    ]
    nearest: list[SettingToAvoid] = []
    for kind in (beyond_bench, beyond_model, _overtest(kept, goal)):
        near = [setting for setting in kind if abs(setting.level_error_db) <= NEAR_DB]
        nearest += sorted(near, key=lambda setting: abs(setting.level_error_db))[:_EACH]
    return nearest


def _level_error_db(proposed: Candidate | Proposal, goal: Goal) -> float:
    return float(np.mean(proposed.level_db - goal.level_db))


def _overtest(kept: Sequence[Proposal], goal: Goal) -> Iterator[SettingToAvoid]:
    """All but the first, which is the best there is even where it overtests."""
    for proposal in kept[1:]:
        over = proposal.level_db - goal.level_db - goal.upper_db
        line = int(np.argmax(over))
        if proposal.probability_overtest >= OVERTEST and over[line] > 0:
            words = (
                f"{over[line]:.1f} dB above the upper edge at "
                f"{goal.frequency_hz[line]:.0f} Hz expected"
            )
            yield SettingToAvoid(
                proposal.setting, f"overtests: {words}", _level_error_db(proposal, goal)
            )


#: Draws of the forward model at the settings that are nearest without any shot.
_SPREAD_DRAWS, _SPREAD_SETTINGS = 32, 4


@dataclass(frozen=True, eq=False)
class FiredShots:
    """Shots that have been fired: settings, and the measured levels (n, f) in dB re 1 m/s2 at the
    goal's lines."""

    settings: tuple[Setting, ...] = ()
    level_db: Floats = field(default_factory=lambda: np.empty((0, 0)))

    def __len__(self) -> int:
        return len(self.settings)

    def __add__(self, other: FiredShots) -> FiredShots:
        """Both together, in order."""
        parts = [m.level_db for m in (self, other) if len(m)]
        return FiredShots(
            (*self.settings, *other.settings), np.concatenate(parts) if parts else np.empty((0, 0))
        )


@dataclass(frozen=True, eq=False)
class Tuned:
    """Proposals that differ, best first, and settings to avoid with the reason; `learned` is what
    the shots taught.

    `attainability` says whether any proposal meets the goal; there is no proposal where the bench
    refuses all settings. `choices` are the best proposal and those that are better than it at
    something.
    """

    proposals: tuple[Proposal, ...]
    avoid: tuple[SettingToAvoid, ...]
    learned: ShotCorrection
    attainability: Attainability
    choices: tuple[Choice, ...] = ()


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

    Parameters:
        forward: The model that predicts the spectra.
        space: The settings that there are.
        goal: The prescribed spectrum, at the lines of the model.
        rng: Generator of all draws.
        measured: Shots that have been fired; by default None, no shot.
        refusals: Says for which reasons the bench must not fire a setting; by default it refuses
            nothing.
        outside: Says what of a setting the model has not been made for; by default nothing.
        extrapolate: Whether settings outside of the model's domain are proposed too. By default
            they are to avoid, unless there is no other.
        effort: How fine the search is; by default `Effort()`.
        draws: Number of random spectra for each probability; 400 by default.
        at_least: Probability from which on a setting meets the goal; 0.5 by default.
        calibrated: Whether the model has learned from shots itself, and its draws hold all that is
            not known of its spectra; by default it has not.
        progress: Called with the settings done, their number and what is being done; by default
            None, nothing is called.

    Raises:
        ValueError: Where the goal's lines are not the model's.
    """
    lines_hz = forward.frequency_hz
    if goal.frequency_hz.shape != lines_hz.shape or not np.allclose(
        goal.frequency_hz, lines_hz, rtol=1e-6
    ):
        raise ValueError(
            "the goal's lines are not those of the model: expected the same frequencies"
        )
    shots = measured or FiredShots()
    learned = learn(forward, goal, shots, rng, space, calibrated=calibrated)
    searcher = Searcher(forward, learned, goal, refusals, progress)
    measured_settings = [
        s
        for s in dict.fromkeys(shots.settings)
        if s.plate == space.plate and s.tank_pressure_pa is not None
    ]
    result = search(searcher, space, measured_settings, effort)
    best = result.best
    ranked = proposals(
        best, learned, goal, rng, outside=outside([c.setting for c in best]), draws=draws
    )
    kept = [p for p in ranked if extrapolate or not p.outside] or ranked
    # ranks are of rounded probabilities: what meets the goal goes before what nearly does
    kept = sorted(kept, key=lambda proposal: proposal.probability_met < at_least)
    stay = {id(proposal) for proposal in kept}
    apart = [p for p in ranked if id(p) not in stay]
    normals = rng.standard_normal((draws, goal.frequency_hz.size))
    evidence = Evidence(searcher, space, result, kept, apart, len(shots), at_least, normals)
    avoid = tuple(settings_to_avoid(apart, kept, result.refused, goal))
    different = tuple(distinct(kept))
    return Tuned(
        different,
        avoid,
        learned,
        attainability(evidence, rng),
        choices(different, shots.settings, shots.level_db, MOST_CHOICES),
    )


def learn(
    forward: Forward,
    goal: Goal,
    shots: FiredShots,
    rng: np.random.Generator,
    space: TuningSpace,
    *,
    calibrated: bool = False,
) -> ShotCorrection:
    """The discrepancy after the shots. Few shots: stated deviations and the model's own spread;
    many: fitted ones.

    Of a calibrated model without more shots, nothing but the model's own spread and what a shot has
    for itself.

    Parameters:
        forward: The model that predicts the spectra.
        goal: The prescribed spectrum.
        shots: Shots that have been fired, possibly none.
        rng: Generator of the model's draws.
        space: The settings that there are.
        calibrated: Whether the model has learned from shots itself; by default it has not.
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
    """The prior with the forward model's own spread where it comes nearest to the goal.

    Parameters:
        prior: The discrepancy before any shot.
        forward: The model that predicts the spectra.
        goal: The prescribed spectrum.
        rng: Generator of the model's draws.
        space: The settings that there are.
    """
    coarse = space.grid(4, 2)
    coarse = coarse[:: max(1, len(coarse) // 256)]
    apart = np.mean((level_db(forward.spectra(coarse)) - goal.level_db) ** 2, axis=1)
    nearest = [coarse[i] for i in np.argsort(apart)[:_SPREAD_SETTINGS]]
    return prior.with_spread(level_db(forward.draws(nearest, _SPREAD_DRAWS, rng)))
