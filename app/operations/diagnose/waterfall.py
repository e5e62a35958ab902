"""The waterfall of a diagnosis: the error of the nominal model, what each set of effects takes away
on configurations that the fit has not seen, what remains, and the measurement noise below it; for
the path of the report, and for any other effects whose error was computed."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from ....diagnosis.verdict import LEAST_FRACTION, Verdict
from ....diagnosis.what_if import ComputedSet, Interval
from ...common.number_format import format_interval, join_words, number, percent
from ...figures.figure import ColourRole, Plot, ReferenceLine
from .report_charts import BarRow, bars_plot, learned_rows, path_axis
from .wording import effect_subject

#: Px of a page for a bar with its name, fewer where there are many, and for the axis: sentences and
#: bars are together as high as a screen.
_MOST_ROW, _LEAST_ROW, _ROWS, _AXIS = 42.0, 29.0, 320.0, 48.0


@dataclass(frozen=True)
class Level:
    """The error that is left once more effects act: `added` are their names, `after` and its
    interval in tolerances, `fraction` the part of the reducible error that is gone by then."""

    added: tuple[str, ...]
    after: float
    ci90: Interval | None
    fraction: float | None


def path_names(verdict: Verdict) -> tuple[str, ...]:
    """The names of the path's steps, in its order."""
    return tuple(step.added for step in verdict.path)


def computed_set(verdict: Verdict, names: Iterable[str]) -> ComputedSet | None:
    """The computed set of exactly these names; None where there is none."""
    return None if verdict.what_if is None else verdict.what_if.find(frozenset(names))


def path_levels(verdict: Verdict) -> tuple[Level, ...]:
    """The levels of the report's path; their intervals only where the diagnosis computed them."""
    names = path_names(verdict)
    levels = []
    for i, step in enumerate(verdict.path):
        own = computed_set(verdict, names[: i + 1])
        ci90 = None if own is None else own.ci90
        levels.append(_level(verdict, (step.added,), step.after, ci90, step.fraction))
    return tuple(levels)


def set_levels(verdict: Verdict, names: Sequence[str]) -> tuple[Level, ...]:
    """The levels down to exactly these effects, in the order of their shares. Effects whose error
    was not computed without the next one share a step with it.

    Raises `LookupError` for effects whose error together was not computed.
    """
    if names and computed_set(verdict, names) is None:
        raise LookupError(
            f"The error with {join_words(list(names))} was not computed with this diagnosis: "
            "diagnose with these effects."
        )
    order = {
        name: i
        for i, name in enumerate([*path_names(verdict), *(own.effect for own in verdict.effects)])
    }
    ordered = sorted(names, key=lambda name: order.get(name, len(order)))
    levels: list[Level] = []
    pending: list[str] = []
    for i, name in enumerate(ordered):
        pending.append(name)
        own = computed_set(verdict, ordered[: i + 1])
        if own is not None:
            levels.append(_level(verdict, tuple(pending), own.after, own.ci90, own.fraction))
            pending = []
    return tuple(levels)


def _level(
    verdict: Verdict,
    added: tuple[str, ...],
    after: float,
    ci90: Interval | None,
    fraction: float | None,
) -> Level:
    tolerance = verdict.gap.tolerance
    interval = None if ci90 is None else (ci90[0] / tolerance, ci90[1] / tolerance)
    return Level(added, after / tolerance, interval, fraction)


def waterfall_rows(verdict: Verdict, levels: Sequence[Level]) -> tuple[BarRow, ...]:
    """The bars in tolerances; () where the sizes of the error are no numbers."""
    gap = verdict.gap
    sizes = [gap.before, gap.noise_floor, *(level.after for level in levels)]
    if not gap.tolerance > 0 or not all(map(math.isfinite, sizes)):
        return ()
    nominal_error, noise = gap.before / gap.tolerance, gap.noise_floor / gap.tolerance
    ends = None if verdict.what_if is None else verdict.what_if.before_ci90
    interval = None if ends is None else (ends[0] / gap.tolerance, ends[1] / gap.tolerance)
    rows = [
        BarRow(
            "nominal model", _sized(nominal_error, interval), 0.0, nominal_error, _ERROR, interval
        )
    ]
    level_before = nominal_error
    for level in levels:
        role = ColourRole.CAUSE if level.after <= level_before else _ERROR
        name = f"+ {join_words([added_words(name) for name in level.added])}"
        gone = _gone(level.fraction)
        rows.append(BarRow(name, gone, level.after, level_before, role))
        level_before = level.after
    if levels:
        last = levels[-1]
        rows.append(
            BarRow(
                "what remains", _sized(last.after, last.ci90), 0.0, last.after, _ERROR, last.ci90
            )
        )
    return (
        *rows,
        BarRow(
            "repeatability (measurement noise)", _sized(noise, None), 0.0, noise, ColourRole.NOISE
        ),
    )


_ERROR = ColourRole.BEFORE


def _sized(level: float, interval: Interval | None) -> str:
    if interval is None:
        return number(level)
    value, low, high = format_interval(level, *interval)
    return f"{value} ({low} to {high})"


def _gone(fraction: float | None) -> str:
    if fraction is None or not math.isfinite(fraction):
        return ""
    return "larger than without" if fraction <= -LEAST_FRACTION else f"{percent(fraction)} gone"


def added_words(name: str) -> str:
    """A name of the path or of a computed set in few words: effects without articles."""
    return short_names(name.split(" or ")) if "." in name else name


def short_names(effects: Sequence[str]) -> str:
    """Effects of which at least one acts, without articles; what all names begin with is said once:
    "flow resistance of the barrel or of the valve"."""
    words = [effect_subject(name).removeprefix("the ") for name in effects]
    parts = [own.split(" of ", 1) for own in words]
    if len(words) > 1 and all(len(own) == 2 for own in parts) and len({p[0] for p in parts}) == 1:
        words = [words[0], *(f"of {own[1]}" for own in parts[1:])]
    return join_words(words, "or")


def waterfall_plot(verdict: Verdict, names: Sequence[str] | None = None) -> Plot | None:
    """The waterfall of the report's path, or of these effects; None where the error has no size.

    Raises `LookupError` for effects whose error was not computed.
    """
    levels = path_levels(verdict) if names is None else set_levels(verdict, names)
    rows = waterfall_rows(verdict, levels)
    if not rows:
        return None
    learned = [
        replace(row, value=number(row.end)) for row in learned_rows(verdict) if names is None
    ]
    rows = (*rows[:-1], *learned, rows[-1])
    plot = bars_plot("The model error, step by step", path_axis(), rows, len(levels) + 1)
    noise = verdict.gap.noise_floor / verdict.gap.tolerance
    lines = (
        ReferenceLine("x", 1.0, "tolerance", ColourRole.TOLERANCE),
        ReferenceLine("x", noise, "repeatability", ColourRole.QUIET, "dot"),
    )
    low, high = plot.limits("x")
    return replace(
        plot,
        x=replace(plot.x, limits=(low, max(high, 1.05) * _ROOM)),
        labels=tuple(
            replace(label, x=max(high, 1.05) * _ROOM) if label.anchor == "end" else label
            for label in plot.labels
        ),
        reference_lines=lines,
        height=bars_height(len(rows)),
    )


def bars_height(rows: int) -> float:
    """Px of a figure with so many bars."""
    return _AXIS + rows * min(max(_ROWS / max(rows, 1), _LEAST_ROW), _MOST_ROW)


#: The axis is so much longer than the bars, for their values beside them.
_ROOM = 1.02


def level_table(verdict: Verdict) -> Iterator[dict[str, str]]:
    """Every computed set with its error in tolerances, for the table below the pictures."""
    for own in () if verdict.what_if is None else verdict.what_if.sets:
        level = _level(verdict, own.effects, own.after, own.ci90, own.fraction)
        value, low, high = (
            format_interval(level.after, *level.ci90)
            if level.ci90
            else (number(level.after), "", "")
        )
        yield {
            "effects": join_words([added_words(name) for name in own.effects]),
            "error in tolerances": value,
            "90 % interval": f"{low} to {high}" if low else "",
            "gone": "" if level.fraction is None else percent(level.fraction),
        }
