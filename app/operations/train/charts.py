"""Figures of registered models: differences to one of them, held-out pulses, their errors by
factor, their training."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ....array_types import Floats
from ...common.number_format import percent
from ...common.quantities import display_of
from ...figures.figure import (
    DIMENSIONLESS,
    BarSeries,
    BoxSeries,
    ColourRole,
    LineSeries,
    Plot,
    PlotAxis,
    PlotGrid,
    PlotSeries,
    PointSeries,
    ReferenceLine,
    TextLabel,
    as_floats,
    category,
    equal_line,
)
from .searches import (
    QUARTERS,
    importance_sentence,
    parallel_axes,
    part_words,
    quarters_of,
    search_sentence,
    setting_words,
    trial_words,
)
from .wording import ERRORS, bounded

if TYPE_CHECKING:
    from ....training.evaluation.comparison import Comparison, Difference
    from ....training.tuning.trials import Importance, SettingsSearch

#: Lines of a quarter of the trials, the best first: role, opacity, width. Darker is better,
#: whatever colours a reader sees.
_SHADES = (
    (ColourRole.CATEGORY_0, 1.0, 1.6),
    (ColourRole.CATEGORY_0, 0.5, 1.2),
    (ColourRole.QUIET, 0.55, 1.0),
    (ColourRole.QUIET, 0.25, 1.0),
)
#: History of a training -> what its axis calls it, and what one of its steps is.
_HISTORIES = {
    "loss": ("loss", "step of the training"),
    "search_best": ("best score so far", "generation of the search"),
    "candidates_evaluated": ("candidates tried", "generation of the search"),
}
#: Height (px) of one axis of a search with its title and ticks, of its margins, of a bar, and of a
#: version.
_AXIS_HEIGHT, _MARGINS, _BAR_HEIGHT, _ROW_HEIGHT = 72, 40, 40, 30


def difference_figure(rows: Sequence[Mapping[str, Any]], reference: str, metric: str) -> Plot:
    """Mean error of each version minus that of `reference`, with its 90 % interval and a line at
    zero (a forest plot).

    `rows` as `differences_to` gives them. Differences of relative errors are in percentage points.
    """
    relative = metric != "cost"
    scale = 100.0 if relative else 1.0
    series = []
    for beyond, name, role in (
        (True, "beyond chance", ColourRole.CATEGORY_1),
        (False, "may be chance", ColourRole.QUIET),
    ):
        chosen = [(i, row) for i, row in enumerate(rows) if row["beyond_chance"] == beyond]
        if not chosen:
            continue
        mean = as_floats([row["difference"] * scale for _, row in chosen])
        ends = [row["ci90"] or (row["difference"], row["difference"]) for _, row in chosen]
        places = as_floats([i for i, _ in chosen])
        series.append(_within(mean, places, ends, scale, name, role))
    versions = tuple(row["label"] for row in rows)
    return Plot(
        f"Difference to {reference}",
        PlotAxis(f"difference to {reference}", "% points" if relative else DIMENSIONLESS),
        PlotAxis("version", categories=versions or (reference,), reversed=True),
        tuple(series),
        (ReferenceLine("x", 0.0, role=ColourRole.INK, dash="solid"),),
        height=max(180.0, 90.0 + _ROW_HEIGHT * len(versions)),
    )


def _within(
    mean: Floats,
    places: Floats,
    ends: Sequence[Sequence[float]],
    scale: float,
    name: str,
    role: ColourRole,
) -> PointSeries:
    low, high = (scale * as_floats([pair[side] for pair in ends]) for side in (0, 1))
    return PointSeries(
        mean,
        places,
        x_low=np.minimum(low, mean),
        x_high=np.maximum(high, mean),
        name=name,
        role=role,
    )


def difference_series(
    rows: Sequence[Difference], scales: Sequence[float] = ()
) -> tuple[PointSeries, ...]:
    """Differences of two models with their 90 % intervals, a row each from the top; those that may
    be chance are rings. `scales` multiply the rows."""
    factors = as_floats(scales or [1.0] * len(rows))
    series = []
    for beyond, name in ((True, "beyond chance"), (False, "may be chance")):
        chosen = [i for i, row in enumerate(rows) if row.beyond_chance == beyond]
        if not chosen:
            continue
        mean, low, high = (
            factors[chosen] * as_floats([getattr(rows[i], key) for i in chosen])
            for key in ("difference", "low", "high")
        )
        series.append(
            PointSeries(
                mean,
                as_floats(chosen),
                x_low=low,
                x_high=high,
                filled=beyond,
                name=name,
                role=ColourRole.CATEGORY_1 if beyond else ColourRole.QUIET,
            )
        )
    return tuple(series)


def differences_to(
    reference: str, differences: Sequence[Mapping[str, Any]], metric: str
) -> list[dict[str, Any]]:
    """Of pairs as `side_by_side` gives them those with `reference`, as the other's mean error minus
    the reference's."""
    rows = []
    for row in differences:
        if row["metric"] != metric or reference not in (row["a"], row["b"]):
            continue
        sign = -1.0 if row["a"] == reference else 1.0
        ends = sorted(sign * end for end in row["ci90"]) if row["ci90"] else None
        rows.append(
            {
                "label": row["b"] if row["a"] == reference else row["a"],
                "difference": sign * row["difference"],
                "ci90": ends,
                "beyond_chance": row["p_value"] is not None and row["p_value"] < 0.05,
            }
        )
    return sorted(rows, key=lambda row: float(row["difference"]))


def history_figure(rows: Sequence[Mapping[str, Any]], metric: str = "force_nrmse") -> Plot | None:
    """The error of each version of a model, a line for each split; None where there is one version
    only."""
    rated = sorted(
        (row for row in rows if row["metrics"][metric]["mean"] is not None),
        key=lambda row: row["version"],
    )
    if len(rated) < 2:
        return None
    series: list[PlotSeries] = []
    for i, split in enumerate(dict.fromkeys(row["split"] for row in rated)):
        places = [place for place, row in enumerate(rated) if row["split"] == split]
        means = [rated[place]["metrics"][metric]["mean"] for place in places]
        ends = [
            bounded(rated[place]["metrics"][metric]["ci90"]) or [mean, mean]
            for place, mean in zip(places, means, strict=True)
        ]
        x, y = as_floats(places), 100 * as_floats(means)
        low, high = (100 * as_floats([pair[side] for pair in ends]) for side in (0, 1))
        series += [
            LineSeries(x, y, name=split, role=category(i), silent=True),
            PointSeries(
                x,
                y,
                y_low=np.minimum(low, y),
                y_high=np.maximum(high, y),
                labels=tuple(f"dataset {rated[place]['dataset']}" for place in places),
                name=split,
                role=category(i),
            ),
        ]
    versions = PlotAxis("", categories=tuple(row["label"] for row in rated))
    error = PlotAxis(ERRORS[metric], "%", from_zero=True)
    return Plot("Errors of the versions", versions, error, tuple(series))


def training_figures(histories: Mapping[str, Sequence[tuple[int, float]]]) -> dict[str, Plot]:
    """A figure for each history of a training over its steps, by its sentence. Errors of trials
    have figures of their own (`search_figure`): they follow no curve."""
    figures = {}
    for name, values in histories.items():
        of_part, _, quantity = name.rpartition(".")
        if len(values) < 2 or quantity == "search_error":
            continue
        steps, heights = (as_floats(column) for column in zip(*values, strict=True))
        words, step = _HISTORIES.get(quantity, (quantity.replace("_", " "), "step of the training"))
        sentence = f"Learning curve of {part_words(of_part)}: {words} after each {step}"
        axes = PlotAxis(step, DIMENSIONLESS, whole=True), PlotAxis(words, DIMENSIONLESS)
        figures[sentence] = Plot(sentence, *axes, (LineSeries(steps, heights, detail=words),))
    return figures


def search_figure(search: SettingsSearch) -> Plot:
    """Parallel coordinates of the trials of a search: a row for each setting and one for the score,
    a line for each trial, by the quarter of its score; the best trial stands out."""
    axes, quarters = parallel_axes(search), quarters_of(search)
    best = min(range(len(search.trials)), key=lambda index: search.trials[index].score)
    series = []
    for quarter in range(len(QUARTERS) - 1, -1, -1):
        chosen = [index for index, own in enumerate(quarters) if own == quarter and index != best]
        if chosen:
            series.append(_trial_lines(search, chosen, QUARTERS[quarter], *_SHADES[quarter]))
    series.append(_trial_lines(search, [best], "best trial", ColourRole.CATEGORY_1, 1.0, 3.5))
    labels = []
    for row, axis in enumerate(axes):
        labels.append(TextLabel(axis.title, 0.0, row, "start", above=True, role=ColourRole.INK))
        labels += [_tick(row, place, word) for place, word in axis.ticks]
    return Plot(
        "Trials of the search",
        PlotAxis("", DIMENSIONLESS, limits=(-0.04, 1.04), hidden=True),
        PlotAxis("", DIMENSIONLESS, limits=(-0.55, len(axes) - 0.4), reversed=True, hidden=True),
        tuple(series),
        tuple(
            ReferenceLine("y", row, role=ColourRole.INK, dash="solid") for row in range(len(axes))
        ),
        labels=tuple(labels),
        height=_AXIS_HEIGHT * len(axes) + _MARGINS,
    )


def _tick(row: int, place: float, word: str) -> TextLabel:
    """Words below an axis, which the edges of the chart do not cut."""
    anchor = "start" if place < 0.1 else "end" if place > 0.9 else "middle"
    return TextLabel(word, place, row, anchor, above=False)  # type: ignore[arg-type]


def _trial_lines(
    search: SettingsSearch,
    chosen: Sequence[int],
    name: str,
    role: ColourRole,
    opacity: float,
    width: float,
) -> LineSeries:
    """One series for the lines of some trials, with a gap after each."""
    axes = parallel_axes(search)
    places = [place for index in chosen for place in (*(axis.places[index] for axis in axes), None)]
    rows = [row for _ in chosen for row in (*range(len(axes)), None)]
    words = [trial_words(search, index) for index in chosen for _ in range(len(axes) + 1)]
    return LineSeries(
        as_floats(places),
        as_floats(rows),
        width=width,
        labels=tuple(words),
        name=name,
        role=role,
        opacity=opacity,
    )


def importance_figure(importance: Importance) -> Plot:
    """A bar for each searched setting: its share of the importance in per cent."""
    shares = 100 * as_floats(list(importance.shares.values()))
    bars = BarSeries(
        np.arange(len(shares), dtype=np.float64), shares, horizontal=True, detail="importance"
    )
    names = tuple(setting_words(name) for name in importance.shares)
    return Plot(
        "Importance of the settings",
        PlotAxis("share of the importance", "%"),
        PlotAxis("", categories=names, reversed=True),
        (bars,),
        height=_BAR_HEIGHT * len(names) + 70,
    )


_PEAK_ERROR = PlotAxis("error of the peak force", "%")
#: Pulses below which a box of quartiles would show more than was measured.
_FEWEST_OF_A_BOX = 5


def residual_figures(residuals: Mapping[str, Any]) -> dict[str, Plot]:
    """Errors of the peak force by the levels of the factors, and over the impact velocity
    (`figures.residual_columns`)."""
    error = 100 * as_floats(residuals["peak_force_error"])
    figures = {}
    names: list[str] = []
    series: list[PlotSeries] = []
    for i, (factor, labels) in enumerate(residuals["factors"].items()):
        levels = list(dict.fromkeys(labels))
        samples = [error[[label == level for label in labels]] for level in levels]
        label = display_of(factor).label
        series += _of_levels(len(names), samples, label, category(i))
        names += [f"{label}: {level}" for level in levels]
    if series:
        levels_axis = PlotAxis("", categories=tuple(names))
        title = "Error of the peak force by level"
        figures["by the levels of the factors"] = Plot(
            title, levels_axis, _PEAK_ERROR, tuple(series)
        )
    tips = residuals["tip_material"]
    velocity = as_floats(residuals["impact_velocity_m_s"])
    points = [
        PointSeries(velocity[chosen], error[chosen], name=str(tip), role=category(i))
        for i, (tip, chosen) in enumerate(_by_label(tips))
    ]
    shown = display_of("impact_velocity_m_s")
    axis = PlotAxis(shown.label, shown.unit)
    title = f"Error of the peak force over {shown.label}"
    figures[f"over the {shown.label}"] = Plot(title, axis, _PEAK_ERROR, tuple(points))
    return figures


def _of_levels(
    first: int, samples: Sequence[Floats], name: str, role: ColourRole
) -> list[PlotSeries]:
    """A box for each level with enough pulses for quartiles, from place `first` on; the pulses
    themselves of a level with fewer."""
    with_box = [place for place, values in enumerate(samples) if len(values) >= _FEWEST_OF_A_BOX]
    alone = [place for place in range(len(samples)) if place not in with_box]
    series: list[PlotSeries] = []
    if with_box:
        places = first + as_floats(with_box)
        boxes = tuple(samples[place] for place in with_box)
        series.append(BoxSeries(places, boxes, name=name, role=role))
    if alone:
        places = np.concatenate([np.full(len(samples[place]), first + place) for place in alone])
        values = np.concatenate([samples[place] for place in alone])
        series.append(PointSeries(as_floats(places), values, name=name, role=role))
    return series


def _by_label(labels: Sequence[Any]) -> list[tuple[Any, list[int]]]:
    """Labels in the order of their first row, with their rows."""
    return [
        (label, [row for row, own in enumerate(labels) if own == label])
        for label in dict.fromkeys(labels)
    ]


def against_figure(held_out: Mapping[str, Any], quantity: str) -> Plot:
    """Predicted over measured of held-out pulses, by tip material (`figures.held_out_figures`)."""
    columns = held_out["points"]
    display = display_of(quantity)
    values = columns[quantity]
    measured, predicted = (
        display.scale * as_floats(values[key]) for key in ("measured", "predicted")
    )
    low = high = None
    if values["low"] is not None:
        high = display.scale * as_floats(values["high"])
        # neither a force nor a time is negative
        low = np.maximum(np.minimum(2 * predicted - high, predicted), np.minimum(0.0, predicted))
    points = [
        PointSeries(
            measured[rows],
            predicted[rows],
            y_low=None if low is None else low[rows],
            y_high=None if high is None else high[rows],
            name=str(tip),
            role=category(i),
        )
        for i, (tip, rows) in enumerate(_by_label(columns["tip_material"]))
    ]
    x, y = (
        PlotAxis(f"{word} {display.label}", display.unit or DIMENSIONLESS)
        for word in ("measured", "predicted")
    )
    title = f"Predicted over measured {display.label}"
    return Plot(title, x, y, (*points, equal_line("", measured, predicted)))


def coverage_figure(held_out: Mapping[str, Any]) -> Plot | None:
    """Share of held-out points within their intervals over the nominal share; None for a model
    without spread."""
    coverage = held_out["coverage"]
    level = as_floats(coverage["level"])
    series: list[PlotSeries] = []
    for i, (key, name) in enumerate((("force", "force"), ("time", "contact time"))):
        if coverage[key] is None:
            continue
        held = as_floats(coverage[key])
        pairs = coverage.get(f"{key}_ci90") or [None] * len(held)
        ends = [pair or (share, share) for pair, share in zip(pairs, held.tolist(), strict=True)]
        low, high = (as_floats([pair[side] for pair in ends]) for side in (0, 1))
        # beside each other, so that intervals of both quantities are seen
        places = level + (0.004 if i else -0.004)
        series += [
            LineSeries(places, held, name=name, role=category(i), silent=True),
            PointSeries(
                places,
                held,
                y_low=np.minimum(low, held),
                y_high=np.maximum(high, held),
                labels=tuple(percent(share) for share in level.tolist()),
                name=name,
                role=category(i),
            ),
        ]
    if not series:
        return None
    stated = equal_line("as stated", as_floats([0.4, 1.0]))
    nominal = PlotAxis("nominal share", DIMENSIONLESS)
    within = PlotAxis("share of the held-out points within", DIMENSIONLESS)
    return Plot("Coverage of the intervals", nominal, within, (stated, *series))


def comparison_figure(comparison: Comparison, metric: str = "force_nrmse") -> PlotGrid:
    """Left, all metrics over all pulses; right, `metric` by group. In per cent of b's mean error,
    with 90 % intervals; by group, chance is corrected for the number of groups."""
    groups = [row for row in comparison.by_group if row.metric == metric]
    names = [METRIC_NAMES[row.metric] for row in comparison.overall]
    plots = [_percent_plot("all held-out pulses", comparison.overall, names)]
    if groups:
        labels = [
            f"{row.group[0]}: {row.group[1]}".replace("_", " ") for row in groups if row.group
        ]
        plots.append(_percent_plot(f"{METRIC_NAMES[metric]}, by group", groups, labels))
    title = f"Error of {comparison.a} minus that of {comparison.b}"
    note = f"To the left of the line {comparison.a} is better, to the right {comparison.b}."
    return PlotGrid(title, (tuple(plots),), notes=(note,))


def _percent_plot(title: str, rows: Sequence[Difference], names: Sequence[str]) -> Plot:
    """An error is never negative, so that none is smaller by more than the whole other one."""
    rows = [replace(row, low=max(row.low, -row.mean_b)) for row in rows]
    scales = [100 / row.mean_b if row.mean_b > 0 else np.nan for row in rows]
    return Plot(
        title,
        PlotAxis("difference, of the latter's error", "%"),
        PlotAxis("", categories=tuple(names), reversed=True),
        difference_series(rows, scales),
        (ReferenceLine("x", 0.0, role=ColourRole.INK, dash="solid"),),
        height=110 + _ROW_HEIGHT * len(rows),
    )


#: Names of metrics; all are means over pulses.
METRIC_NAMES = {
    "force_rmse_n": "force RMSE",
    "force_nrmse": "force NRMSE",
    "contact_time_error": "contact time error",
    "cost": "cost",
    "peak_force_error": "peak force error",
    "compression_time_error": "compression time error",
    "impulse_error": "impulse error",
    "compression_impulse_error": "compression impulse error",
}


def searches_figure(searches: Mapping[str, SettingsSearch]) -> PlotGrid:
    """Trials on parallel axes beside the importance of the settings, a row for each search."""
    rows, notes = [], []
    for name, search in searches.items():
        notes.append(search_sentence(name, search))
        bars = None if search.importance is None else importance_figure(search.importance)
        if bars is None:
            notes.append(importance_sentence(search))
        rows.append((search_figure(search), bars))
    return PlotGrid("Searches for settings", tuple(rows), notes=tuple(notes))
