"""A wrong unit of a whole campaign: the impulses of most impacts are off by one known factor (lbf
as N, a gain).

Impulse over mass times velocity is between 1 and 2 for what flies free, and up to 3 for a hammer in
a hand (`plausibility`). A velocity that is integrated from the impactor's own deceleration is that
of the contact alone, .32 to .82 of the impact's: 168 impacts of correct virtual campaigns have
ratios of 1.8 to 4.2 by it. Cells behind an anvil show up to twice the impulse.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .channel_mistakes import unit_mistakes
from .errors import IngestError

#: The rule that a laboratory confirms where its unit is right all the same.
RULE = "unit-factor"
#: Ratios of correct campaigns by velocities that are reported or measured, and by integrated ones.
USUAL, USUAL_ANVIL, USUAL_INTEGRATED = (0.5, 3.0), (0.5, 4.6), (1.0, 7.0)
#: No contact of an impact lasts so long, and none is as short as the other (s): the sampling rate
#: is another one.
LONGEST_CONTACT_S, SHORTEST_CONTACT_S = 0.1, 4e-6
#: So many impacts are judged, so large a share of them must be off, and so large a share right with
#: the factor.
LEAST_IMPACTS, OFF_SHARE, RIGHT_SHARE = 3, 2 / 3, 0.9
#: So many impacts are held back before the first of them is stored.
ENOUGH_IMPACTS = 12


@dataclass(frozen=True)
class MomentumRatio:
    """Impulse over mass times velocity of one impact; `integrated`: by the impactor's own
    acceleration.

    `share`: of the plate's mass in both masses, by which a light plate lowers the ratio.
    `behind_anvil`: the force is measured behind an anvil. `by_laser`: the velocity is the bullet's
    length over the time in the laser's beam.
    """

    ratio: float
    integrated: bool
    share: float = 1.0
    behind_anvil: bool = False
    by_laser: bool = False

    def is_usual(self, factor: float = 1.0) -> bool:
        """Whether the ratio is that of a correct campaign once its readings are divided by
        `factor`."""
        low, high = (
            USUAL_INTEGRATED if self.integrated else USUAL_ANVIL if self.behind_anvil else USUAL
        )
        return low * self.share <= self.ratio / factor <= high


def refuse_wrong_unit(campaign: str, ratios: Sequence[MomentumRatio]) -> None:
    """Raise `IngestError` where most `ratios` of a campaign are off, and one known factor explains
    them."""
    off = [ratio for ratio in ratios if not ratio.is_usual()]
    if len(ratios) < LEAST_IMPACTS or len(off) < OFF_SHARE * len(ratios):
        return
    fitting = [
        (factor, words)
        for factor, words in _mistakes(ratios)
        if sum(ratio.is_usual(factor) for ratio in ratios) >= RIGHT_SHARE * len(ratios)
    ]
    if not fitting:
        return
    middle = sorted(ratio.ratio for ratio in ratios)[len(ratios) // 2]
    usual = 2.0 if ratios[0].integrated else 1.4
    fitting.sort(key=lambda mistake: max(middle / mistake[0] / usual, usual * mistake[0] / middle))
    factor, words = fitting[0]
    others = "; ".join(dict.fromkeys(f"{text} ({value:.4g})" for value, text in fitting[1:4]))
    raise IngestError(
        f"{campaign}: impulses are {middle:.3g} times mass times velocity in "
        f"the median of {len(ratios)} impacts, "
        f"{len(off)} of which are impossible; a factor of {factor:.4g} explains them: {words}"
        + (f"; or {others}" if others else "")
        + ". Correct unit or sensitivity of the channel in campaign.toml (or mass and velocity in "
        f"runs.csv); where all are right, confirm it with --confirm {RULE} or with confirmed = "
        f'["{RULE}"] in [bench] of campaign.toml'
    )


def refuse_wrong_clock(campaign: str, contact_times_s: Sequence[float]) -> None:
    """Raise `IngestError` where most contacts of a campaign are a thousand times too long or too
    short."""
    if len(contact_times_s) < LEAST_IMPACTS:
        return
    middle = sorted(contact_times_s)[len(contact_times_s) // 2]
    if SHORTEST_CONTACT_S <= middle <= LONGEST_CONTACT_S:
        return
    slow = middle > LONGEST_CONTACT_S  # the sampling rate reads too low
    factor, words = next(
        mistake for mistake in unit_mistakes("clock") if (mistake[0] < 1.0) == slow
    )
    raise IngestError(
        f"{campaign}: contacts last {middle:.3g} s in the median of {len(contact_times_s)} "
        f"impacts, which no impact does; a factor of {1.0 / factor:.4g} explains it: sampling "
        f"rate: {words}, or times in {'ms where s' if slow else 's where ms'} is declared. Correct "
        "the sampling rate or the unit of the time in the recordings or in campaign.toml; where it "
        f'is right, confirm it with --confirm {RULE} or with confirmed = ["{RULE}"] in [bench] of '
        "campaign.toml"
    )


def _mistakes(ratios: Sequence[MomentumRatio]) -> list[tuple[float, str]]:
    """Factors on the ratio, each with the mistake that makes it."""
    mistakes = [(factor, f"force: {words}") for factor, words in unit_mistakes("force")]
    if any(ratio.integrated for ratio in ratios):
        quantity, name = "acceleration", "acceleration of the impactor"
    elif any(ratio.by_laser for ratio in ratios):
        mistakes.insert(0, (1e3, "bullet length: values in m where mm is declared"))
        quantity, name = "velocity", "velocity by the laser"
    else:
        quantity, name = "velocity", "impact velocity"
    mistakes += [(1.0 / factor, f"{name}: {words}") for factor, words in unit_mistakes(quantity)]
    mistakes += [
        (1e-3, "mass: values in g where kg is declared"),
        (1e3, "mass: values in kg where g is declared"),
    ]
    return mistakes
