"""Charts of models: errors side by side, predicted against measured, coverage of intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..table_format import HEADINGS
from .base import COLOURS, Figure, categories, figure, line, points


def errors_figure(rows: Sequence[Mapping[str, Any]], metric: str) -> Figure:
    """One metric of versions with its 90 % interval, and the thesis's figure where there is one (`version_row`)."""
    rated = [row for row in rows if row["metrics"][metric]["mean"] is not None]
    means = [row["metrics"][metric]["mean"] for row in rated]
    ends = [row["metrics"][metric]["ci90"] or (mean, mean) for row, mean in zip(rated, means, strict=True)]
    high = [max(0.0, (end[1] or mean) - mean) for end, mean in zip(ends, means, strict=True)]
    low = [max(0.0, mean - (end[0] or mean)) for end, mean in zip(ends, means, strict=True)]
    bars = {
        "type": "bar",
        "x": [f"{row['label']} ({row['split']})" for row in rated],
        "y": means,
        "name": "mean with 90 % interval",
        "marker": {"color": "c0"},
        "error_y": {"type": "data", "symmetric": False, "array": high, "arrayminus": low, "color": "quiet"},
    }
    thesis = [row["metrics"][metric]["thesis"] for row in rated]
    marks = {**points([], [], "thesis", "c1"), "x": bars["x"], "y": thesis}
    traces = [bars, marks] if any(value is not None for value in thesis) else [bars]
    return categories(traces, "", metric.replace("_", " "))


def against_figure(found: Mapping[str, Any], quantity: str) -> Figure:
    """Predicted over measured of held-out pulses, by tip material (`model_figures.held_out_figures`)."""
    columns = found["points"]
    name, scale = HEADINGS[quantity]
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
                "array": wide,
                "color": f"{COLOURS[i % len(COLOURS)]}/0.4",
                "thickness": 1,
            }
        traces.append(trace)
    every = [value * scale for key in ("measured", "predicted") for value in values[key]]
    ends = [min(every), max(every)]
    traces.append(line(ends, ends, "measured", "quiet", dash="dash", showlegend=False))
    return figure(traces, f"measured {name}", "predicted")


def coverage_figure(found: Mapping[str, Any]) -> Figure | None:
    """Share of held-out points within their intervals over the nominal share; None for a model without spread."""
    coverage = found["coverage"]
    traces = [
        points(coverage["level"], coverage[key], name, colour, mode="lines+markers")
        for key, name, colour in (("force", "force", "c0"), ("time", "contact time", "c1"))
        if coverage[key] is not None
    ]
    if not traces:
        return None
    return figure([line([0.4, 1], [0.4, 1], "as promised", "quiet", dash="dash"), *traces], "nominal share", "held")
