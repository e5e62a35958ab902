"""The search: a coarse grid over everything, then pressure and mass of the best mounts more
finely."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ...array_types import Floats
from ..discrepancy.shot_correction import ShotCorrection
from ..setting import Setting
from .goal import Forward, Goal, Progress, Refusals, level_db
from .space import Mount, TuningSpace, mount_of

#: Settings that go to the forward model at a time.
_BATCH = 512
#: Of the settings that were fired so many are proposed again.
_FIRED = 4


@dataclass(frozen=True)
class Effort:
    """Grid of pressures and masses on every mount; how many mounts are refined, by which ratios in
    turn."""

    pressures: int = 8
    masses: int = 4
    finalists: int = 30
    ratios: tuple[float, ...] = (1.30, 1.10)


@dataclass(frozen=True, eq=False)
class Candidate:
    """A setting with the levels (f,) in dB expected of it, and how promising it is (0 at best)."""

    setting: Setting
    level_db: Floats
    score: float
    refused: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Searcher:
    """What a search asks: the model, what shots have taught, the goal, the bench."""

    forward: Forward
    learned: ShotCorrection
    goal: Goal
    refusals: Refusals
    progress: Progress | None = None

    def candidates(self, settings: Sequence[Setting], what: str = "settings") -> list[Candidate]:
        """One candidate for each setting, in order.

        Parameters:
            settings: n settings of the bench.
            what: What `progress` calls them; "settings" by default.
        """
        levels = self.expected_db(settings, what)
        scores = self._scores(levels, settings)
        refused = self.refusals(settings)
        return [
            Candidate(*parts)
            for parts in zip(settings, levels, scores.tolist(), refused, strict=True)
        ]

    def expected_db(self, settings: Sequence[Setting], what: str = "settings") -> Floats:
        """Expected levels (n, f), dB re 1 m/s2: those of the model, corrected by what shots have
        taught.

        Parameters:
            settings: n settings of the bench, one or more.
            what: What `progress` calls them; "settings" by default.
        """
        parts = []
        for first in range(0, len(settings), _BATCH):
            batch = settings[first : first + _BATCH]
            parts.append(level_db(self.forward.spectra(batch)) + self.learned.mean_db(batch))
            if self.progress:
                self.progress(min(first + _BATCH, len(settings)), len(settings), what)
        return np.concatenate(parts)

    def nearness(self, candidate: Candidate) -> tuple[int, float]:
        """How many lines keep to the rules of the goal, and the margin of the worst in dB.

        Parameters:
            candidate: A setting with the levels expected of it.
        """
        results = self.goal.results(candidate.level_db)
        margins = self.goal.margin_db(candidate.level_db)
        return sum(int(result.lines) for result in results), float(margins.min())

    def _scores(self, levels: Floats, settings: Sequence[Setting]) -> Floats:
        """Mean over lines of the logarithm of a line's probability, as if all settings were as sure
        as the nearest; and that of the lowest of the lines that must lie at the level or above
        it."""
        nearest = settings[int(np.argmin(np.mean((levels - self.goal.level_db) ** 2, axis=1)))]
        spread = np.sqrt(np.diag(self.learned.covariance_db2(nearest)))
        error = levels - self.goal.level_db
        scores = line_scores(error, spread, self.goal).mean(axis=1)
        if above := self.goal.rule.required_above(error.shape[1]):
            from scipy.special import log_ndtr

            scores = scores + log_ndtr(np.sort(error, axis=1)[:, -above] / np.median(spread))
        return np.asarray(scores)


def line_scores(error_db: Floats, spread_db: Floats, goal: Goal) -> Floats:
    """Logarithm of the probability that a line lies within, (n, f), of normal errors.

    Computed in the tail where both edges lie on one side, so that far misses still tell better from
    worse.

    Parameters:
        error_db: Expected levels above those of the goal (n, f), dB.
        spread_db: Standard deviations of the lines (f,), dB.
        goal: The prescribed spectrum.
    """
    from scipy.special import log_ndtr

    high, low = (goal.upper_db - error_db) / spread_db, (-goal.lower_db - error_db) / spread_db
    swap = low > 0
    near, far = np.where(swap, -low, high), np.where(swap, -high, low)
    top, bottom = log_ndtr(near), log_ndtr(far)
    return np.asarray(top + np.log1p(-np.exp(np.minimum(bottom - top, -1e-12))))


@dataclass(frozen=True, eq=False)
class SearchResult:
    """The best allowed candidate of each of the best mounts and of each mass and the best of those
    that were fired already, best first; the best refused one of each mount.

    `nearest` is the allowed candidate with the most lines within tolerance, of these the one whose
    worst line lies nearest, among all `examined` ones; None where the bench refuses all, and then
    `best` is empty.
    """

    best: list[Candidate]
    refused: list[Candidate]
    nearest: Candidate | None
    examined: int


def search(
    searcher: Searcher,
    space: TuningSpace,
    extra: Iterable[Setting] = (),
    effort: Effort | None = None,
) -> SearchResult:
    """Candidates of a grid over all mounts, refined about the best.

    Parameters:
        searcher: The model, what shots have taught, the goal and the bench.
        space: The settings that there are.
        extra: Settings that are looked at besides, such as those fired; none by default.
        effort: How fine the grid is, and how many mounts are refined by which ratios; by default
            `Effort()`.
    """
    effort = effort or Effort()
    grid, fired = space.grid(effort.pressures, effort.masses), list(extra)
    examined = searcher.candidates([*grid, *fired], "grid")
    fired_candidates = [c for c in examined[len(grid) :] if not c.refused]
    masses = space.impactor_mass_kg.grid(effort.masses)
    allowed = [c for c in examined if not c.refused]
    best = [
        *best_of_mounts(allowed)[: effort.finalists],
        *best_of_masses(allowed, masses),
    ]
    refused = best_of_mounts(c for c in examined if c.refused)
    for ratio in effort.ratios if best else ():
        around = [
            setting
            for candidate in _once(best)
            for setting in space.around(candidate.setting, ratio)
        ]
        finer = searcher.candidates(around, f"refined by {ratio:g}")
        together = [*best, *(c for c in finer if not c.refused)]
        best = [*best_of_mounts(together), *best_of_masses(together, masses)]
        examined += finer
    nearest = max((c for c in examined if not c.refused), key=searcher.nearness, default=None)
    best += sorted(fired_candidates, key=lambda c: -c.score)[:_FIRED]
    return SearchResult(_once(best), refused, nearest, len(examined))


def best_of_mounts(candidates: Iterable[Candidate]) -> list[Candidate]:
    """The most promising candidate of each mount, best first.

    Parameters:
        candidates: Candidates of any mounts, in any order.
    """
    best: dict[Mount, Candidate] = {}
    for candidate in sorted(candidates, key=lambda c: -c.score):
        best.setdefault(mount_of(candidate.setting), candidate)
    return list(best.values())


def best_of_masses(candidates: Iterable[Candidate], masses_kg: Floats) -> list[Candidate]:
    """The most promising candidate of each mass, best first; a mass between two counts as the
    nearer one. The best mounts may all ask for one bullet, and the laboratory choose another.

    Parameters:
        candidates: Candidates of any mounts, in any order.
        masses_kg: The masses (m,) that are told apart.
    """
    best: dict[int, Candidate] = {}
    for candidate in sorted(candidates, key=lambda c: -c.score):
        ratios = np.abs(np.log(masses_kg / candidate.setting.impactor_mass_kg))
        best.setdefault(int(np.argmin(ratios)), candidate)
    return list(best.values())


def _once(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Each setting once, the most promising first."""
    return sorted({c.setting: c for c in candidates}.values(), key=lambda c: -c.score)
