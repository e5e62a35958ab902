"""The pictures of a diagnosis: residuals before and after with the floor shaded, records beside
their simulation; the path of the error as a waterfall, and each effect's share with its interval.

Bars are horizontal with the name above, so that they are readable on a telephone, too. Drawn of the
elements and classes that `documents.pdf` knows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from ....array_types import Floats
from ....diagnosis.verdict import CORRECTED, CurvePicture, Pictures, ResidualPicture, Verdict
from ...common.number_format import join_words, number, percent, percent_with_range
from ...common.quantities import shown_unit
from ...documents.svg import WIDTH, band, chart, dots, frame_of, level, line, tick_text, ticks
from .wording import effect_subject, observable_label

#: The floor is shaded to so many standard deviations.
SIGMAS = 2.0
_LARGEST_LOG = 20.0


def residual_title(picture: ResidualPicture) -> str:
    """The physical name of an observable, and its stage."""
    return f"{observable_label(picture.name).text} ({picture.stage})"


def residual_chart(picture: ResidualPicture, configurations: tuple[str, ...]) -> str:
    """Residuals over the configurations; those of logarithms as per cent of the simulated value."""
    count = picture.before.size
    label = observable_label(picture.name)
    x = np.arange(1, count + 1, dtype=np.float64)
    names = (
        configurations
        if len(configurations) == count
        else tuple(f"configuration {i}" for i in range(1, count + 1))
    )
    ends = np.array([0.5, count + 0.5])
    shade = SIGMAS * picture.floor
    # the first and last floors reach to the edges of the frame
    edges = np.concatenate([ends[:1], x, ends[1:]])
    wide = np.concatenate([shade[:1], shade, shade[-1:]])

    unit, scale = shown_unit(picture.unit)

    def shown(residuals: Floats) -> Floats:
        return _in_percent(residuals) if label.relative else scale * residuals

    low, high, room = (
        shown(-wide),
        shown(wide),
        shown(np.array([-picture.tolerance, picture.tolerance])),
    )
    before = shown(picture.before)
    after = [] if picture.after is None else [shown(picture.after)]
    frame = frame_of([ends], [before, *after, low, high, room])
    marks = [
        band(frame, edges, low, high, "floor"),
        level(frame, 0.0, "zero"),
        *(level(frame, float(value), "tolerance") for value in room),
        dots(frame, x, before, "before", names),
        *(dots(frame, x, residual, "after", names) for residual in after),
    ]
    bracket = " (%)" if label.relative else "" if picture.unit == "1" else f" ({unit})"
    title = f"measured {'over' if label.relative else 'less'} simulated{bracket}"
    return chart(residual_title(picture), frame, marks, "configuration", title, whole=True)


def _in_percent(logarithms: Floats) -> Floats:
    """By how many per cent measured exceeds simulated; logarithms that no bench reaches are drawn
    at the edge."""
    return np.asarray(100 * np.expm1(np.clip(logarithms, -_LARGEST_LOG, _LARGEST_LOG)))


def curve_chart(picture: CurvePicture) -> str:
    """A record, and its simulation before and after."""
    (x_unit, x_scale), (y_unit, y_scale) = shown_unit(picture.x_unit), shown_unit(picture.y_unit)
    x = x_scale * picture.x
    curves = {"before": picture.before, "after": picture.after, "measured": picture.measured}
    shown = {f"{kind}-line": y_scale * y for kind, y in curves.items() if y is not None}
    frame = frame_of(
        [x], list(shown.values()), log_x=picture.logarithmic, log_y=picture.logarithmic
    )
    marks = [line(frame, x, y, kind) for kind, y in shown.items()]
    titles = (
        f"{name} ({unit})" for name, unit in ((picture.x_name, x_unit), (picture.y_name, y_unit))
    )
    return chart(picture.title, frame, marks, *titles)


def legend_keys(pictures: Pictures) -> tuple[tuple[str, str], ...]:
    """The marks of the charts by kind, and their meaning."""
    later = [picture.after for picture in pictures.residuals] + [
        picture.after for picture in pictures.curves
    ]
    after = any(values is not None for values in later)
    keys = [("before", "nominal model")] + ([("after", "model with effects")] if after else [])
    keys += [("measured", "measured")] if pictures.curves else []
    return (
        *keys,
        ("floor", "measurement noise, two standard deviations"),
        ("tolerance", "tolerance"),
    )


#: Effects that are drawn; further ones stand in the table.
_MOST_EFFECTS = 8

_LEFT, _RIGHT, _TOP, _BOTTOM = 10.0, 12.0, 6.0, 40.0
_ROW, _TEXT, _BAR = 34.0, 12.0, 11.0
_Across = Callable[[float], float]


@dataclass(frozen=True)
class BarRow:
    """A bar from `start` to `end` in the unit of the axis; `kind` is its class. `interval` is drawn
    as a whisker."""

    name: str
    value: str
    start: float
    end: float
    kind: str
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
        BarRow("before: the nominal model", _tolerances(levels[0]), 0.0, levels[0], "bar-error")
    ]
    for step, before, after in zip(verdict.path, levels, levels[1:], strict=False):
        kind = "bar-gone" if after <= before else "bar-error"
        gone = f"{percent(step.fraction)} gone" if math.isfinite(step.fraction) else ""
        rows.append(BarRow(f"+ {_short(step.effects) or step.added}", gone, after, before, kind))
    rows.append(BarRow("what remains", _tolerances(levels[-1]), 0.0, levels[-1], "bar-error"))
    rows += _learned(verdict)
    noise = gap.noise_floor / gap.tolerance
    return (*rows, BarRow("measurement noise", _tolerances(noise), 0.0, noise, "floor"))


def _short(effects: Sequence[str]) -> str:
    """A set of effects without articles: a row has little room."""
    return join_words([effect_subject(name).removeprefix("the ") for name in effects], "or")


def _tolerances(level: float) -> str:
    return f"{number(level)} tolerances"


def _learned(verdict: Verdict) -> list[BarRow]:
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
        BarRow("with a learned correction (no cause)", _tolerances(after), 0.0, after, "bar-other")
    ]


def share_rows(verdict: Verdict) -> tuple[BarRow, ...]:
    """Shares of the squared error in per cent with their 90 % intervals: of the sets that are
    causes, of the other effects, and of what is unexplained."""
    sets = verdict.cause_sets
    members = {name for own in sets for name in own.effects}
    others = [effect for effect in verdict.effects if effect.effect not in members]
    bars = [(_short(own.effects), own.share, own.ci90, "bar-named") for own in sets]
    bars += [(_short([effect.effect]), effect.share, effect.ci90, "bar-other") for effect in others]
    effects = [bar for bar in bars if math.isfinite(bar[1])]
    rows = [_share_row(*bar) for bar in effects[:_MOST_EFFECTS]]
    if verdict.unexplained is not None and math.isfinite(verdict.unexplained.share):
        rows.append(
            _share_row(
                "unexplained", verdict.unexplained.share, verdict.unexplained.ci90, "bar-error"
            )
        )
    return tuple(rows) if effects else ()


def _share_row(name: str, share: float, ci90: tuple[float, float], kind: str) -> BarRow:
    low, high = (100 * end for end in ci90)
    drawable = math.isfinite(low + high)
    text = percent_with_range(share, ci90) if drawable else percent(share)
    return BarRow(
        name,
        text,
        min(0.0, 100 * share),
        max(0.0, 100 * share),
        kind,
        (low, high) if drawable else None,
    )


def path_chart(verdict: Verdict) -> str:
    """The waterfall as SVG; "" where there is none."""
    rows = path_rows(verdict)
    title = "model error, held out (times the tolerance)"
    return (
        _chart("Path of the model error", title, rows, connected=len(verdict.path) + 1)
        if rows
        else ""
    )


def share_chart(verdict: Verdict) -> str:
    """The shares as SVG; "" where there are none."""
    rows = share_rows(verdict)
    return (
        _chart("Shares of the effects", "share of the squared error (%), 90 % intervals", rows)
        if rows
        else ""
    )


def _chart(label: str, x_title: str, rows: Sequence[BarRow], connected: int = 0) -> str:
    """`connected`: so many of the first bars are joined to the next, where one begins at the level
    of the other."""
    values: list[float] = [
        value for row in rows for value in (row.start, row.end, *(row.interval or ()))
    ]
    low, high = min(0.0, *values), max(values)
    scale = (WIDTH - _LEFT - _RIGHT) / ((high - low) or 1.0)

    def across(value: float) -> float:
        return _LEFT + (value - low) * scale

    height = _TOP + len(rows) * _ROW + _BOTTOM
    parts = [_axis(low, high, across, height, x_title)]
    for i, row in enumerate(rows):
        top = _TOP + i * _ROW
        if i < connected:
            level = across(row.start if i else row.end)
            parts.append(
                _line("grid", level, top + _TEXT + 3, level, top + _ROW + _TEXT + 3 + _BAR)
            )
        parts.append(_row(row, across, top))
    return (
        f'<svg viewBox="0 0 {WIDTH:g} {height:g}" role="img" '
        f'aria-label="{escape(label)}">{"".join(parts)}</svg>'
    )


def _axis(low: float, high: float, across: _Across, height: float, title: str) -> str:
    bottom = height - _BOTTOM
    parts = []
    for value in ticks((low, high)):
        x = across(value)
        parts.append(_line("grid", x, _TOP, x, bottom))
        parts.append(_text("tick", x, bottom + 14, "middle", tick_text(value)))
    parts.append(_text("axis", WIDTH / 2, height - 8, "middle", title))
    return "".join(parts)


def _row(row: BarRow, across: _Across, top: float) -> str:
    y = top + _TEXT + 3
    start, right = across(row.start), max(across(row.end), across(row.start) + 1.0)
    points = (
        f"{start:.1f},{y:.1f} {right:.1f},{y:.1f} {right:.1f},{y + _BAR:.1f} "
        f"{start:.1f},{y + _BAR:.1f}"
    )
    parts = [
        _text("axis", _LEFT, top + _TEXT - 1, "start", row.name),
        _text("axis", WIDTH - _RIGHT, top + _TEXT - 1, "end", row.value),
        f'<polygon class="{row.kind}" points="{points}"/>',
    ]
    if row.interval is not None:
        ends, middle = [across(end) for end in row.interval], y + _BAR / 2
        parts.append(_line("interval", ends[0], middle, ends[1], middle))
        parts += [_line("interval", end, middle - 3, end, middle + 3) for end in ends]
    return "".join(parts)


def _line(kind: str, x1: float, y1: float, x2: float, y2: float) -> str:
    return f'<line class="{kind}" x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}"/>'


def _text(kind: str, x: float, y: float, anchor: str, words: str) -> str:
    return (
        f'<text class="{kind}" x="{x:.1f}" y="{y:.1f}" '
        f'text-anchor="{anchor}">{escape(words)}</text>'
    )
