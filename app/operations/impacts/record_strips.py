"""All channels of an impact's recording below each other on one axis of time, with the contact and
the quality findings at their places.

A page opens with the contact. Each curve has the extremes of the whole record, and within the
contact's window as many samples as a screen shows; the page fetches what one zooms into
(`static/impact.js`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from ....array_types import Floats
from ....schema.series import SeriesError
from ...common.quantities import display_of_unit, in_shown_units
from ...figures.figure import (
    ColourRole,
    LineSeries,
    Plot,
    PlotAxis,
    PlotGrid,
    ReferenceLine,
    ReferenceRegion,
)
from .finding_places import PlacedFinding, RecordPlace
from .signals import SignalWindow, bucket_length, channel_window

#: Points of the whole record, and of the window that a page opens with.
WHOLE_POINTS, WINDOW_POINTS = 600, 2000
#: All strips together are about so high in px of a page, each between the two bounds.
_TOGETHER_PX, _LOWEST_PX, _HIGHEST_PX = 600.0, 62.0, 160.0
#: Quantities of the impact itself stand first.
_FIRST = ("force", "acceleration")
_SEVERITY_ROLES = {
    "reject": ColourRole.BAD,
    "warning": ColourRole.WARN,
    "note": ColourRole.QUIET,
}


@dataclass(frozen=True, eq=False)
class RecordStrips:
    """`figure` is None where no channel can be drawn; `signals` are the channels of its rows,
    `buckets_ms` the length of what each point of a whole record stands for (0: one sample), and
    `exact` whether what a page opens with has every sample. `damaged` says of other channels why
    they are not drawn."""

    figure: PlotGrid | None
    signals: tuple[Mapping[str, Any], ...]
    buckets_ms: tuple[float, ...]
    exact: tuple[bool, ...]
    damaged: Mapping[str, str]


def record_strips(
    session: Session,
    signals: Sequence[Mapping[str, Any]],
    contact: tuple[float, float] | None,
    window: tuple[float, float] | None,
    findings: Sequence[PlacedFinding],
) -> RecordStrips:
    """The channels of a recording as a grid of plots with one axis of time in ms.

    Parameters:
        session: Open for reading.
        signals: The channels, as `impact.list_signals` gives them.
        contact: Begin and end of the contact in s of the recording's clock; None without a pulse.
        window: What the page opens with, in s; None for the whole record.
        findings: What the checks found, numbered from 1 in this order.
    """
    ordered = sorted(signals, key=lambda signal: _rank(str(signal["quantity"])))
    drawn, curves, buckets, exact = [], [], [], []
    damaged: dict[str, str] = {}
    for signal in ordered:
        try:
            whole = channel_window(session, signal["key"], points=WHOLE_POINTS)
            near = (
                None
                if window is None
                else channel_window(session, signal["key"], *window, points=WINDOW_POINTS)
            )
        except SeriesError as error:
            damaged[str(signal["channel"])] = str(error)
            continue
        drawn.append(signal)
        curves.append(_merged(whole, near))
        length = bucket_length(whole.stop - whole.first, WHOLE_POINTS)
        buckets.append(0.0 if length == 1 else 1e3 * length / whole.sampling_rate_hz)
        exact.append(not (whole if near is None else near).decimated)
    if not drawn:
        return RecordStrips(None, (), (), (), damaged)
    ends = (
        1e3 * min(float(signal["start_s"]) for signal in drawn),
        1e3 * max(float(signal["stop_s"]) for signal in drawn),
    )
    if ends[0] == ends[1]:  # a record of one sample
        ends = ends[0] - 0.5, ends[1] + 0.5
    first_view = None if window is None else (1e3 * window[0], 1e3 * window[1])
    time = PlotAxis("time", "ms", limits=ends, first_view=first_view)
    height = min(_HIGHEST_PX, max(_LOWEST_PX, _TOGETHER_PX / len(drawn)))
    edges = () if contact is None else tuple(_edge(instant) for instant in contact)
    rows = [
        (_strip(signal, curve, time, height, edges, _regions(signal, place == 0, findings)),)
        for place, (signal, curve) in enumerate(zip(drawn, curves, strict=True))
    ]
    grid = PlotGrid("Channels", tuple(rows), share_x=True)
    return RecordStrips(grid, tuple(drawn), tuple(buckets), tuple(exact), damaged)


def _rank(quantity: str) -> int:
    return _FIRST.index(quantity) if quantity in _FIRST else len(_FIRST)


def _merged(whole: SignalWindow, near: SignalWindow | None) -> tuple[Floats, Floats]:
    """Times (n,) in s and values (n,): of the window its own points, beside it those of the whole
    record."""
    if near is None or not near.time_s.size:
        return whole.time_s, whole.values
    is_earlier = whole.time_s < near.time_s[0]
    is_later = whole.time_s > near.time_s[-1]
    parts = [(whole.time_s[is_earlier], whole.values[is_earlier]), (near.time_s, near.values)]
    parts.append((whole.time_s[is_later], whole.values[is_later]))
    times, values = zip(*parts, strict=True)
    return np.concatenate(times), np.concatenate(values)


def _edge(instant_s: float) -> ReferenceLine:
    return ReferenceLine("x", 1e3 * instant_s, role=ColourRole.QUIET, dash="dot")


def _strip(
    signal: Mapping[str, Any],
    curve: tuple[Floats, Floats],
    time: PlotAxis,
    height: float,
    edges: tuple[ReferenceLine, ...],
    regions: tuple[ReferenceRegion, ...],
) -> Plot:
    display = display_of_unit(str(signal["si_unit"]))
    name = str(signal["channel"])
    line = LineSeries(1e3 * curve[0], curve[1] * display.scale, width=1.2, detail=name)
    title = f"{name}, {signal['position']}" if signal["position"] else name
    return Plot(
        title,
        time,
        PlotAxis(str(signal["quantity"]), display.unit or "1"),
        (line,),
        edges,
        regions,
        cursor="column",
        height=height,
    )


def _regions(
    signal: Mapping[str, Any], is_first: bool, findings: Sequence[PlacedFinding]
) -> tuple[ReferenceRegion, ...]:
    """The findings of a channel; the first strip has those of the recording, too."""
    half_sample_s = 0.5 / float(signal["sampling_rate_hz"])
    return tuple(
        _region(number, finding, place, half_sample_s)
        for number, finding in enumerate(findings, 1)
        if finding.channel == signal["channel"] or (finding.channel is None and is_first)
        for place in finding.places
    )


def _region(
    number: int, finding: PlacedFinding, place: RecordPlace, half_sample_s: float
) -> ReferenceRegion:
    """An instant is as wide as a sample. The whole contact is shaded more lightly."""
    start, stop = place.start_s, place.stop_s
    if stop - start < 2 * half_sample_s:
        start, stop = start - half_sample_s, stop + half_sample_s
    return ReferenceRegion(
        "x",
        1e3 * start,
        1e3 * stop,
        role=_SEVERITY_ROLES[finding.severity],
        opacity=0.12 if finding.extent == "contact" else 0.35,
        mark=str(number),
        text=f"{finding.severity}, {finding.check}: {in_shown_units(finding.message)}",
    )
