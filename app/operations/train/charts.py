"""Charts of registered models: differences to one of them, held-out pulses, their errors by factor,
their training."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ...common.quantities import display_of
from ...figures.plotly_base import COLOURS, Figure, Trace, categories, figure, line, points, spelled
from .searches import (
    QUARTERS,
    Importance,
    parallel_axes,
    part_words,
    quarters_of,
    setting_words,
    trial_words,
)
from .wording import ERRORS, bounded

if TYPE_CHECKING:
    from ....training.tuning.trials import SettingsSearch

#: Lines of a quarter of the trials, the best first: darker is better, whatever colours a reader
#: sees.
_SHADES = (("c0", 1.6), ("c0/0.5", 1.2), ("quiet/0.55", 1.0), ("quiet/0.25", 1.0))
#: History of a training -> what its axis calls it, and what one of its steps is.
_HISTORIES = {
    "loss": ("loss", "step of the training"),
    "search_best": ("best score so far", "generation of the search"),
    "candidates_evaluated": ("candidates tried", "generation of the search"),
}
#: Height (px) of one axis of a search with its title and ticks, and of its legend.
_AXIS_HEIGHT, _LEGEND_HEIGHT = 72, 130


def difference_figure(rows: Sequence[Mapping[str, Any]], reference: str, metric: str) -> Figure:
    """Mean error of each version minus that of `reference`, with its 90 % interval and a line at
    zero (a forest plot).

    `rows` as `differences_to` gives them. Differences of relative errors are in percentage points.
    """
    relative = metric != "cost"
    scale = 100.0 if relative else 1.0
    traces = []
    for beyond, name, colour in ((True, "beyond chance", "c1"), (False, "may be chance", "quiet")):
        chosen = [row for row in rows if row["beyond_chance"] == beyond]
        if not chosen:
            continue
        means = [row["difference"] * scale for row in chosen]
        ends = [row["ci90"] or (row["difference"], row["difference"]) for row in chosen]
        trace = points(means, [0.0] * len(means), name, colour)
        trace["y"] = [row["label"] for row in chosen]
        trace["error_x"] = {
            "type": "data",
            "symmetric": False,
            "array": [
                max(0.0, end[1] * scale - mean) for end, mean in zip(ends, means, strict=True)
            ],
            "arrayminus": [
                max(0.0, mean - end[0] * scale) for end, mean in zip(ends, means, strict=True)
            ],
            "color": colour,
        }
        traces.append(trace)
    unit = " (% points)" if relative else ""
    zero = {
        "type": "line",
        "x0": 0,
        "x1": 0,
        "yref": "paper",
        "y0": 0,
        "y1": 1,
        "line": {"color": "ink", "width": 1},
    }
    chart = figure(traces, f"difference to {reference}{unit}", "", shapes=[zero])
    chart["layout"]["yaxis"] = {"type": "category", "autorange": "reversed"}
    chart["layout"]["yaxis"] |= {
        "categoryorder": "array",
        "categoryarray": [row["label"] for row in rows],
    }
    return chart


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


def history_figure(rows: Sequence[Mapping[str, Any]], metric: str = "force_nrmse") -> Figure | None:
    """The error of each version of a model, a line for each split; None where there is one version
    only."""
    rated = sorted(
        (row for row in rows if row["metrics"][metric]["mean"] is not None),
        key=lambda row: row["version"],
    )
    if len(rated) < 2:
        return None
    traces = []
    for i, split in enumerate(dict.fromkeys(row["split"] for row in rated)):
        of_split = [row for row in rated if row["split"] == split]
        means = [100 * row["metrics"][metric]["mean"] for row in of_split]
        ends = [
            bounded(row["metrics"][metric]["ci90"]) or [mean / 100] * 2
            for row, mean in zip(of_split, means, strict=True)
        ]
        colour = COLOURS[i % len(COLOURS)]
        trace = points([0.0] * len(means), means, split, colour, mode="lines+markers")
        trace["x"] = [row["label"] for row in of_split]
        trace["text"] = [f"dataset {row['dataset']}" for row in of_split]
        trace["error_y"] = {
            "type": "data",
            "symmetric": False,
            "array": [max(0.0, 100 * end[1] - mean) for end, mean in zip(ends, means, strict=True)],
            "arrayminus": [
                max(0.0, mean - 100 * end[0]) for end, mean in zip(ends, means, strict=True)
            ],
            "color": colour,
        }
        traces.append(trace)
    chart = categories(traces, "", f"{ERRORS[metric]} (%)", showlegend=True)
    chart["layout"]["xaxis"] |= {
        "categoryorder": "array",
        "categoryarray": [row["label"] for row in rated],
    }
    chart["layout"]["yaxis"]["rangemode"] = "tozero"
    return chart


def training_figures(histories: Mapping[str, Sequence[tuple[int, float]]]) -> dict[str, Figure]:
    """A chart for each history of a training over its steps, by its sentence. Errors of trials have
    charts of their own (`search_figure`): they follow no curve."""
    charts = {}
    for name, values in histories.items():
        of_part, _, quantity = name.rpartition(".")
        if len(values) < 2 or quantity == "search_error":
            continue
        steps, heights = zip(*values, strict=True)
        words, step = _HISTORIES.get(quantity, (quantity.replace("_", " "), "step of the training"))
        sentence = f"Learning curve of {part_words(of_part)}: {words} after each {step}"
        charts[sentence] = figure([line(steps, heights, words)], step, words)
    return charts


def search_figure(search: SettingsSearch) -> Figure:
    """Parallel coordinates of the trials of a search: a row for each setting and one for the score,
    a line for each trial, by the quarter of its score; the best trial stands out."""
    axes, quarters = parallel_axes(search), quarters_of(search)
    best = min(range(len(search.trials)), key=lambda index: search.trials[index].score)
    traces = []
    for quarter in range(len(QUARTERS) - 1, -1, -1):
        chosen = [index for index, own in enumerate(quarters) if own == quarter and index != best]
        if chosen:
            colour, width = _SHADES[quarter]
            traces.append(
                _trial_lines(search, chosen, QUARTERS[quarter], colour, width)
                | {"legendrank": quarter + 2}
            )
    traces.append(_trial_lines(search, [best], "best trial", "c1", 3.5) | {"legendrank": 1})
    shapes = [
        {
            "type": "line",
            "x0": 0,
            "x1": 1,
            "y0": row,
            "y1": row,
            "line": {"color": "ink", "width": 1},
        }
        for row in range(len(axes))
    ]
    words = []
    for row, axis in enumerate(axes):
        title = {
            "x": 0,
            "y": row,
            "text": spelled(axis.title),
            "xanchor": "left",
            "yanchor": "bottom",
            "yshift": 3,
        }
        words.append(title | {"showarrow": False, "bgcolor": "card/0.75", "font": {"color": "ink"}})
        words += [_tick(row, place, word) for place, word in axis.ticks]
    chart = figure(
        traces,
        "",
        "",
        shapes=shapes,
        annotations=words,
        height=_AXIS_HEIGHT * len(axes) + _LEGEND_HEIGHT,
    )
    hidden = {
        "showticklabels": False,
        "showgrid": False,
        "zeroline": False,
        "showline": False,
        "fixedrange": True,
    }
    chart["layout"]["xaxis"] |= hidden | {"range": [-0.04, 1.04]}
    chart["layout"]["yaxis"] |= hidden | {"range": [len(axes) - 0.4, -0.55]}
    chart["layout"]["margin"] = {"l": 12, "r": 12, "t": 16, "b": 16}
    return chart


def _tick(row: int, place: float, word: str) -> dict[str, Any]:
    """Words below an axis, which the edges of the chart do not cut."""
    anchor = "left" if place < 0.1 else "right" if place > 0.9 else "center"
    tick = {
        "x": place,
        "y": row,
        "text": spelled(word),
        "xanchor": anchor,
        "yanchor": "top",
        "yshift": -2,
    }
    return tick | {
        "showarrow": False,
        "bgcolor": "card/0.75",
        "font": {"color": "quiet", "size": 12},
    }


def _trial_lines(
    search: SettingsSearch, chosen: Sequence[int], name: str, colour: str, width: float
) -> Trace:
    """One trace for the lines of some trials, with a gap after each."""
    axes = parallel_axes(search)
    places = [place for index in chosen for place in (*(axis.places[index] for axis in axes), None)]
    rows = [row for _ in chosen for row in (*range(len(axes)), None)]
    words = [trial_words(search, index) for index in chosen for _ in range(len(axes) + 1)]
    style = {"color": colour, "width": width}
    return {
        "type": "scatter", "mode": "lines", "x": places, "y": rows, "name": name, "line": style,
        "text": words,
        "hoverinfo": "text",
    }  # fmt: skip


def importance_figure(importance: Importance) -> Figure:
    """A bar for each searched setting: its share of the importance in per cent."""
    shares = list(importance.shares.values())
    bars = {
        "type": "bar",
        "orientation": "h",
        "x": [100 * share for share in shares],
        "y": list(range(len(shares))),
    }
    words = [
        {
            "x": 0,
            "y": row - 0.16,
            "text": spelled(setting_words(name)),
            "xanchor": "left",
            "yanchor": "bottom",
        }
        | {"showarrow": False, "font": {"color": "ink"}}
        for row, name in enumerate(importance.shares)
    ]
    trace = bars | {"name": "importance", "width": 0.3, "marker": {"color": "c0"}, "hoverinfo": "x"}
    chart = figure(
        [trace], "share of the importance (%)", "", annotations=words, height=56 * len(shares) + 90
    )
    chart["layout"]["xaxis"]["rangemode"] = "tozero"
    chart["layout"]["yaxis"] |= {"showticklabels": False, "showgrid": False, "zeroline": False}
    chart["layout"]["yaxis"] |= {"range": [len(shares) - 0.6, -0.8]}
    chart["layout"]["margin"] = {"l": 16, "r": 16, "t": 16, "b": 52}
    return chart


def residual_figures(residuals: Mapping[str, Any]) -> dict[str, Figure]:
    """Errors of the peak force by the levels of the factors, and over the impact velocity
    (`residual_columns`)."""
    error = [100 * value for value in residuals["peak_force_error"]]
    boxes = []
    for i, (factor, labels) in enumerate(residuals["factors"].items()):
        name = display_of(factor).label
        boxes.append(
            {
                "type": "box",
                "x": [f"{name}: {label}" for label in labels],
                "y": error,
                "name": name,
                "boxpoints": "all",
                "jitter": 0.4,
                "pointpos": 0,
                "marker": {"color": COLOURS[i % len(COLOURS)], "size": 4},
                "line": {"color": COLOURS[i % len(COLOURS)]},
            }
        )
    title = "error of the peak force (%)"
    charts = {"by the levels of the factors": categories(boxes, "", title)} if boxes else {}
    tips = residuals["tip_material"]
    traces = []
    for i, tip in enumerate(dict.fromkeys(tips)):
        rows = [row for row, label in enumerate(tips) if label == tip]
        velocity = [residuals["impact_velocity_m_s"][row] for row in rows]
        traces.append(
            points(velocity, [error[row] for row in rows], str(tip), COLOURS[i % len(COLOURS)])
        )
    shown = display_of("impact_velocity_m_s")
    charts[f"over the {shown.label}"] = figure(traces, shown.heading, title)
    return charts


def against_figure(held_out: Mapping[str, Any], quantity: str) -> Figure:
    """Predicted over measured of held-out pulses, by tip material (`figures.held_out_figures`)."""
    columns = held_out["points"]
    display = display_of(quantity)
    name, scale = display.heading, display.scale
    values, tips = columns[quantity], columns["tip_material"]
    traces = []
    for i, tip in enumerate(dict.fromkeys(tips)):
        places = [place for place, label in enumerate(tips) if label == tip]
        measured, predicted = (
            [values[key][place] * scale for place in places] for key in ("measured", "predicted")
        )
        trace = points(measured, predicted, str(tip), COLOURS[i % len(COLOURS)])
        if values["low"] is not None:
            wide = [
                (values["high"][place] - values["predicted"][place]) * scale for place in places
            ]
            trace["error_y"] = {
                "type": "data",
                "symmetric": False,
                "array": wide,
                # neither a force nor a time is negative
                "arrayminus": [
                    min(width, max(0.0, mean)) for width, mean in zip(wide, predicted, strict=True)
                ],
                "color": f"{COLOURS[i % len(COLOURS)]}/0.4",
                "thickness": 1,
            }
        traces.append(trace)
    every = [value * scale for key in ("measured", "predicted") for value in values[key]]
    ends = [min(every), max(every)]
    traces.append(line(ends, ends, "measured", "quiet", dash="dash", showlegend=False))
    return figure(traces, f"measured {name}", f"predicted {name}")


def coverage_figure(held_out: Mapping[str, Any]) -> Figure | None:
    """Share of held-out points within their intervals over the nominal share; None for a model
    without spread."""
    coverage = held_out["coverage"]
    traces = [
        points(coverage["level"], coverage[key], name, colour, mode="lines+markers")
        for key, name, colour in (("force", "force", "c0"), ("time", "contact time", "c1"))
        if coverage[key] is not None
    ]
    if not traces:
        return None
    promised = line([0.4, 1], [0.4, 1], "as stated", "quiet", dash="dash")
    return figure([promised, *traces], "nominal share", "share of the held-out points within")
