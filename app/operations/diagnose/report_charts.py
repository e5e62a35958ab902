"""The figures of a diagnosis: residuals before and after with the noise shaded, records beside
their simulation; the path of the error as a waterfall, and each effect's share with its interval.

Bars are horizontal with the name above, so that they are readable on a telephone, too.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ....array_types import Floats
from ....diagnosis.verdict import CORRECTED, CurvePicture, ResidualPicture, Verdict
from ...common.number_format import join_words, number, percent, percent_with_range
from ...common.quantities import shown_unit
from ...figures.figure import (
    DIMENSIONLESS,
    BandSeries,
    BarSeries,
    ColourRole,
    LineSeries,
    Plot,
    PlotAxis,
    PlotSeries,
    PointSeries,
    ReferenceLine,
    TextLabel,
)
from .wording import effect_subject, observable_label, unexplained_interval

#: The noise is shaded to so many standard deviations.
SIGMAS = 2.0
_LARGEST_LOG = 20.0
_BEFORE, _AFTER, _TOLERANCE = "nominal model", "model with effects", "tolerance"


def residual_plot(picture: ResidualPicture, configurations: tuple[str, ...]) -> Plot:
    """Residuals over the configurations; those of logarithms as per cent of the simulated value."""
    count = picture.before.size
    label = observable_label(picture.name)
    x = np.arange(1, count + 1, dtype=np.float64)
    names = (
        configurations
        if len(configurations) == count
        else tuple(f"configuration {i}" for i in range(1, count + 1))
    )
    shade = SIGMAS * picture.floor
    # the first and last floors reach to the edges of the frame
    edges = np.concatenate([[0.5], x, [count + 0.5]])
    wide = np.concatenate([shade[:1], shade, shade[-1:]])
    unit, scale = ("%", 1.0) if label.relative else shown_unit(picture.unit)

    def shown(residuals: Floats) -> Floats:
        return in_percent(residuals) if label.relative else scale * residuals

    rings = PointSeries(
        name=_BEFORE,
        role=ColourRole.BEFORE,
        x=x,
        y=shown(picture.before),
        filled=False,
        labels=names,
    )
    series: list[PlotSeries] = [
        BandSeries(
            name="measurement noise, two standard deviations",
            role=ColourRole.NOISE,
            opacity=1.0,
            x=edges,
            low=shown(-wide),
            high=shown(wide),
        ),
        rings,
    ]
    if picture.after is not None:
        after = shown(picture.after)
        series.append(PointSeries(name=_AFTER, role=ColourRole.AFTER, x=x, y=after, labels=names))
    ends = shown(np.array([-picture.tolerance, picture.tolerance]))
    lines = [ReferenceLine("y", float(end), _TOLERANCE, ColourRole.TOLERANCE) for end in ends]
    return Plot(
        f"{label.text} ({picture.stage})",
        PlotAxis("configuration", DIMENSIONLESS, limits=(0.5, count + 0.5), whole=True),
        PlotAxis(f"measured {'over' if label.relative else 'less'} simulated", unit),
        tuple(series),
        (ReferenceLine("y", 0.0, dash="solid"), *lines),
    )


def in_percent(logarithms: Floats) -> Floats:
    """By how many per cent measured exceeds simulated; logarithms that no bench reaches are drawn
    at the edge."""
    return np.asarray(100 * np.expm1(np.clip(logarithms, -_LARGEST_LOG, _LARGEST_LOG)))


def curve_plot(picture: CurvePicture) -> Plot:
    """A record, and its simulation before and after."""
    (x_unit, x_scale), (y_unit, y_scale) = shown_unit(picture.x_unit), shown_unit(picture.y_unit)
    curves = (
        (_BEFORE, ColourRole.BEFORE, picture.before),
        (_AFTER, ColourRole.AFTER, picture.after),
        ("measured", ColourRole.INK, picture.measured),
    )
    series = tuple(
        LineSeries(
            name=name,
            role=role,
            x=x_scale * picture.x,
            y=y_scale * y,
            dash="dash" if role == ColourRole.BEFORE else "solid",
        )
        for name, role, y in curves
        if y is not None
    )
    x, y = (
        PlotAxis(name, unit or DIMENSIONLESS, "log" if picture.logarithmic else "linear")
        for name, unit in ((picture.x_name, x_unit), (picture.y_name, y_unit))
    )
    return Plot(picture.title.partition(", ")[0], x, y, series)


#: Effects that are drawn; further ones stand in the table.
_MOST_EFFECTS = 8


@dataclass(frozen=True)
class BarRow:
    """A bar from `start` to `end` in the unit of the axis; `interval` is drawn as a whisker."""

    name: str
    value: str
    start: float
    end: float
    role: ColourRole
    interval: tuple[float, float] | None = None


def path_rows(verdict: Verdict) -> tuple[BarRow, ...]:
    """The waterfall in tolerances: the error before, what each added effect takes where it was not
    fitted, what is left, and the measurement noise. () for a verdict without a path or with errors
    that are no numbers."""
    gap = verdict.gap
    levels = [gap.before, *(step.after for step in verdict.path)]
    if (
        not verdict.path
        or not gap.tolerance > 0
        or not all(map(math.isfinite, (*levels, gap.noise_floor)))
    ):
        return ()
    levels = [level / gap.tolerance for level in levels]
    rows = [
        BarRow(
            "before: the nominal model", _tolerances(levels[0]), 0.0, levels[0], ColourRole.BEFORE
        )
    ]
    for step, before, after in zip(verdict.path, levels, levels[1:], strict=False):
        role = ColourRole.CAUSE if after <= before else ColourRole.BEFORE
        gone = f"{percent(step.fraction)} gone" if math.isfinite(step.fraction) else ""
        rows.append(BarRow(f"+ {_short(step.effects) or step.added}", gone, after, before, role))
    rows.append(BarRow("what remains", _tolerances(levels[-1]), 0.0, levels[-1], ColourRole.BEFORE))
    rows += learned_rows(verdict)
    noise = gap.noise_floor / gap.tolerance
    return (*rows, BarRow("measurement noise", _tolerances(noise), 0.0, noise, ColourRole.NOISE))


def _short(effects: Sequence[str]) -> str:
    """A set of effects without articles: a row has little room."""
    return join_words([effect_subject(name).removeprefix("the ") for name in effects], "or")


def _tolerances(level: float) -> str:
    return f"{number(level)} tolerances"


def learned_rows(verdict: Verdict) -> list[BarRow]:
    """What is left when the learned discrepancy corrects the rest: a correction, and no cause."""
    pairs = [
        e.more[CORRECTED]
        for e in verdict.shrinkage
        if CORRECTED in e.more and e.held_out_by == "configuration"
    ]
    if not pairs or not math.isfinite(pairs[0][1]):
        return []
    after = pairs[0][1] / verdict.gap.tolerance
    return [
        BarRow(
            "with a learned correction (no cause)", _tolerances(after), 0.0, after, ColourRole.OTHER
        )
    ]


def share_rows(verdict: Verdict) -> tuple[BarRow, ...]:
    """Shares of the squared error in per cent with their 90 % intervals: of the sets that are
    causes, of the other effects, and of what is unexplained."""
    sets = verdict.cause_sets
    members = {name for own in sets for name in own.effects}
    others = [effect for effect in verdict.effects if effect.effect not in members]
    bars = [(_short(own.effects), own.share, own.ci90, ColourRole.CAUSE) for own in sets]
    bars += [
        (_short([effect.effect]), effect.share, effect.ci90, ColourRole.OTHER) for effect in others
    ]
    effects = [bar for bar in bars if math.isfinite(bar[1])]
    rows = [_share_row(*bar) for bar in effects[:_MOST_EFFECTS]]
    if verdict.unexplained is not None and math.isfinite(verdict.unexplained.share):
        rows.append(
            _share_row(
                "unexplained",
                verdict.unexplained.share,
                unexplained_interval(verdict.unexplained),
                ColourRole.BEFORE,
            )
        )
    return tuple(rows) if effects else ()


def _share_row(name: str, share: float, ci90: tuple[float, float], role: ColourRole) -> BarRow:
    low, high = (100 * end for end in ci90)
    drawable = math.isfinite(low + high)
    text = percent_with_range(share, ci90) if drawable else percent(share)
    return BarRow(
        name,
        text,
        min(0.0, 100 * share),
        max(0.0, 100 * share),
        role,
        (low, high) if drawable else None,
    )


def path_plot(verdict: Verdict) -> Plot | None:
    """The waterfall; None where there is none."""
    rows = path_rows(verdict)
    if not rows:
        return None
    return bars_plot("The path of the model error", path_axis(), rows, len(verdict.path) + 1)


def path_axis() -> PlotAxis:
    """The axis of errors along the path."""
    return PlotAxis("model error, held out, times the tolerance", DIMENSIONLESS)


def share_plot(verdict: Verdict) -> Plot | None:
    """The shares; None where there are none."""
    rows = share_rows(verdict)
    axis = PlotAxis("share of the squared error, 90 % intervals", "%")
    return bars_plot("Shares of the effects", axis, rows) if rows else None


def bars_plot(title: str, x: PlotAxis, rows: Sequence[BarRow], connected: int = 0) -> Plot:
    """`connected`: so many of the first bars are joined to the next, where one begins at the level
    of the other."""
    values = [value for row in rows for value in (row.start, row.end, *(row.interval or ()))]
    low, high = min(0.0, *values), max(values)
    ends = (low, high if high > low else low + 1.0)
    series = [*_joints(rows[:connected]), *(_bar(i, row) for i, row in enumerate(rows))]
    labels = []
    for i, row in enumerate(rows):
        y, ink = i - 0.05, ColourRole.INK
        labels.append(TextLabel(row.name, ends[0], y, "start", above=True, role=ink))
        if row.value:
            labels.append(TextLabel(row.value, ends[1], y, "end", above=True, role=ink))
    names = tuple(row.name for row in rows)
    return Plot(
        title,
        replace(x, limits=ends),
        PlotAxis("", categories=names, reversed=True, hidden=True),
        tuple(series),
        labels=tuple(labels),
    )


def _bar(place: int, row: BarRow) -> BarSeries:
    low, high = row.interval or (None, None)
    return BarSeries(
        detail=row.name,
        role=row.role,
        position=np.array([place + 0.2]),
        base=np.array([row.start]),
        end=np.array([row.end]),
        low=None if low is None else np.array([low]),
        high=None if high is None else np.array([high]),
        width=0.36,
        horizontal=True,
    )


def _joints(rows: Sequence[BarRow]) -> Iterator[LineSeries]:
    for i, row in enumerate(rows):
        level = row.start if i else row.end
        yield LineSeries(
            role=ColourRole.RULE,
            x=np.array([level, level]),
            y=np.array([i, i + 1.0]) + 0.2,
            width=1.0,
            silent=True,
        )
