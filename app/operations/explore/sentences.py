"""What may be said of a chart of stored rows."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from ...common.quantities import display_of
from ..sentence import Number, Rule, Sentence, sentence
from .chart import ChartData
from .control import ControlChart
from .correlation import RankCorrelation
from .figures import DrawnChart

#: One row of a subject, and several.
NOUNS = {
    "impacts": ("impact", "impacts"),
    "shots": ("shot", "shots"),
    "channels": ("record of a channel", "records of channels"),
    "models": ("version of a model", "versions of models"),
}
RISES = Rule(
    "rises",
    "the 95 % interval of the correlation lies above zero",
    lambda low: math.isfinite(low) and low > 0,
)
FALLS = Rule(
    "falls",
    "the 95 % interval of the correlation lies below zero",
    lambda high: math.isfinite(high) and high < 0,
)
NO_TREND = Rule(
    "no trend",
    "the 95 % interval of the correlation includes zero",
    lambda low, high: math.isfinite(low) and math.isfinite(high) and low <= 0 <= high,
)
SEVERAL_PROCESSES = Rule(
    "several processes",
    "the rows are of several configurations",
    lambda configurations: configurations > 1,
)


def count_of(key: str, value: int) -> Number:
    """A whole number of an answer."""
    return Number(key, value, "count")


def facts_of(rows: int, data: ChartData, drawn: DrawnChart, selected: int | None) -> dict[str, Any]:
    """The numbers that the sentences show, and how the rows were drawn, by their keys."""
    facts: dict[str, Any] = {"rows": rows, "without_value": data.without_value}
    if data.not_positive:
        facts["not_positive"] = data.not_positive
    facts["drawn_one_by_one"] = drawn.points
    if drawn.cells:
        facts |= {"drawn_together": int(data.rows.size - drawn.points), "marks": drawn.cells}
    if selected is not None:
        facts["selected"] = selected
    if data.correlation is not None:
        facts |= _correlation_facts(data.correlation)
    if data.control is not None:
        facts |= _control_facts(data.control) | {"configurations": data.configurations}
    return facts


def _correlation_facts(correlation: RankCorrelation) -> dict[str, Any]:
    return {
        "correlation": correlation.coefficient,
        "correlation_low": correlation.low,
        "correlation_high": correlation.high,
        "runs": correlation.independent,
    }


def _control_facts(chart: ControlChart) -> dict[str, Any]:
    return {
        "values": chart.values.size,
        "beyond_limits": chart.beyond.size,
        "on_one_side": chart.one_side.size,
        "ranges_beyond": chart.range_beyond.size,
    }


def sentences_of(subject: str, facts: Mapping[str, Any], data: ChartData) -> Iterator[Sentence]:
    """All that may be said, the most general first."""
    singular, plural = NOUNS[subject]
    rows = facts["rows"]
    if not rows:
        yield sentence(f"No {singular} matches.")
        return
    verb = "matches" if rows == 1 else "match"
    yield sentence(
        f"{{rows}} {singular if rows == 1 else plural} {verb}.", rows=_count(facts, "rows")
    )
    yield from _left_out(facts, data)
    if "marks" in facts:
        yield sentence(
            "{points} are drawn one by one, and {together} as {marks} marks, each for several.",
            points=_count(facts, "drawn_one_by_one"),
            together=_count(facts, "drawn_together"),
            marks=_count(facts, "marks"),
        )
    elif facts["drawn_one_by_one"] < data.rows.size and data.kind != "distribution":
        yield sentence(
            "{points} of them are drawn one by one, the smallest and the largest values among "
            "them.",
            points=_count(facts, "drawn_one_by_one"),
        )
    if data.correlation is not None:
        yield from _correlation(data, data.correlation)
    if data.control is not None:
        yield from _control(facts, data)


def _count(facts: Mapping[str, Any], key: str) -> Number:
    return count_of(key, facts[key])


def _words(data: ChartData) -> str:
    labels = [display_of(data.x.key).label] if data.kind != "control" else []
    labels += [display_of(data.y.key).label] if data.y is not None else []
    return " or no ".join(labels)


def _left_out(facts: Mapping[str, Any], data: ChartData) -> Iterator[Sentence]:
    if missing := facts["without_value"]:
        verb = "has" if missing == 1 else "have"
        yield sentence(
            f"{{missing}} of them {verb} no {_words(data)}, and {'is' if missing == 1 else 'are'} "
            "not drawn.",
            missing=_count(facts, "without_value"),
        )
    if not_positive := facts.get("not_positive", 0):
        verb = "is" if not_positive == 1 else "are"
        yield sentence(
            f"{{count}} of them {verb} not positive, and {'has' if not_positive == 1 else 'have'} "
            "no place on a logarithmic axis.",
            count=_count(facts, "not_positive"),
        )


def _correlation(data: ChartData, correlation: RankCorrelation) -> Iterator[Sentence]:
    """A trend where it is established, and that none is where the interval includes zero."""
    if not (math.isfinite(correlation.low) and math.isfinite(correlation.high)):
        return
    assert data.y is not None
    x, y = display_of(data.x.key).label, display_of(data.y.key).label
    numbers = {
        "correlation": Number("correlation", correlation.coefficient, "size"),
        "low": Number("correlation_low", correlation.low, "size"),
        "high": Number("correlation_high", correlation.high, "size"),
        "runs": count_of("runs", correlation.independent),
    }
    basis = (
        "Spearman's rank correlation is {correlation}, with a 95 % interval from {low} to {high} "
        "that rests on {runs} runs"
    )
    together = ", all colours together" if data.colour is not None else ""
    if correlation.low > 0:
        evidence = {"low": correlation.low}
        text = f"The {y} rises with the {x}: {basis}{together}."
        yield sentence(text, RISES, evidence, **numbers)
    elif correlation.high < 0:
        text = f"The {y} falls with the {x}: {basis}{together}."
        yield sentence(text, FALLS, {"high": correlation.high}, **numbers)
    else:
        evidence = {"low": correlation.low, "high": correlation.high}
        text = f"No trend of the {y} with the {x} is established: {basis}{together}."
        yield sentence(text, NO_TREND, evidence, **numbers)


def _control(facts: Mapping[str, Any], data: ChartData) -> Iterator[Sentence]:
    yield sentence(
        "{beyond} of {values} values are beyond the limits, {one_side} end eight or more in a row "
        "on one side of the centre, and {ranges} moving ranges are beyond their limit.",
        beyond=_count(facts, "beyond_limits"),
        values=_count(facts, "values"),
        one_side=_count(facts, "on_one_side"),
        ranges=_count(facts, "ranges_beyond"),
    )
    evidence = {"configurations": data.configurations}
    if data.configurations > 1:
        yield sentence(
            "The rows are of {count} configurations. The limits hold for settings that stay the "
            "same: filter to one configuration before you take a point for a fault.",
            SEVERAL_PROCESSES,
            evidence,
            count=_count(facts, "configurations"),
        )
