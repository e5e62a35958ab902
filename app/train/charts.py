"""Charts of registered models: differences to one of them, held-out pulses, their errors by factor, their training."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..common.quantities import display_of
from ..web.figures_base import COLOURS, Figure, categories, figure, line, points
from .wording import ERRORS, bounded


def difference_figure(rows: Sequence[Mapping[str, Any]], reference: str, metric: str) -> Figure:
    """Mean error of each version minus that of `reference`, with its 90 % interval and a line at zero (a forest plot).

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
            "array": [max(0.0, end[1] * scale - mean) for end, mean in zip(ends, means, strict=True)],
            "arrayminus": [max(0.0, mean - end[0] * scale) for end, mean in zip(ends, means, strict=True)],
            "color": colour,
        }
        traces.append(trace)
    unit = " (% points)" if relative else ""
    zero = {"type": "line", "x0": 0, "x1": 0, "yref": "paper", "y0": 0, "y1": 1, "line": {"color": "ink", "width": 1}}
    chart = figure(traces, f"difference to {reference}{unit}", "", shapes=[zero])
    chart["layout"]["yaxis"] = {"type": "category", "autorange": "reversed"}
    chart["layout"]["yaxis"] |= {"categoryorder": "array", "categoryarray": [row["label"] for row in rows]}
    return chart


def differences_to(reference: str, differences: Sequence[Mapping[str, Any]], metric: str) -> list[dict[str, Any]]:
    """Of pairs as `side_by_side` gives them those with `reference`, as the other's mean error minus the reference's."""
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
    """The error of each version of a model, a line for each split; None where there is one version only."""
    rated = sorted((row for row in rows if row["metrics"][metric]["mean"] is not None), key=lambda row: row["version"])
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
            "arrayminus": [max(0.0, mean - 100 * end[0]) for end, mean in zip(ends, means, strict=True)],
            "color": colour,
        }
        traces.append(trace)
    chart = categories(traces, "", f"{ERRORS[metric]} (%)", showlegend=True)
    chart["layout"]["xaxis"] |= {"categoryorder": "array", "categoryarray": [row["label"] for row in rated]}
    chart["layout"]["yaxis"]["rangemode"] = "tozero"
    return chart


def training_figures(histories: Mapping[str, Sequence[tuple[int, float]]]) -> dict[str, Figure]:
    """A chart for each history of a training ("force loss"), over its steps."""
    return {
        name.replace(".", " ").replace("_", " "): figure(
            [line([step for step, _ in values], [value for _, value in values], name)],
            "step of the training",
            name.rpartition(".")[2].replace("_", " "),
        )
        for name, values in histories.items()
        if len(values) > 1
    }


def residual_figures(residuals: Mapping[str, Any]) -> dict[str, Figure]:
    """Errors of the peak force by the levels of the factors, and over the impact velocity (`residual_columns`)."""
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
        traces.append(points(velocity, [error[row] for row in rows], str(tip), COLOURS[i % len(COLOURS)]))
    charts["over the impact velocity"] = figure(traces, display_of("impact_velocity_m_s").heading, title)
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
        measured, predicted = ([values[key][place] * scale for place in places] for key in ("measured", "predicted"))
        trace = points(measured, predicted, str(tip), COLOURS[i % len(COLOURS)])
        if values["low"] is not None:
            wide = [(values["high"][place] - values["predicted"][place]) * scale for place in places]
            trace["error_y"] = {
                "type": "data",
                "symmetric": False,
                "array": wide,
                # neither a force nor a time is negative
                "arrayminus": [min(width, max(0.0, mean)) for width, mean in zip(wide, predicted, strict=True)],
                "color": f"{COLOURS[i % len(COLOURS)]}/0.4",
                "thickness": 1,
            }
        traces.append(trace)
    every = [value * scale for key in ("measured", "predicted") for value in values[key]]
    ends = [min(every), max(every)]
    traces.append(line(ends, ends, "measured", "quiet", dash="dash", showlegend=False))
    return figure(traces, f"measured {name}", f"predicted {name}")


def coverage_figure(held_out: Mapping[str, Any]) -> Figure | None:
    """Share of held-out points within their intervals over the nominal share; None for a model without spread."""
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
