"""A diagnosis in rows: the cells that its sentences take their numbers from, and the sentences of
its parts."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from ....diagnosis.verdict import CORRECTED, Verdict
from ...common.number_format import number, percent, percent_range, times
from ...common.quantities import cell, display_of
from ...twins.adopted_effects import offered
from ..operation import Lines, ResultTable
from .recommendations import gone_with, next_experiment, next_steps
from .statements import own_error
from .wording import (
    ACTS,
    WHOLE_ANSWER,
    cause_name,
    fitted_words,
    held_out_name,
    owned_parameters,
    span_label,
    spell_sets,
    unexplained_interval,
    with_labels,
)

Row = dict[str, Any]

SIZES, SETS = "Size of the model error", "Sets of effects of which at least one acts"
CAUSES, HELD_OUT = "Causes", "On configurations that the fit has not seen"


def tables(verdict: Verdict) -> tuple[ResultTable | Lines, ...]:
    """All of a diagnosis but its first sentences; what there is nothing of is left out."""
    parts: tuple[ResultTable | Lines, ...] = (
        Lines("What to do next", next_steps(verdict)),
        ResultTable(SIZES, tuple(_sizes(verdict))),
        *_effects(verdict),
        ResultTable(SETS, tuple(_sets(verdict))),
        ResultTable(
            "Path of the model error on configurations that the fit has not seen",
            tuple(_path(verdict)),
        ),
        ResultTable(CAUSES, tuple(_causes(verdict))),
        ResultTable("Where the error lies", tuple(_places(verdict))),
        ResultTable(HELD_OUT, tuple(_held_out(verdict))),
        Lines("The next experiment", next_experiment(verdict)),
        ResultTable("Runs of the next experiment", tuple(_next_runs(verdict))),
        Lines("Assumptions", verdict.assumptions),
    )
    return tuple(part for part in parts if isinstance(part, Lines) or part.rows)


def _sizes(verdict: Verdict) -> Iterator[Row]:
    gap = verdict.gap
    yield {
        "error": gap.metric,
        "size": number(gap.before),
        "noise": number(gap.noise_floor),
        "tolerance": number(gap.tolerance),
        "in tolerances": _ratio(gap.before, gap.tolerance),
        "in noise": _ratio(gap.before, gap.noise_floor),
    }
    for family in gap.families:
        yield {
            "error": family.family,
            "size": number(family.before),
            "noise": number(family.noise_floor),
            "tolerance": number(family.tolerance),
            "in tolerances": _ratio(family.before, family.tolerance),
            "in noise": _ratio(family.before, family.noise_floor),
        }


def _ratio(size: float, scale: float) -> str:
    return times(size / scale) if scale > 0 and math.isfinite(size / scale) else ""


def _effects(verdict: Verdict) -> Iterator[ResultTable | Lines]:
    from .report import EFFECT_COLUMNS, GAIN, effect_rows

    if not verdict.effects:
        return
    remarks = [
        f"{GAIN}: how much more disappears, where it was not fitted, with it than with the others "
        "alone",
        f"{ACTS}: if the catalogue has every cause",
    ]
    if any(effect.share < 0 for effect in verdict.effects):
        remarks.append(
            "A negative share: the effect hides a part of the error, which would be larger without "
            "it."
        )
    if verdict.unexplained is not None and verdict.unexplained.share > 1:
        remarks.append(
            "More than 100 % unexplained: with the likeliest effects the error is larger than "
            "without any; the shares of the effects and this one make 100 % together."
        )
    yield Lines("Effects (share of the squared error)", remarks)
    rows = (dict(zip(EFFECT_COLUMNS, row, strict=True)) for row in effect_rows(verdict))
    columns = [column for column in EFFECT_COLUMNS if column != "name"]
    yield ResultTable("", tuple({column: row[column] for column in columns} for row in rows))


def _sets(verdict: Verdict) -> Iterator[Row]:
    """The named sets with what would tell the effects of each apart, all other effects, and what
    none explains."""
    members: set[str] = set()
    for own in verdict.named_sets:
        members |= set(own.effects)
        yield {
            "effects": own.name,
            "share": percent(own.share),
            "90 % interval": percent_range(*own.ci90),
            ACTS: percent(own.inclusion),
            "adds held out": percent(own.held_out_gain),
            "told apart by": own.settled_by.channel if own.settled_by else "",
            "standard deviations": number(own.settled_by.d_prime) if own.settled_by else "",
        }
    others = [effect.share for effect in verdict.effects if effect.effect not in members]
    if others:
        yield {"effects": "effects of no set", "share": percent(sum(others))}
    if verdict.unexplained is not None:
        yield {
            "effects": "unexplained",
            "share": percent(verdict.unexplained.share),
            "90 % interval": percent_range(*unexplained_interval(verdict.unexplained)),
        }


def _path(verdict: Verdict) -> Iterator[Row]:
    if not verdict.path:
        return
    yield {"step": "nominal model", "error": number(verdict.gap.before), "gone": ""}
    for step in verdict.path:
        yield {
            "step": f"+ {step.added}",
            "error": number(step.after),
            "gone": percent(step.fraction),
        }
    yield {"step": "measurement noise", "error": number(verdict.gap.noise_floor), "gone": ""}


def _causes(verdict: Verdict) -> Iterator[Row]:
    """The entries of the answer; the probability of each is that it is the whole answer."""
    for cause in verdict.causes:
        numbers = (fitted_words(item, effect) for effect, item in owned_parameters(cause))
        yield {
            WHOLE_ANSWER: percent(cause.probability),
            "cause": cause_name(cause),
            "parameters": ", ".join(numbers),
        }


def _places(verdict: Verdict) -> Iterator[Row]:
    where = verdict.where
    for stage in where.stage:
        yield {
            "place": stage.name,
            "share": percent(stage.share),
            "90 % interval": percent_range(*stage.ci90),
            "own error in tolerances": own_error(stage.own, stage.own_ci90),
            "rounded": times(stage.own),
        }
    for region in where.factors:
        yield {"place": region.rule, "excess in noise": number(region.excess),
               "p": number(region.p_value)}  # fmt: skip
    yield from ({"place": span_label(window)} for window in where.time)
    yield from ({"place": span_label(band)} for band in where.frequency)
    for drift in where.drift:
        yield {"place": with_labels(drift)}


def _held_out(verdict: Verdict) -> Iterator[Row]:
    for entry in verdict.shrinkage:
        interval = "" if entry.ci90 is None else percent_range(*entry.ci90)
        yield {
            "effects": held_out_name(entry, verdict),
            "held out by": entry.held_out_by,
            "before": number(entry.before),
            "after": number(entry.after),
            "gone": "" if entry.fraction is None else percent(entry.fraction),
            "90 % interval": interval,
            "after a learned correction": number(entry.more[CORRECTED][1])
            if CORRECTED in entry.more
            else "",
        }
    best = offered(verdict)
    fraction = None if best is None else gone_with(verdict, best)
    if best is not None and fraction is not None:
        yield {"effects": f"to adopt: {spell_sets(best.name)}", "gone": percent(max(fraction, 0.0))}


def _next_runs(verdict: Verdict) -> Iterator[Row]:
    for run in verdict.next_runs:
        settings = {
            display_of(column).heading: level
            if isinstance(level, str)
            else cell(column, float(level))
            for column, level in run.settings.items()
        }
        yield {**settings, "runs needed": run.runs_needed}
