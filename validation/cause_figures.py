"""What a reader of a diagnosis acts on: which effect leads, what is named that does not act, what
is said of nothing.

Pure functions of rows. True shares are Shapley values of the noise-free squared gap. An answer that
never came leads with nothing, names nothing and is wrong wherever it can be.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..diagnosis.verdict import NONE, UNKNOWN
from .answer_sets import Rate, accused, calibration_error, nulls, strangers
from .bench_figures import (
    BELOW_NAIVE,
    Quantile,
    any_named,
    finite,
    markdown_table,
    percentile,
    show_number,
    show_quantile,
    show_rate,
)
from .case_results import CaseResult, fraction_of
from .cases.case import STAGES

Rows = Sequence[CaseResult]

#: A single effect is named with confidence above this probability.
CONFIDENT = 0.8
#: Effects with less of the gap may be left out of the first entry.
LEAST_SHARE = 0.1
#: Every gun at full scale stands in it, and mostly it is the largest effect.
ATMOSPHERE = "gun.back_pressure"
ALL = "all tiers"


@dataclass(frozen=True)
class CauseFigures:
    """Of some campaigns.

    `largest_leads`: the effect with the largest true share is the first of the table of shares;
    `other_leads`: the same without the atmosphere, in which every gun stands; `largest_named`: it
    is in the first entry; `set_named`: it is in a set of the report, or in the first entry, where
    the report has sets, and `set_size` how many effects that set has. `idle_named`: of the names in
    the likeliest member of the first entry, those that do not act. `both_named`: of two acting
    effects. `wrong_alone`: one effect alone is named above 0.8, and it does not act. `shares_error`
    and `shares_held`: mean absolute error of the shares of acting effects, and how often their 90 %
    intervals hold the true ones. `none_first` and `unknown_first` where an effect of the catalogue
    makes a gap beyond tolerance. `outside_unknown`, `outside_none`: first answers where the cause
    is outside of the catalogue. `false_smooth` and `false_rough`: another answer than `none`
    without any effect, by background. `stage`: that of the largest error, of campaigns with
    several. `fraction`: of the gap that goes, held out by configuration; `corner`: held out by
    corner. `at_least_naive`: not below the naive joint fit by more than 0.02. `ece`: of the first
    entry's probability.
    """

    name: str
    n: int
    largest_leads: Rate
    other_leads: Rate
    largest_named: Rate
    set_named: Rate
    set_size: float
    idle_named: Rate
    both_named: Rate
    wrong_alone: Rate
    shares_error: float
    shares_held: Rate
    none_first: Rate
    unknown_first: Rate
    outside_unknown: Rate
    outside_none: Rate
    false_smooth: Rate
    false_rough: Rate
    stage: Rate
    fraction: Quantile
    fraction_10: Quantile
    corner: Quantile
    at_least_naive: Rate
    ece: float
    cpu_s: tuple[float, float]
    memory_mb: float

    def as_json(self) -> dict[str, Any]:
        table = {k: v.as_json() if hasattr(v, "as_json") else v for k, v in vars(self).items()}
        table["cpu_s"] = [finite(value) for value in self.cpu_s]
        return {k: finite(v) if isinstance(v, float) else v for k, v in table.items()}


def cause_figures(name: str, rows: Rows) -> CauseFigures:
    acting = [row for row in rows if row.label.effects]
    beyond = [row for row in acting if not row.label.within_tolerance]
    shared = [row for row in acting if row.label.shapley]
    with_sets = [row for row in shared if row.said.sets is not None]
    outside, without = strangers(rows), nulls(rows)
    answered = [row for row in rows if row.said.entries]
    fractions = [fraction_of(row.said.shrinkage) or 0.0 for row in acting]
    corners = [value for row in acting if (value := fraction_of(row.said.corner)) is not None]
    naive = [
        (row.said.naive, own)
        for row, own in zip(acting, fractions, strict=True)
        if row.said.naive is not None
    ]
    compared = [(row, effect) for row in shared for effect in row.label.effects]
    cpu = [row.said.cpu_s for row in rows if row.said.cpu_s is not None]
    named = [(row, effect) for row in rows for effect in frozenset().union(*row.said.named[:1])]
    return CauseFigures(
        name=name,
        n=len(rows),
        largest_leads=Rate.of(_leader(row) == _largest(row) for row in shared),
        other_leads=Rate.of(
            _leader(row, ATMOSPHERE) == _largest(row, ATMOSPHERE)
            for row in shared
            if set(row.label.shapley) - {ATMOSPHERE}
        ),
        largest_named=Rate.of(_largest(row) in any_named(row) for row in shared),
        set_named=Rate.of(bool(_set_of_largest(row)) for row in with_sets),
        set_size=_mean(len(members) for row in with_sets if (members := _set_of_largest(row))),
        idle_named=Rate.of(effect not in row.label.effects for row, effect in named),
        both_named=Rate.of(_names_both(row) for row in acting if len(row.label.effects) == 2),
        wrong_alone=Rate.of(_wrong_alone(row) for row in rows),
        shares_error=_mean(
            abs(_stated(row, effect)[0] - row.label.shapley.get(effect, 0.0))
            for row, effect in compared
        ),
        shares_held=Rate.of(_holds(row, effect) for row, effect in compared),
        none_first=Rate.of(row.said.labels[:1] == (NONE,) for row in beyond),
        unknown_first=Rate.of(row.said.labels[:1] == (UNKNOWN,) for row in beyond),
        outside_unknown=Rate.of(row.said.labels[:1] == (UNKNOWN,) for row in outside),
        outside_none=Rate.of(row.said.labels[:1] == (NONE,) for row in outside),
        false_smooth=Rate.of(accused(row) for row in without if not row.label.rough),
        false_rough=Rate.of(accused(row) for row in without if row.label.rough),
        stage=Rate.of(_stage_right(row) for row in acting if len(STAGES[row.label.kind]) > 1),
        fraction=Quantile.of(fractions, 50),
        fraction_10=Quantile.of(fractions, 10),
        corner=Quantile.of(corners, 50),
        at_least_naive=Rate.of(
            own >= value - BELOW_NAIVE for value, own in naive if value is not None
        ),
        ece=calibration_error(
            np.array([row.said.entries[0].probability for row in answered]),
            np.array([first_entry_right(row) for row in answered], dtype=bool),
        ),
        cpu_s=(percentile(cpu, 50), percentile(cpu, 95)),
        memory_mb=max(
            (row.said.memory_mb for row in rows if row.said.memory_mb is not None), default=math.nan
        ),
    )


def cause_tables(rows: Rows, tiers: Sequence[str]) -> tuple[CauseFigures, ...]:
    """Of each of some tiers, of each kind within it where there are several, and of all rows of
    these tiers."""
    tables, used = [], []
    for tier in tiers:
        own = [row for row in rows if row.label.tier == tier]
        kinds = list(dict.fromkeys(row.label.kind for row in own))
        used += own
        if own:
            tables.append(cause_figures(tier, own))
        if len(kinds) > 1:
            tables += [
                cause_figures(f"{tier}, {k}", [row for row in own if row.label.kind == k])
                for k in kinds
            ]
    return (*tables, cause_figures(ALL, used)) if used else ()


def first_entry_right(row: CaseResult) -> bool:
    """Whether a member of the first entry is an accepted answer.

    It may leave out acting effects with less than a tenth of the gap, and names none that does not
    act.
    """
    if not row.said.entries:
        return False
    first = row.said.entries[0].labels
    if row.label.accepted & set(first):
        return True
    needed = {effect for effect, share in row.label.shapley.items() if share >= LEAST_SHARE}
    members = [set(label.split("+")) for label in first]
    return bool(needed) and any(needed <= member <= set(row.label.effects) for member in members)


#: A row each: its name, and how its cell is made.
LINES: dict[str, Callable[[CauseFigures], str]] = {
    "campaigns": lambda f: str(f.n),
    "largest leads the shares": lambda f: show_rate(f.largest_leads),
    "largest but the atmosphere": lambda f: show_rate(f.other_leads),
    "largest in the first entry": lambda f: show_rate(f.largest_named),
    "set that holds the largest is named": lambda f: show_rate(f.set_named),
    "effects in that set": lambda f: show_number(f.set_size, 1),
    "named, but do not act": lambda f: show_rate(f.idle_named),
    "both of two named": lambda f: show_rate(f.both_named),
    "one wrong effect above 0.8": lambda f: show_rate(f.wrong_alone),
    "error of the shares": lambda f: show_number(f.shares_error),
    "90 % intervals hold": lambda f: show_rate(f.shares_held),
    "none first, an effect acts": lambda f: show_rate(f.none_first),
    "unknown first, an effect acts": lambda f: show_rate(f.unknown_first),
    "outside: unknown first": lambda f: show_rate(f.outside_unknown),
    "outside: none first": lambda f: show_rate(f.outside_none),
    "false alarms, smooth": lambda f: show_rate(f.false_smooth),
    "false alarms, rough": lambda f: show_rate(f.false_rough),
    "stage of the largest error": lambda f: show_rate(f.stage),
    "fraction held out, median": lambda f: show_quantile(f.fraction),
    "its 10th percentile": lambda f: show_quantile(f.fraction_10),
    "in the corner, median": lambda f: show_quantile(f.corner),
    "not below the naive fit": lambda f: show_rate(f.at_least_naive),
    "ECE of the first entry": lambda f: show_number(f.ece),
    "CPU s: median, 95th percentile": lambda f: ", ".join(
        show_number(value, 0) for value in f.cpu_s
    ),
    "MB at most": lambda f: show_number(f.memory_mb, 0),
}


def cause_text(tables: Sequence[CauseFigures]) -> str:
    """Markdown: a row for each figure that some table has, a column for each table."""
    rows = [[name, *(cell(table) for table in tables)] for name, cell in LINES.items()]
    kept = [row for row in rows if any(cell.strip("-, ") for cell in row[1:])]
    return (
        markdown_table([["what a reader acts on", *(table.name for table in tables)], *kept])
        if tables
        else ""
    )


def _largest(row: CaseResult, but: str = "") -> str:
    return max(
        (effect for effect in row.label.shapley if effect != but),
        key=lambda e: row.label.shapley[e],
    )


def _leader(row: CaseResult, but: str = "") -> str:
    """The effect with the largest stated share; "" without any."""
    stated = (effect for effect in row.said.shares if effect != but)
    return max(stated, key=lambda effect: row.said.shares[effect][0], default="")


def _set_of_largest(row: CaseResult) -> frozenset[str]:
    """The smallest set that holds the largest effect; that effect alone where the first entry names
    it; else empty."""
    largest = _largest(row)
    holding = [members for members in row.said.sets or () if largest in members]
    if holding:
        smallest = min(holding, key=len)
        return frozenset(smallest)
    return frozenset({largest}) if largest in any_named(row) else frozenset()


def _names_both(row: CaseResult) -> bool:
    return any(set(row.label.effects) <= alternative for alternative in row.said.named)


def _wrong_alone(row: CaseResult) -> bool:
    if (
        not row.said.entries
        or row.said.entries[0].probability <= CONFIDENT
        or len(row.said.named) != 1
    ):
        return False
    names = row.said.named[0]
    return len(names) == 1 and not names <= set(row.label.effects)


def _stated(row: CaseResult, effect: str) -> tuple[float, float, float]:
    return row.said.shares.get(effect, (0.0, math.nan, math.nan))


def _holds(row: CaseResult, effect: str) -> bool:
    _, low, high = _stated(row, effect)
    return bool(low <= row.label.shapley.get(effect, 0.0) <= high)


def _stage_right(row: CaseResult) -> bool:
    return row.said.stages[:1] != () and row.said.stages[0] in row.label.stages


def _mean(values: Iterable[float]) -> float:
    table = list(values)
    return float(np.mean(table)) if table else math.nan
