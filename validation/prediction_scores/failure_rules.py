"""Where predictions fail, as rules of one or two settings: "tip_material = polyurethane and
tank_pressure > 3 bar".

All rules of one or two conditions are candidates. A rule is kept only where it deviates more than
the best of all candidates would in 95 of 100 random orders of the configurations, so that many
candidates do not make a rule out of chance (maximum statistic: Westfall and Young, Resampling-Based
Multiple Testing, 1993, section 2.3).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats, Mask
from ...training.evaluation.summary import clustered, sign_flip_p
from .quantity_score import Measure

EVERYWHERE = "all shots"
#: The share of campaigns without a failure in which some rule is named.
_ERROR_RATE = 0.05
_PERMUTATIONS = 999
#: Configurations that a rule must hold, and must leave.
_LEAST_CONFIGURATIONS = 3
#: Values at which a number is cut: more cuts only add candidates that hardly differ.
_MOST_CUTS = 6
#: Smaller means of measured over predicted are of no use to name, in the unit of the measure.
_SMALLEST = {"ln": 0.05, "dB": 0.5}


@dataclass(frozen=True, eq=False)
class ShotFactor:
    """A setting of n shots, words or numbers (n,). `shown` is what a number is multiplied by to be
    told in `unit`."""

    name: str
    values: NDArray[Any]
    unit: str = ""
    shown: float = 1.0


@dataclass(frozen=True)
class PredictionFailure:
    """Shots of `rule` are predicted wrong by `bias`: the share by which the prediction exceeds the
    measured value."""

    rule: str
    measure: Measure
    bias: float
    shots: int
    p_value: float

    @property
    def sentence(self) -> str:
        """ "tip material = polyurethane: the peak force is predicted 35 % too low"."""
        side = "low" if self.bias < 0 else "high"
        size = f"{100 * abs(self.bias):.0f} %"
        if self.measure.unit != "ln":
            size = self.measure.error_words(20 / np.log(10) * np.abs(np.log1p(self.bias)))
        rule = _FACTOR.sub(lambda name: name[0].replace("_", " "), self.rule)
        return f"{rule}: the {self.measure.words} is predicted {size} too {side}"

    def as_json(self) -> dict[str, Any]:
        return {
            "rule": self.rule,
            "quantity": self.measure.name,
            "bias": self.bias,
            "shots": self.shots,
            "p_value": self.p_value,
            "sentence": self.sentence,
        }


#: The name of a factor in a rule, before what is said of it.
_FACTOR = re.compile(r"\b\w+(?= (?:=|<|>|other than) )")


@dataclass(frozen=True, eq=False)
class _Rule:
    words: str
    shots: Mask


def failures(
    measure: Measure,
    residual: Floats,
    configuration: NDArray[np.intp],
    factors: Sequence[ShotFactor],
    rng: np.random.Generator,
) -> list[PredictionFailure]:
    """At most two: that all shots deviate to one side, and the rule whose shots deviate most from
    the rest.

    `residual` (n,) is measured less predicted, one value a shot. Configurations, not shots, are
    independent: means over the shots of a configuration are tested.
    """
    groups = clustered(residual[:, None], configuration)
    means = groups.sums[:, 0] / groups.sizes
    members = np.unique(configuration, return_inverse=True)[1]
    named = []
    if len(groups) > 1:
        p_value = float(sign_flip_p(clustered(means[:, None], np.arange(len(means))), rng)[0])
        if p_value <= _ERROR_RATE and abs(means.mean()) >= _SMALLEST[measure.unit]:
            named.append(_failure(measure, EVERYWHERE, means.mean(), len(residual), p_value))
    rules = list(_rules(factors, members, len(means)))
    return named + ([] if not rules else _strongest(measure, means, members, rules, rng))


def _failure(
    measure: Measure, rule: str, residual: float, shots: int, p_value: float
) -> PredictionFailure:
    return PredictionFailure(rule, measure, measure.share(-float(residual)), shots, p_value)


def _strongest(
    measure: Measure,
    means: Floats,
    members: NDArray[np.intp],
    rules: Sequence[_Rule],
    rng: np.random.Generator,
) -> list[PredictionFailure]:
    """The rule of the largest contrast, where chance seldom gives one as large to any rule."""
    inside = np.array(
        [np.bincount(members, rule.shots, len(means)) > 0 for rule in rules], dtype=np.float64
    )
    contrast = _contrasts(inside, means[:, None])[:, 0]
    mean = inside @ means / inside.sum(axis=1)
    # A rule and its complement have the same contrast; the side that deviates more from 0 is the
    # failure.
    order = np.lexsort((np.abs(mean), np.round(np.abs(contrast), 9)))
    best = int(order[-1])
    shuffled = rng.permuted(np.tile(means[:, None], _PERMUTATIONS), axis=0)
    largest = np.abs(_contrasts(inside, shuffled)).max(axis=0)
    p_value = (1 + int((largest >= np.abs(contrast[best]) * (1 - 1e-9)).sum())) / (
        1 + _PERMUTATIONS
    )
    if p_value > _ERROR_RATE or abs(mean[best]) < _SMALLEST[measure.unit]:
        return []
    return [_failure(measure, rules[best].words, mean[best], int(rules[best].shots.sum()), p_value)]


def _contrasts(inside: Floats, values: Floats) -> Floats:
    """Two-sample t of each rule (r x k) on values (k x b): mean inside less mean outside, over its
    standard error."""
    count, total = inside.sum(axis=1, keepdims=True), inside.shape[1]
    sums, squares = inside @ values, inside @ values**2
    rest, rest_squares = values.sum(axis=0) - sums, (values**2).sum(axis=0) - squares
    spread = squares - sums**2 / count + rest_squares - rest**2 / (total - count)
    variance = np.maximum(spread, 1e-12 * (values**2).sum(axis=0)) / max(total - 2, 1)
    return np.asarray(
        (sums / count - rest / (total - count))
        / np.sqrt(variance * (1 / count + 1 / (total - count)))
    )


def _rules(
    factors: Sequence[ShotFactor], members: NDArray[np.intp], configurations: int
) -> Iterator[_Rule]:
    """Rules of one condition, then of two of different factors, that hold and leave enough
    configurations."""
    groups: set[bytes] = set()
    conditions = {factor.name: list(_conditions(factor)) for factor in factors}
    singles = [rule for rules in conditions.values() for rule in rules]
    for rule in (*singles, *_pairs(conditions)):
        inside = np.bincount(members, rule.shots, configurations) > 0
        whole = np.array_equal(inside[members], rule.shots)
        size = int(inside.sum())
        enough = _LEAST_CONFIGURATIONS <= size <= configurations - _LEAST_CONFIGURATIONS
        if whole and enough and inside.tobytes() not in groups:
            groups.add(inside.tobytes())
            yield rule


def _pairs(conditions: Mapping[str, Sequence[_Rule]]) -> Iterator[_Rule]:
    for first, second in combinations(conditions.values(), 2):
        for condition in first:
            for other in second:
                yield _Rule(f"{condition.words} and {other.words}", condition.shots & other.shots)


def _conditions(factor: ShotFactor) -> Iterator[_Rule]:
    if factor.values.dtype.kind in "OUS":
        yield from _of_words(factor)
        return
    levels = np.unique(factor.values)
    cuts = (levels[1:] + levels[:-1]) / 2
    if len(cuts) > _MOST_CUTS:
        cuts = np.quantile(factor.values, np.arange(1, _MOST_CUTS + 1) / (_MOST_CUTS + 1))
    for cut in cuts.tolist():
        shown = f"{cut * factor.shown:.3g} {factor.unit}".rstrip()
        yield _Rule(f"{factor.name} > {shown}", factor.values > cut)
        yield _Rule(f"{factor.name} < {shown}", factor.values <= cut)


def _of_words(factor: ShotFactor) -> Iterator[_Rule]:
    levels = sorted(set(factor.values.tolist()))
    for level in levels:
        yield _Rule(f"{factor.name} = {level}", factor.values == level)
    for level in levels if len(levels) > 2 else ():
        yield _Rule(f"{factor.name} other than {level}", factor.values != level)
