"""The rule by which a model is put in use: its bands hold on unseen configurations, and it beats
what is in use.

1. Fewer than `LEAST_CONFIGURATIONS` configurations judge nothing: of fewer than ten, a 90 % band
   must hold all.
2. The share of pulses inside the 90 % band is taken for peak force, contact time and impulse, with
   its interval of 90 % by whole configurations (`summary.share_interval`). A band holds where the
   share is `NARROWEST` at least and the interval reaches below `WIDEST`; it fails where the
   interval lies outside of the range. A share below the range whose interval reaches into it is not
   enough to judge.
3. The mean CRPS must be lower than that of the reference, with p < 0.05 over configurations: in the
   two-sided sign-flip test, where n configurations give no p below 2^(1 - n), and in the t-test
   that allows for the luck of what each model learned from (`summary.corrected_p`).
4. A force error of `NOT_USABLE` times what the bench repeats to is no prediction, nor one of more
   than `LARGEST_ERROR`, nor one whose interval of 90 % is above the error of the mean of the pulses
   that the model learned from.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from .comparison import LEVEL
from .summary import clustered, least_p_value, share_interval
from .unseen_scores import QUANTITIES, UnseenScores

#: What answers without a model, in words.
UPDATED_LAW = "the contact law updated by the measured shots"

#: What a decision says: the first that applies, in the order of `judge`.
Verdict = Literal[
    "promoted",
    "not usable",
    "not enough to judge",
    "worse",
    "bands do not hold",
    "may be chance",
    "forced",
    "",
]
LEAST_CONFIGURATIONS = 10
NARROWEST, WIDEST = 0.85, 0.97
#: Errors over the repeatability of the bench, from which on a model is not usable.
NOT_USABLE = 10.0
#: Share of the measured force from which on an error is larger than the force.
LARGEST_ERROR = 1.0


@dataclass(frozen=True)
class BandCheck:
    """Of one quantity: the share of pulses inside the 90 % band, and its interval of 90 % by
    configurations."""

    quantity: str
    share: float
    low: float
    high: float

    @property
    def fails(self) -> bool:
        """Whether the share is outside of the range beyond the uncertainty of its count."""
        return self.high < NARROWEST or self.low > WIDEST

    @property
    def holds(self) -> bool:
        """Whether it is in the range, or above it by no more than its count leaves open."""
        return self.share >= NARROWEST and not self.fails

    def __str__(self) -> str:
        return f"{self.quantity} {self.share:.0%} ({self.low:.0%} to {self.high:.0%})"


@dataclass(frozen=True)
class GateVerdict:
    """A verdict and the sentence that explains it."""

    verdict: Verdict
    reason: str

    @property
    def promoted(self) -> bool:
        return self.verdict == "promoted"


def band_checks(scores: UnseenScores, place: int = 0) -> tuple[BandCheck, ...]:
    """Of the candidate's bands, or of those of another place among the predictions."""
    clusters = clustered(scores.inside[place].astype(float), scores.configuration)
    ends = zip(
        QUANTITIES,
        clusters.mean.tolist(),
        *(end.tolist() for end in share_interval(clusters)),
        strict=True,
    )
    return tuple(BandCheck(*values) for values in ends)


def coverage_figures(scores: UnseenScores) -> dict[str, float]:
    """By metric names that MLflow takes: "coverage90.candidate.peak_force", with ".low" and
    ".high"."""
    figures: dict[str, float] = {}
    for place, name in enumerate(("candidate", "reference", "prior")[: len(scores.names)]):
        for check in band_checks(scores, place):
            key = f"coverage90.{name}.{check.quantity.replace(' ', '_')}"
            figures |= {key: check.share, f"{key}.low": check.low, f"{key}.high": check.high}
    return figures


def too_few(configurations: int) -> str:
    """Why so many configurations judge nothing; empty where they are enough."""
    if configurations >= LEAST_CONFIGURATIONS:
        return ""
    return (
        f"{configurations} configurations are not enough to judge a model: {LEAST_CONFIGURATIONS} "
        f"at least are needed (with {configurations}, no p-value is below "
        f"{least_p_value(configurations):.2g} and no 90 % band can be checked); measure further "
        "configurations, or judge on another campaign (--on)"
    )


def judge(scores: UnseenScores, p_value: float) -> GateVerdict:
    """The verdict on the first prediction of `scores`, judged against the second."""
    if few := too_few(scores.configurations):
        return GateVerdict("not enough to judge", few)
    checks = band_checks(scores)
    words = comparison_words(scores, p_value)
    bands = ", ".join(map(str, checks))
    if not scores.first_is_better:
        return GateVerdict("worse", words)
    if any(check.fails for check in checks):
        failed = " and ".join(check.quantity for check in checks if check.fails)
        reason = (
            f"the 90 % bands of {scores.names[0]} do not hold for {failed} on "
            f"configurations that they were not "
            f"calibrated by: inside are {bands}, expected {NARROWEST:.0%} to {WIDEST:.0%}"
        )
        return GateVerdict("bands do not hold", f"{reason}; {words}")
    if p_value >= LEVEL:
        return GateVerdict(
            "may be chance", f"{words}; a model is put in use only where it is better beyond chance"
        )
    if not all(check.holds for check in checks):
        reason = (
            f"{scores.configurations} configurations are not enough to judge the 90 % bands of "
            f"{scores.names[0]}: inside are {bands}, expected {NARROWEST:.0%} to {WIDEST:.0%}; "
            "measure further configurations"
        )
        return GateVerdict("not enough to judge", f"{reason}; {words}")
    return GateVerdict("promoted", f"{words}; inside its 90 % bands are {bands}")


def comparison_words(scores: UnseenScores, p_value: float) -> str:
    """Which predicts better, by how much, and how sure that is."""
    places = (0, 1) if scores.first_is_better else (1, 0)
    better, worse = (scores.names[place] for place in places)
    means = [scores.means[place] for place in places]
    parts = [
        f"{quantity} {scores.crps[places[0]][:, i].mean():.3f} against "
        f"{scores.crps[places[1]][:, i].mean():.3f}"
        for i, quantity in enumerate(QUANTITIES)
    ]
    sure = "" if p_value < LEVEL else ", which may be chance"
    without = "without a model " if better == UPDATED_LAW else ""
    return (
        f"{without}{better} predicts unseen configurations better than {worse}: "
        f"mean CRPS {means[0]:.3f} against {means[1]:.3f} "
        f"({', '.join(parts)}; p = {p_value:.2g} over {scores.configurations} configurations{sure})"
    )


#: Which limit of usability an error is above.
UsabilityRule = Literal["larger than the force", "worse than the mean", "far above repeatability"]
#: What the limit of each rule is.
LIMIT_WORDS: dict[UsabilityRule, str] = {
    "larger than the force": "the force itself",
    "worse than the mean": "the error of the mean of the pulses that it learned from",
    "far above repeatability": "ten times what repeated impacts differ by",
}


@dataclass(frozen=True)
class Unusable:
    """Why a version is no prediction: its force `error` on a split is at or above the `limit`."""

    label: str
    split: str
    error: float
    limit: float
    rule: UsabilityRule

    def __str__(self) -> str:
        return (
            f"{self.label} is not usable: its force error on the split {self.split} is "
            f"{_percent(self.error)}, above {_percent(self.limit)}, {LIMIT_WORDS[self.rule]}"
        )


def _percent(share: float) -> str:
    return f"{float(f'{100 * share:.3g}'):g} %"


def find_unusable(
    label: str,
    split: str,
    error: float,
    low: float | None,
    repeatability: float | None,
    of_mean: float | None,
) -> Unusable | None:
    """Why a version is no prediction on a split, from its force error with the `low` end of its
    interval, what repeated impacts differ by, and the error of the mean pulse; None where it is
    one. It is worse than the mean pulse where its whole interval is."""
    if error > LARGEST_ERROR:
        return Unusable(label, split, error, LARGEST_ERROR, "larger than the force")
    if of_mean is not None and low is not None and error >= low > of_mean:
        return Unusable(label, split, error, of_mean, "worse than the mean")
    if repeatability is not None and error >= NOT_USABLE * repeatability > 0:
        return Unusable(label, split, error, NOT_USABLE * repeatability, "far above repeatability")
    return None
