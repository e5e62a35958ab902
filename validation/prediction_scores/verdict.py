"""What the scores come to, in one sentence for a person."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .quantity_score import QuantityScore

NOMINAL = 0.90
#: Below this lower end of the interval of a coverage too few shots are there to speak of it.
_VAGUE = 0.75


@dataclass(frozen=True)
class PredictionVerdict:
    """`calibrated` is False where a 90 % band holds so few of the measured values that chance does not explain it.

    Bands that are too wide are no danger to a user: the sentence says so, and `calibrated` stays True. So it does where
    the shots are too few to judge.
    """

    sentence: str
    calibrated: bool


def verdict(scores: Sequence[QuantityScore]) -> PredictionVerdict:
    """Of all quantities together. Each coverage has a 95 % interval that is shared among the quantities (Bonferroni),
    so that a calibrated twin is called so in 95 of 100 campaigns. Raises `ValueError` without a quantity.
    """
    if not scores:
        raise ValueError("no quantity was measured in any shot: there is nothing to compare with the predictions")
    intervals = [score.coverage90.interval(len(scores)) for score in scores]
    narrow = [score for score, (_, high) in zip(scores, intervals, strict=True) if high < NOMINAL]
    wide = [score for score, (low, _) in zip(scores, intervals, strict=True) if low > NOMINAL]
    if narrow:
        return PredictionVerdict(
            f"Not calibrated: the 90 % bands hold only {_listed(narrow)}. {_errors(scores)}", calibrated=False
        )
    if max(low for low, _ in intervals) < _VAGUE:
        held = f"Too little to judge the 90 % bands, {_size(scores)}: inside lie {_listed(scores)}"
    elif wide:
        held = f"The 90 % bands hold, and some are wider than needed: inside lie {_listed(wide)}"
    else:
        held = f"The 90 % bands hold: {_range(scores)} of the measured values lie inside, in {_size(scores)}"
    return PredictionVerdict(f"{held}. {_errors(scores)}", calibrated=True)


def _listed(scores: Sequence[QuantityScore]) -> str:
    """Coverage of each quantity, those of the same share together."""
    words: dict[str, list[str]] = {}
    for score in sorted(scores, key=lambda score: score.coverage90.share):
        words.setdefault(f"{100 * score.coverage90.share:.0f} %", []).append(score.measure.words)
    parts = [f"{share} of the measured values of {' and '.join(names)}" for share, names in words.items()]
    return ", ".join(parts)


def _range(scores: Sequence[QuantityScore]) -> str:
    shares = sorted(100 * score.coverage90.share for score in scores)
    ends = dict.fromkeys(f"{share:.0f}" for share in (shares[0], shares[-1]))
    return f"{' to '.join(ends)} %"


def _size(scores: Sequence[QuantityScore]) -> str:
    shots = max(score.shots for score in scores)
    configurations = max(score.coverage90.configurations for score in scores)
    return f"{shots} shot{'s' * (shots > 1)} of {configurations} configuration{'s' * (configurations > 1)}"


def _errors(scores: Sequence[QuantityScore]) -> str:
    """The median error of the quantity that is predicted worst for each unit."""
    worst = {score.measure.unit: score for score in sorted(scores, key=lambda score: score.median_abs_error)}
    parts = [f"the {s.measure.words} is off by {s.measure.error_words(s.median_abs_error)}" for s in worst.values()]
    sentence = " and ".join(parts)
    return f"{sentence[0].upper()}{sentence[1:]} in the median."
