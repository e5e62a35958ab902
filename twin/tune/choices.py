"""Settings to choose from: the best one, and others that are better than it at something else.

The best setting meets the goal with the largest probability. A laboratory may prefer another one
that is nearly as likely: with more margin at its worst line, surer, repeated already, near to what
was fired, or quicker to set up. A setting that is better at nothing is no choice.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from ...array_types import Floats
from ..setting import Setting
from .probability import Proposal
from .space import MASS_STEP_KG, set_alike, unlike

#: What a setting can be better at.
Merit = Literal["margin", "certainty", "repeatability", "measured", "effort"]
MERITS: tuple[Merit, ...] = ("margin", "certainty", "repeatability", "measured", "effort")
#: Below so much (dB) margins and bands are alike: a table shows no more.
_ALIKE_DB = 0.1
#: A choice has so much of the best one's probability at least; where that is less than a per cent,
#: draws tell nothing, and a choice has at most so much less margin (dB).
_LEAST_SHARE, _LEAST_PROBABILITY, _LESS_MARGIN_DB = 0.5, 0.01, 3.0


@dataclass(frozen=True)
class Merits:
    """What speaks for a setting beside its probability.

    `margin_db` is the distance of its worst expected line from the edge of the tolerance (negative
    outside, infinite where no edge is near), `band_db` half of its 90 % band, the mean over the
    lines. `scatter_db` is the standard deviation between measured shots at this setting, root mean
    square over the lines; None where it was not fired twice. `shots` counts the measured shots with
    the same parts and bullet. `changes` counts what must be changed of the set-up of the shot that
    was fired last (of the best setting's, where none was): tip, tip radius, anvil, insulator,
    position, bullet.
    """

    margin_db: float
    band_db: float
    scatter_db: float | None
    shots: int
    changes: int


@dataclass(frozen=True, eq=False)
class Choice:
    """A proposal with its merits, and what it is `better_at` than the first choice (nothing of the
    first one itself)."""

    proposal: Proposal
    merits: Merits
    better_at: tuple[Merit, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Plain data; an infinite margin is None."""
        merits = asdict(self.merits)
        margin = self.merits.margin_db
        merits["margin_db"] = margin if math.isfinite(margin) else None
        return {"merits": merits, "better_at": list(self.better_at)}


def choices(
    ranked: Sequence[Proposal], fired: Sequence[Setting], fired_level_db: Floats, most: int
) -> tuple[Choice, ...]:
    """The best proposal, and of the others those that are better at something, best first.

    Of each merit the likeliest proposal that has more of it, and the one that has the most of it.

    Parameters:
        ranked: Proposals that differ, best first.
        fired: Measured shots, in the order in which they were fired.
        fired_level_db: Their levels (n, f), dB re 1 m/s2.
        most: So many choices at most.
    """
    if not ranked:
        return ()
    mounted = fired[-1] if fired else ranked[0].setting
    judged = [
        Choice(proposal, _merits(proposal, fired, fired_level_db, mounted)) for proposal in ranked
    ]
    first, *others = judged
    rivals = [
        Choice(own.proposal, own.merits, better)
        for own in others
        if _is_near(own.proposal, first.proposal)
        and (better := _better_at(own.merits, first.merits))
    ]
    chosen_rows: set[int] = set()
    for merit in MERITS:
        having = [place for place, own in enumerate(rivals) if merit in own.better_at]
        if having:
            chosen_rows |= {
                having[0],
                max(having, key=lambda place: _amount(rivals[place].merits, merit)),
            }
    return (first, *[rivals[place] for place in sorted(chosen_rows)][: most - 1])


def _merits(
    proposal: Proposal, fired: Sequence[Setting], fired_level_db: Floats, mounted: Setting
) -> Merits:
    own = proposal.setting
    rows = [row for row, shot in enumerate(fired) if _is_same(own, shot)]
    same_parts = sum(not _changes(own, shot) for shot in fired)
    scatter = None
    if len(rows) > 1:
        scatter = float(np.sqrt(np.mean(np.var(fired_level_db[rows], axis=0, ddof=1))))
    return Merits(
        margin_db=proposal.worst_margin_db,
        band_db=float(np.mean(proposal.upper_db - proposal.lower_db)) / 2,
        scatter_db=scatter,
        shots=same_parts,
        changes=_changes(own, mounted),
    )


def _changes(first: Setting, second: Setting) -> int:
    """Parts and bullets that differ: what is done by hand. A pressure is set at the regulator."""
    bullets = abs(first.impactor_mass_kg - second.impactor_mass_kg) > MASS_STEP_KG * (1 + 1e-9)
    return unlike(first, second) + bullets


def _is_same(first: Setting, second: Setting) -> bool:
    """Whether two settings cannot be told apart at the bench."""
    return first.plate == second.plate and set_alike(first, second)


def _is_near(proposal: Proposal, best: Proposal) -> bool:
    """Whether it is likely enough beside the best one to be chosen."""
    if best.probability_met < _LEAST_PROBABILITY:
        return proposal.worst_margin_db >= best.worst_margin_db - _LESS_MARGIN_DB
    return proposal.probability_met >= _LEAST_SHARE * best.probability_met


def _amount(merits: Merits, merit: Merit) -> float:
    """The larger, the better; an unknown scatter is the worst."""
    return {
        "margin": merits.margin_db,
        "certainty": -merits.band_db,
        "repeatability": -math.inf if merits.scatter_db is None else -merits.scatter_db,
        "measured": float(merits.shots),
        "effort": -float(merits.changes),
    }[merit]


def _better_at(own: Merits, first: Merits) -> tuple[Merit, ...]:
    return tuple(
        merit
        for merit in MERITS
        if _amount(own, merit)
        > _amount(first, merit)
        + (_ALIKE_DB if merit in ("margin", "certainty", "repeatability") else 0.0)
    )
