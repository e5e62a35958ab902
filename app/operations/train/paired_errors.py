"""Two versions on the same held-out pulses, pulse by pulse and configuration by configuration.

Both have predicted each pulse, so that what is hard about the pulse cancels in the difference of
their errors. The share of pulses on which one is better counts repetitions of a configuration as
what they are: no independent evidence (`summary.share_interval`). A configuration is decided by the
scatter of its own repetitions, with Student's t.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ....array_types import Floats
from ....dataset.table import Texts
from ...common.number_format import NOTHING
from ...figures.figure import (
    ColourRole,
    Plot,
    PlotAxis,
    PlotSeries,
    PointSeries,
    ReferenceLine,
    as_floats,
)
from ..operation import ResultTable
from ..sentence import Number, Sentence, sentence
from .wording import difference_cell, metric_cell, metric_words

if TYPE_CHECKING:
    from ....training.registry.evaluate import Evaluation

Verdict = Literal["better", "worse", "the same", "not known"]
#: Of the intervals of configurations, as of all intervals of models.
_COVERAGE = 0.90
#: Role of a verdict in the figure.
_ROLES = {
    "better": ColourRole.CATEGORY_2,
    "worse": ColourRole.CATEGORY_1,
    "the same": ColourRole.QUIET,
    "not known": ColourRole.QUIET,
}


@dataclass(frozen=True)
class ConfigurationVerdict:
    """Mean errors of both versions on the pulses of a configuration. `low` to `high` is the 90 %
    interval of their difference, from its repetitions; None for a single pulse."""

    configuration: str
    pulses: int
    mean_a: float
    mean_b: float
    low: float | None
    high: float | None

    @property
    def difference(self) -> float:
        """Below zero where the first version is better."""
        return self.mean_a - self.mean_b

    @property
    def verdict(self) -> Verdict:
        """What the first version is here."""
        if self.low is None or self.high is None:
            return "not known"
        return "better" if self.high < 0 else "worse" if self.low > 0 else "the same"


@dataclass(frozen=True, eq=False)
class PairedErrors:
    """Errors of the versions `a` and `b` in one metric on the same n pulses: `difference` (n,) is
    the error of `a` minus that of `b`, `configurations` are in the order of their differences.

    `better_share` is the share of pulses on which `a` is better, with the 90 % interval `low` to
    `high` (NaN for a single configuration); a pulse on which both err alike counts half.
    """

    a: str
    b: str
    metric: str
    difference: Floats
    configuration: Texts
    better_share: float
    low: float
    high: float
    configurations: tuple[ConfigurationVerdict, ...]

    def count(self, verdict: Verdict) -> int:
        """Configurations with this verdict."""
        return sum(own.verdict == verdict for own in self.configurations)

    @property
    def better_pulses(self) -> int:
        """Pulses on which `a` is better."""
        return int(np.sum(self.difference < 0))


def paired_errors(judged: Evaluation, a: str, b: str, metric: str = "force_nrmse") -> PairedErrors:
    """The errors of two of the judged versions beside each other.

    Parameters:
        judged: The errors of the versions on common pulses.
        a: The label of the first version, such as "hybrid@3".
        b: The label of the second version.
        metric: A metric of `METRICS`; by default the force error.
    """
    from ....training.evaluation.summary import clustered, share_interval

    first, second = (
        np.asarray(getattr(judged.errors[label], metric), dtype=np.float64) for label in (a, b)
    )
    labels = judged.pulses.configuration
    difference = first - second
    better = np.where(difference == 0, 0.5, difference < 0)
    low, high = share_interval(clustered(better[:, None], labels))
    verdicts = [
        _verdict(str(label), first[labels == label], second[labels == label])
        for label in np.unique(labels)
    ]
    return PairedErrors(
        a,
        b,
        metric,
        as_floats(difference),
        labels,
        float(better.mean()),
        float(low[0]),
        float(high[0]),
        tuple(sorted(verdicts, key=lambda own: own.difference)),
    )


def _verdict(configuration: str, first: Floats, second: Floats) -> ConfigurationVerdict:
    from scipy.stats import t

    difference, count = first - second, len(first)
    low = high = None
    if count > 1:
        half = t.ppf((1 + _COVERAGE) / 2, count - 1) * difference.std(ddof=1) / math.sqrt(count)
        low, high = float(difference.mean() - half), float(difference.mean() + half)
    return ConfigurationVerdict(
        configuration, count, float(first.mean()), float(second.mean()), low, high
    )


# --- words


def paired_sentences(pair: PairedErrors) -> Iterator[Sentence]:
    """On which share of the pulses the first version is better, and how many configurations decide
    for either."""
    shown: dict[str, Any] = {
        "a": pair.a,
        "b": pair.b,
        "metric": metric_words(pair.metric),
        "better": Number("pulses", pair.better_pulses, "count"),
        "pulses": Number("pulses", len(pair.difference), "count"),
        "share": Number("share", pair.better_share, "share"),
    }
    interval = ""
    if math.isfinite(pair.low):
        interval = ", 90 % interval {low} to {high}"
        shown |= {
            "low": Number("share", pair.low, "share"),
            "high": Number("share", pair.high, "share"),
        }
    yield sentence(
        "Pulse by pulse, {a} has the smaller {metric} than {b} on {better} of {pulses} pulses "
        f"({{share}}{interval}).",
        **shown,
    )
    yield _by_configuration(pair)


def _by_configuration(pair: PairedErrors) -> Sentence:
    counts: dict[str, Any] = {
        name: Number("configurations", value, "count")
        for name, value in {
            "better": pair.count("better"),
            "worse": pair.count("worse"),
            "same": pair.count("the same"),
            "unknown": pair.count("not known"),
            "all": len(pair.configurations),
        }.items()
    }
    if pair.count("not known") == len(pair.configurations):
        return sentence(
            "No configuration can be decided by itself: each of the {all} has a single pulse.",
            **{"all": counts["all"]},
        )
    decided = len(pair.configurations) - pair.count("not known")
    counts["chance"] = Number("configurations", round((1 - _COVERAGE) * decided), "count")
    rest = "; not decided, for want of repetitions: {unknown}" if pair.count("not known") else ""
    if not pair.count("not known"):
        del counts["unknown"]
    return sentence(
        "Of {all} configurations, {a} is better on {better} and worse on {worse}; on {same} the "
        f"difference is within the scatter of the repetitions{rest}. Chance alone would decide "
        "about {chance} of them.",
        a=pair.a,
        **counts,
    )


def paired_tables(pair: PairedErrors) -> list[ResultTable]:
    """The counts that the sentences say, and every configuration with both errors."""
    decided = len(pair.configurations) - pair.count("not known")
    counts = {
        "version": pair.a,
        "compared with": pair.b,
        "pulses": len(pair.difference),
        "better on pulses": pair.better_pulses,
        "share": Number("share", pair.better_share, "share").cell,
        "from": _share_cell(pair.low),
        "to": _share_cell(pair.high),
        "configurations": len(pair.configurations),
        "better": pair.count("better"),
        "the same": pair.count("the same"),
        "worse": pair.count("worse"),
        "not known": pair.count("not known"),
        "decided by chance": round((1 - _COVERAGE) * decided),
    }
    rows = [
        {
            "configuration": own.configuration,
            "verdict": f"{pair.a} is {own.verdict}" if own.verdict != "not known" else own.verdict,
            "pulses": own.pulses,
            pair.a: metric_cell(pair.metric, own.mean_a),
            pair.b: metric_cell(pair.metric, own.mean_b),
            "difference": difference_cell(pair.metric, own.difference),
            "from": difference_cell(pair.metric, own.low),
            "to": difference_cell(pair.metric, own.high),
        }
        for own in pair.configurations
    ]
    return [
        ResultTable("Pulse by pulse and configuration by configuration", [counts]),
        ResultTable("Every configuration, with 90 % intervals from its repetitions", rows),
    ]


def _share_cell(value: float) -> str:
    return Number("share", value, "share").cell if math.isfinite(value) else NOTHING


# --- figure


def paired_figure(pair: PairedErrors) -> Plot:
    """The difference of the errors of each pulse (small rings) and of each configuration with its
    90 % interval, in percentage points, the configurations in the order of their differences."""
    places = {own.configuration: place for place, own in enumerate(pair.configurations, 1)}
    labels = tuple(str(label) for label in pair.configuration)
    series: list[PlotSeries] = [
        PointSeries(
            as_floats([places[label] for label in labels]),
            100 * pair.difference,
            size=4,
            filled=False,
            labels=labels,
            name="a pulse",
            role=ColourRole.QUIET,
            opacity=0.8,
        )
    ]
    for verdict, name in {
        "better": f"{pair.a} is better",
        "the same": "no difference beyond the repetitions",
        "worse": f"{pair.b} is better",
        "not known": "a single pulse",
    }.items():
        series += _points(pair, verdict, name, places)
    return Plot(
        f"{pair.a} and {pair.b} on the same pulses",
        PlotAxis("configuration, in the order of the difference", "1", whole=True),
        PlotAxis(f"difference of the {metric_words(pair.metric)}s", "% points"),
        tuple(series),
        (ReferenceLine("y", 0.0, role=ColourRole.INK, dash="solid"),),
    )


def _points(
    pair: PairedErrors, verdict: str, name: str, places: Mapping[str, int]
) -> Sequence[PointSeries]:
    chosen = [own for own in pair.configurations if own.verdict == verdict]
    if not chosen:
        return ()
    mean = 100 * as_floats([own.difference for own in chosen])
    low, high = (
        100 * as_floats([own.difference if end is None else end for own, end in pairs])
        for pairs in (
            [(own, own.low) for own in chosen],
            [(own, own.high) for own in chosen],
        )
    )
    return (
        PointSeries(
            as_floats([places[own.configuration] for own in chosen]),
            mean,
            y_low=low,
            y_high=high,
            size=8,
            filled=verdict not in ("the same", "not known"),
            labels=tuple(own.configuration for own in chosen),
            name=name,
            role=_ROLES[verdict],
        ),
    )
