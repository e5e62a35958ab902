"""How likely a setting is to give the prescribed spectrum: all lines together, by draws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...array_types import Floats
from ..discrepancy.shot_correction import ShotCorrection
from ..setting import Setting
from .goal import Goal
from .search import Candidate

#: A share that shows how much of the spectrum is met where not every line is.
NEARLY_ALL = 0.95
#: Draws; a probability of one half is known to 2.5 %.
DRAWS = 400


@dataclass(frozen=True, eq=False)
class Proposal:
    """A setting and what is expected of the next shot with it.

    `probability_within`: every line within tolerance; `probability_met`: the goal's whole rule;
    `probability_95`: at least 95 % of them; `probability_overtest`: some line above its upper edge.
    `share_within` is the expected share of lines, margin and frequency are the expected spectrum's
    worst. Levels (f,) in dB re 1 m/s2 with 5 and 95 % quantiles. `outside`: what of it the model
    has not been made for. `alternatives` are settings that promise the same.
    """

    setting: Setting
    probability_within: float
    probability_met: float
    probability_95: float
    probability_overtest: float
    share_within: float
    worst_margin_db: float
    worst_frequency_hz: float
    level_db: Floats
    lower_db: Floats
    upper_db: Floats
    outside: tuple[str, ...] = ()
    alternatives: tuple[Setting, ...] = ()

    @property
    def rank(self) -> tuple[float, ...]:
        """Larger is better. Probabilities to a percent, below which draws do not tell: then the
        share, the margin."""
        met, within, nearly = (
            round(p, 2)
            for p in (self.probability_met, self.probability_within, self.probability_95)
        )
        return met, within, nearly, round(self.share_within, 3), self.worst_margin_db


def proposals(
    candidates: Sequence[Candidate],
    learned: ShotCorrection,
    goal: Goal,
    rng: np.random.Generator,
    *,
    outside: Sequence[tuple[str, ...]] | None = None,
    draws: int = DRAWS,
) -> list[Proposal]:
    """Every candidate judged, best first. All see the same draws, so that they differ by what they
    are.

    Parameters:
        candidates: n settings with the levels expected of them.
        learned: What measured shots have taught, which gives the spread of a spectrum.
        goal: The prescribed spectrum.
        rng: Generator of the draws.
        outside: For each candidate what of it the model has not been made for; by default None,
            nothing of any.
        draws: Number of random spectra; 400 by default.
    """
    normals = rng.standard_normal((draws, goal.frequency_hz.size))
    beyond = outside or [()] * len(candidates)
    judged = [
        _proposal_of(c, learned, goal, normals, o) for c, o in zip(candidates, beyond, strict=True)
    ]
    return sorted(judged, key=lambda p: p.rank, reverse=True)


def _proposal_of(
    candidate: Candidate,
    learned: ShotCorrection,
    goal: Goal,
    normals: Floats,
    outside: tuple[str, ...],
) -> Proposal:
    covariance = learned.covariance_db2(candidate.setting)
    drawn = candidate.level_db + normals @ root(covariance).T
    margins, expected = goal.margin_db(drawn), goal.margin_db(candidate.level_db)
    shares = np.mean(margins >= 0, axis=1)
    worst = int(np.argmin(expected))
    spread = 1.645 * np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return Proposal(
        setting=candidate.setting,
        probability_within=float(np.mean(np.all(margins >= 0, axis=1))),
        probability_met=float(np.mean(goal.met(drawn))),
        probability_95=float(np.mean(shares >= NEARLY_ALL)),
        probability_overtest=float(np.mean(np.any(drawn - goal.level_db > goal.upper_db, axis=1))),
        share_within=float(np.mean(shares)),
        worst_margin_db=float(expected[worst]),
        worst_frequency_hz=float(goal.frequency_hz[worst]),
        level_db=candidate.level_db,
        lower_db=candidate.level_db - spread,
        upper_db=candidate.level_db + spread,
        outside=outside,
    )


def probability_met(level_db: Floats, covariance_db2: Floats, goal: Goal, normals: Floats) -> float:
    """The probability that the goal's whole rule is met, by draws.

    Parameters:
        level_db: Expected levels (f,) of the spectrum, dB re 1 m/s2.
        covariance_db2: Their covariance (f, f), dB2.
        goal: The prescribed spectrum.
        normals: Standard normal numbers (d, f) of d draws.
    """
    return float(np.mean(goal.met(level_db + normals @ root(covariance_db2).T)))


def root(covariance: Floats) -> Floats:
    """A square root (f, f) of a covariance that may be singular to rounding: by eigenvalues,
    negative ones as 0.

    Parameters:
        covariance: The covariance (f, f), symmetric.
    """
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))
