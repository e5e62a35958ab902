"""Sentences of results: a claim, the numbers that it shows, and the rule by which it may be said.

A sentence that its rule does not allow cannot be made: `Sentence` raises `UnfoundedSentenceError`.
Every number of a sentence is a `Number` of the result, written as the cells of its tables are, so
that a test finds it there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from ..common.number_format import (
    error_percent,
    number,
    percent,
    percent_range,
    percentage_points,
    times,
)
from ..common.quantities import cell, display_of

#: From this probability of chance on, a difference is not called one.
SIGNIFICANCE = 0.05


@dataclass(frozen=True)
class Number:
    """A number of a result. `key` is its column: a quantity with its SI unit at the end.

    `kind` "share" is a probability or a part of a whole, shown in whole per cent; "part" an error
    as a part of its value, with a decimal; "error" a relative error, in per cent with three digits;
    "points" a difference of two relative errors, in percentage points; "count" a whole number,
    "ratio" how many times, "size" a number without a unit.
    """

    key: str
    value: float
    kind: Literal["quantity", "share", "part", "error", "points", "count", "ratio", "size"] = (
        "quantity"
    )

    @property
    def cell(self) -> str:
        """As a cell of a table holds it, without unit."""
        match self.kind:
            case "share":
                return percent(self.value)
            case "part":
                return f"{100 * self.value:.1f} %"
            case "error":
                return error_percent(self.value)
            case "points":
                return percentage_points(self.value)
            case "ratio":
                return times(self.value)
            case "size":
                return number(self.value)
            case "count":
                return str(int(self.value))
        return cell(self.key, float(self.value))

    def __str__(self) -> str:
        unit = display_of(self.key).unit if self.kind == "quantity" else ""
        return f"{self.cell} {unit}".rstrip()


@dataclass(frozen=True)
class Interval:
    """The interval of a share, in a column of its own."""

    key: str
    low: float
    high: float

    @property
    def cell(self) -> str:
        """As a cell of a table holds it."""
        return percent_range(self.low, self.high)

    def __str__(self) -> str:
        return self.cell


@dataclass(frozen=True)
class Rule:
    """When a claim may be made: `allows` is called with the evidence by name; `words` say it."""

    name: str
    words: str
    allows: Callable[..., bool]


def _finite(*values: float) -> bool:
    return all(math.isfinite(value) for value in values)


#: What is claimed to hold a level: the interval of what was counted contains it.
HOLDS = Rule(
    "holds",
    "the interval of the share contains the stated level",
    lambda interval, level: _finite(*interval) and interval[0] <= level <= interval[1],
)
#: A band that holds too few.
TOO_NARROW = Rule(
    "too narrow",
    "the interval of the share lies below the stated level",
    lambda interval, level: _finite(*interval) and interval[1] < level,
)
#: A band that holds more than it states.
TOO_WIDE = Rule(
    "too wide",
    "the interval of the share lies above the stated level",
    lambda interval, level: _finite(*interval) and interval[0] > level,
)
#: A comparison: the first is better than the second, and not by chance.
BETTER = Rule(
    "better",
    f"the error is smaller, with a probability of chance below {SIGNIFICANCE:g} on configurations",
    lambda difference, p_value: (
        _finite(difference, p_value) and difference < 0 and p_value < SIGNIFICANCE
    ),
)
#: Two that came out alike to the last digit.
EQUAL = Rule(
    "equal",
    "there is no difference at all",
    lambda difference: difference == 0,
)
#: A comparison that chance explains.
NOT_TOLD_APART = Rule(
    "not told apart",
    f"the probability of chance is {SIGNIFICANCE:g} or more",
    lambda p_value: not math.isfinite(p_value) or p_value >= SIGNIFICANCE,
)
#: A gain on data that the fit has not seen: its whole interval is above zero.
ESTABLISHED = Rule(
    "established",
    "the interval of the gain on held-out data lies above zero",
    lambda interval: _finite(*interval) and interval[0] > 0,
)
#: A number over a limit.
EXCEEDS = Rule(
    "exceeds",
    "the number is larger than the limit",
    lambda value, limit: _finite(value, limit) and value > limit,
)
#: A number within a limit.
WITHIN = Rule(
    "within",
    "the number is at most the limit",
    lambda value, limit: _finite(value, limit) and value <= limit,
)
#: A number that reaches what was asked for.
REACHES = Rule(
    "reaches",
    "the number is at least what was asked for",
    lambda value, limit: _finite(value, limit) and value >= limit,
)
#: A number that does not reach what was asked for.
FALLS_SHORT = Rule(
    "falls short",
    "the number is less than what was asked for",
    lambda value, limit: _finite(value, limit) and value < limit,
)
#: A number outside of the range that was learned from.
BEYOND = Rule(
    "beyond",
    "the number lies outside of the range",
    lambda value, low, high: _finite(value, low, high) and not low <= value <= high,
)
#: A number of the range that was learned from, up to a hundredth.
INSIDE = Rule(
    "inside",
    "the number lies within the range, up to a hundredth of its ends",
    lambda value, low, high: _finite(value, low, high) and 0.99 * low <= value <= 1.01 * high,
)
#: A number between the levels that were learned from.
BETWEEN = Rule(
    "between",
    "the number lies between two levels",
    lambda value, low, high: _finite(value, low, high) and low < value < high,
)
#: Too few to say more.
NOT_ENOUGH = Rule(
    "not enough",
    "there are fewer than the claim needs",
    lambda count, needed: count < needed,
)


class UnfoundedSentenceError(AssertionError):
    """A sentence that its evidence does not allow: a fault of the software."""


@dataclass(frozen=True)
class Sentence:
    """`text` is said; it rests on `numbers`, and on `rule` with its `evidence`.

    Raises `UnfoundedSentenceError` where the rule does not allow the claim.
    """

    text: str
    numbers: Sequence[Number | Interval] = ()
    rule: Rule | None = None
    evidence: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.rule is not None and not self.rule.allows(**self.evidence):
            raise UnfoundedSentenceError(
                f"{self.text!r} needs that {self.rule.words}; it is {dict(self.evidence)}"
            )

    def __str__(self) -> str:
        return self.text


def sentence(
    template: str,
    rule: Rule | None = None,
    evidence: Mapping[str, Any] | None = None,
    /,
    **shown: Number | Interval | str,
) -> Sentence:
    """A sentence of `template.format(**shown)`, which rests on the numbers that it shows."""
    numbers = tuple(value for value in shown.values() if isinstance(value, Number | Interval))
    return Sentence(template.format(**shown), numbers, rule, evidence or {})


def first_allowed(
    evidence: Mapping[str, Any], *choices: tuple[Rule, str], **shown: Any
) -> Sentence:
    """The sentence of the first rule that the evidence allows.

    Each rule takes of the evidence what it names. Raises `UnfoundedSentenceError` where none allows
    its claim.
    """
    for rule, template in choices:
        needed = rule.allows.__code__.co_varnames[: rule.allows.__code__.co_argcount]
        taken = {name: evidence[name] for name in needed}
        if rule.allows(**taken):
            return sentence(template, rule, taken, **shown)
    raise UnfoundedSentenceError(f"no claim is allowed by {dict(evidence)}")
