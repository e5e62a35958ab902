"""Figures of benches on which many effects act: how far the gap shrinks, what is named, how true
the shares are.

Pure functions of rows. An answer that never came shrinks nothing and names nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from ..diagnosis.verdict import UNKNOWN
from .answer_sets import Rate
from .case_results import CaseResult, fraction_of

Rows = Sequence[CaseResult]

#: An effect with so much of the gap has to be named.
LARGE_SHARE = 0.2
#: Shares are compared where the true or the stated one is at least this.
COMPARED_SHARE = 0.05
#: An answer is below the naive baseline where its fraction is less by more than this.
BELOW_NAIVE = 0.02
_RESAMPLES = 2000


@dataclass(frozen=True)
class Quantile:
    """A quantile of n values with the 95 % interval of the percentile bootstrap (Efron 1979)."""

    value: float
    low: float
    high: float
    n: int

    @classmethod
    def of(cls, values: Sequence[float], percent: float) -> Self:
        """NaN without values."""
        if not len(values):
            return cls(math.nan, math.nan, math.nan, 0)
        table = np.asarray(values, dtype=np.float64)
        rng = np.random.default_rng(len(table))
        drawn = np.percentile(rng.choice(table, (_RESAMPLES, len(table))), percent, axis=1)
        low, high = np.percentile(drawn, [2.5, 97.5])
        return cls(float(np.percentile(table, percent)), float(low), float(high), len(table))

    def as_json(self) -> dict[str, Any]:
        return {name: value if np.isfinite(value) else None for name, value in vars(self).items()}


@dataclass(frozen=True)
class BenchFigures:
    """Of one tier or kind.

    `fraction`s of the gap that go, held out, as the report says: median and 10th percentile;
    `true_fraction`: median of what the named effects truly remove, against a recording of the bench
    without scatter. `naive`: median of the joint ridge fit, `at_least_naive` how often the
    diagnosis is not below it. `largest_named`: the effect with the largest true share is in the
    first entry; `large_named`: effects with a true share of 0.2 and more; `off_named`: of effects
    that do not act. `shares_error`: mean absolute error of the shares by leave-one-out and by
    Shapley, `shares_held` how often the 90 % intervals hold the former. `all_named`, `one_named`:
    every acting effect, at least one.
    """

    name: str
    n: int
    fraction: Quantile
    fraction_10: Quantile
    true_fraction: Quantile
    true_fraction_10: Quantile
    naive: Quantile
    at_least_naive: Rate
    largest_named: Rate
    large_named: Rate
    off_named: Rate
    all_named: Rate
    one_named: Rate
    shares_error: float
    shapley_error: float
    shares_held: Rate
    unknown_first: Rate
    seconds: tuple[float, float]
    memory_mb: float

    def as_json(self) -> dict[str, Any]:
        table = {k: v.as_json() if hasattr(v, "as_json") else v for k, v in vars(self).items()}
        table["seconds"] = [finite(value) for value in self.seconds]
        return {k: finite(v) if isinstance(v, float) else v for k, v in table.items()}


def bench_figures(name: str, rows: Rows) -> BenchFigures:
    fractions = [fraction_of(row.said.shrinkage) or 0.0 for row in rows]
    true = [fraction_of(row.oracle, "true_fraction") or 0.0 for row in rows if row.label.effects]
    naive = [
        (row.said.naive, own)
        for row, own in zip(rows, fractions, strict=True)
        if row.said.naive is not None
    ]
    seconds = [row.said.seconds for row in rows if math.isfinite(row.said.seconds)]
    memory = [row.said.memory_mb for row in rows if row.said.memory_mb is not None]
    compared = [(row, effect) for row in rows for effect in _compared(row)]
    return BenchFigures(
        name=name,
        n=len(rows),
        fraction=Quantile.of(fractions, 50),
        fraction_10=Quantile.of(fractions, 10),
        true_fraction=Quantile.of(true, 50),
        true_fraction_10=Quantile.of(true, 10),
        naive=Quantile.of([value for value, _ in naive if value is not None], 50),
        at_least_naive=Rate.of(
            own >= value - BELOW_NAIVE for value, own in naive if value is not None
        ),
        largest_named=Rate.of(_largest(row) in any_named(row) for row in rows if row.label.shares),
        large_named=Rate.of(
            effect in any_named(row)
            for row in rows
            for effect, share in row.label.shares.items()
            if share >= LARGE_SHARE
        ),
        off_named=Rate.of(
            effect in frozenset().union(*row.said.named[:1])
            for row in rows
            for effect in row.label.shown
            if effect not in row.label.effects
        ),
        all_named=Rate.of(
            set(row.label.effects) <= any_named(row) for row in rows if row.label.effects
        ),
        one_named=Rate.of(
            bool(set(row.label.effects) & any_named(row)) for row in rows if row.label.effects
        ),
        shares_error=_mean(
            [abs(_stated(row, e) - row.label.shares.get(e, 0.0)) for row, e in compared]
        ),
        shapley_error=_mean(
            [abs(_stated(row, e) - row.label.shapley.get(e, 0.0)) for row, e in compared]
        ),
        shares_held=Rate.of(_interval_holds(row, effect) for row, effect in compared),
        unknown_first=Rate.of(row.said.labels[:1] == (UNKNOWN,) for row in rows),
        seconds=(percentile(seconds, 50), percentile(seconds, 95)),
        memory_mb=max(memory, default=math.nan),
    )


def bench_tables(rows: Rows, tiers: Sequence[str]) -> tuple[BenchFigures, ...]:
    """Of each of some tiers, and of each kind within it where there are several."""
    tables = []
    for tier in tiers:
        own = [row for row in rows if row.label.tier == tier]
        kinds = list(dict.fromkeys(row.label.kind for row in own))
        if own:
            tables.append(bench_figures(tier, own))
        if len(kinds) > 1:
            tables += [
                bench_figures(f"{tier}, {k}", [row for row in own if row.label.kind == k])
                for k in kinds
            ]
    return tuple(tables)


#: A column each: its name, and how its cell is made.
COLUMNS: dict[str, Callable[[BenchFigures], str]] = {
    "cases": lambda f: str(f.n),
    "fraction held out": lambda f: show_quantile(f.fraction),
    "10th percentile": lambda f: show_quantile(f.fraction_10),
    "truly removed": lambda f: show_quantile(f.true_fraction),
    "its 10th percentile": lambda f: show_quantile(f.true_fraction_10),
    "naive joint fit": lambda f: show_quantile(f.naive),
    "not below it": lambda f: show_rate(f.at_least_naive),
    "largest named": lambda f: show_rate(f.largest_named),
    "share >= 0.2 named": lambda f: show_rate(f.large_named),
    "off, but named": lambda f: show_rate(f.off_named),
    "all named": lambda f: show_rate(f.all_named),
    "one named": lambda f: show_rate(f.one_named),
    "shares' error": lambda f: show_number(f.shares_error),
    "(Shapley)": lambda f: show_number(f.shapley_error),
    "shares in 90 %": lambda f: show_rate(f.shares_held),
    "unknown first": lambda f: show_rate(f.unknown_first),
    "seconds, 95th percentile": lambda f: (
        f"{show_number(f.seconds[0], 0)}, {show_number(f.seconds[1], 0)}"
    ),
    "MB": lambda f: show_number(f.memory_mb, 0),
}


def bench_text(tables: Sequence[BenchFigures]) -> str:
    """Markdown: a row for each figure, a column for each table."""
    if not tables:
        return ""
    rows = [["figure", *(table.name for table in tables)]]
    rows += [[name, *(cell(table) for table in tables)] for name, cell in COLUMNS.items()]
    return markdown_table(rows)


def markdown_table(rows: Sequence[Sequence[str]]) -> str:
    """With columns of even width; the first row is the heading."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = [
        "| " + " | ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)) + " |"
        for row in rows
    ]
    return "\n".join([lines[0], "| " + " | ".join("-" * w for w in widths) + " |", *lines[1:]])


def _largest(row: CaseResult) -> str:
    return max(row.label.shares, key=lambda effect: row.label.shares[effect])


def any_named(row: CaseResult) -> frozenset[str]:
    """Effects that some member of the first entry names."""
    return frozenset().union(*row.said.named)


def _compared(row: CaseResult) -> list[str]:
    names = dict.fromkeys([*row.label.shares, *row.said.shares])
    return [
        e for e in names if max(row.label.shares.get(e, 0.0), _stated(row, e)) >= COMPARED_SHARE
    ]


def _stated(row: CaseResult, effect: str) -> float:
    return row.said.shares[effect][0] if effect in row.said.shares else 0.0


def _interval_holds(row: CaseResult, effect: str) -> bool:
    if effect not in row.said.shares:
        return False
    _, low, high = row.said.shares[effect]
    return low <= row.label.shares.get(effect, 0.0) <= high


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if len(values) else math.nan


def percentile(values: Sequence[float], percent: float) -> float:
    """NaN without values."""
    return float(np.percentile(values, percent)) if len(values) else math.nan


def finite(value: float) -> float | None:
    """JSON has neither NaN nor infinity."""
    return value if math.isfinite(value) else None


def show_quantile(value: Quantile) -> str:
    """With its interval and the number of values."""
    return f"{value.value:.2f} ({value.low:.2f} to {value.high:.2f}, {value.n})" if value.n else "-"


def show_rate(rate: Rate) -> str:
    """With its interval and the number of cases."""
    if rate.value is None:
        return "-"
    low, high = rate.interval
    return f"{rate.value:.2f} ({low:.2f} to {high:.2f}, {rate.n})"


def show_number(value: float, digits: int = 2) -> str:
    """A dash for NaN."""
    return f"{value:.{digits}f}" if math.isfinite(value) else "-"
