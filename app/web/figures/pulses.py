"""Charts of pulses: one impact's segmentation, and pulses of many by the levels of a factor."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...pulses.curves import PulseCurve
from ...pulses.overlays import PulseOverlay
from ...pulses.segmentation import PulseView
from ..table_format import HEADINGS, number
from .base import COLOURS, Figure, Trace, band, figure, line, points

#: Thin curves beside a mean: more of them are a stain.
_CURVES = 60


def segmentation_figure(view: PulseView) -> Figure:
    """Force about the contact in N over ms since the contact of the version in use, each version over it."""
    used = next((version for version in view.versions if version.in_use), view.versions[-1])
    zero = used.start_s
    traces = [points(_ms(view.time_s, zero), view.force_n, "record", "quiet", hoverinfo="x+y")]
    traces[0]["marker"]["size"] = 4
    shapes: list[dict[str, Any]] = []
    shown = [*view.versions, *([view.preview] if view.preview else [])]
    for i, curve in enumerate(shown):
        colour = COLOURS[i % len(COLOURS)]
        traces += _version(curve, zero, colour)
        if curve.in_use or curve.key is None:
            shapes += [_edge((instant - zero) * 1e3, colour) for instant in (curve.start_s, curve.stop_s)]
    return figure(traces, "time since contact (ms)", "force (N)", shapes=shapes)


def _version(curve: PulseCurve, zero: float, colour: str) -> list[Trace]:
    name = "preview" if curve.key is None else f"version {curve.key}" + (", in use" if curve.in_use else "")
    dash = "dash" if curve.key is None else "solid" if curve.in_use else "dot"
    return [
        line(_ms(curve.time_s, zero), curve.force_n, name, colour, dash=dash),
        points(
            _ms(curve.points_time_s, zero), curve.points_n, f"points of {name}", colour, visible="legendonly"
        ),  # what the models take
    ]


def _ms(time_s: Any, zero: float) -> Any:
    return (np.asarray(time_s) - zero) * 1e3


def _edge(at: float, colour: str) -> dict[str, Any]:
    return {
        "type": "line",
        "x0": at,
        "x1": at,
        "yref": "paper",
        "y0": 0,
        "y1": 1,
        "line": {"color": colour, "dash": "dot", "width": 1},
    }


def overlay_figure(overlay: PulseOverlay) -> Figure:
    """Mean pulse of each level in kN with its standard deviation, and some of the pulses."""
    scale, axis = (1.0, "share of contact") if overlay.normalised else (1e3, "time since contact (ms)")
    x = overlay.axis * scale
    traces: list[Trace] = []
    per_group = max(1, _CURVES // max(1, len(overlay.groups)))
    for i, group in enumerate(overlay.groups):
        colour, name = COLOURS[i % len(COLOURS)], f"{level_words(overlay.factor, group.level)} ({group.count})"
        if group.count > 1:
            low, high = (group.mean_n + sign * group.deviation_n for sign in (-1, 1))
            traces += band(x, low * 1e-3, high * 1e-3, f"{name}: ± standard deviation", colour)
            traces[-1]["legendgroup"] = traces[-2]["legendgroup"] = name
            traces[-1]["showlegend"] = False
        for place in np.linspace(0, group.count - 1, min(per_group, group.count)).astype(int):
            thin = line(x, group.force_n[place] * 1e-3, f"impact {group.impacts[place]}", f"{colour}/0.35", width=1)
            traces.append({**thin, "showlegend": False, "legendgroup": name, "hoverinfo": "name"})
        traces.append({**line(x, group.mean_n * 1e-3, name, colour, width=3), "legendgroup": name})
    return figure(traces, axis, "force (kN)")


def level_words(factor: str, level: float | str | None) -> str:
    """A level as a person reads it, in the unit of its heading."""
    if level is None:
        return "not recorded"
    if isinstance(level, str):
        return level
    heading, scale = HEADINGS.get(factor, ("", 1.0))
    unit = heading.partition("(")[2].rstrip(")")
    return f"{number(level * scale)} {unit}".strip()
