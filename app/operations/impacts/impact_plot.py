"""One impact as a figure: its whole record, and beside it the contact; a record without contact is
drawn as well."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from ....ingest.storing.stored_channels import list_channels, read_channel
from ....schema.impacts import Pulse
from ....schema.recordings import RecordedChannel
from ....schema.series import as_floats
from ...common.quantities import display_of, display_of_unit
from ...figures.figure import (
    ColourRole,
    LineSeries,
    Plot,
    PlotAxis,
    PlotGrid,
    PlotSeries,
    PointSeries,
    ReferenceRegion,
    curve_style,
)
from .impact import get_impact

#: Channels of the whole record, in this order from the top; of another quantity none is drawn where
#: there are these.
_DRAWN = ("force", "acceleration")
#: Samples of a whole record that are drawn: the extremes of so many buckets.
_BUCKETS = 2000


def impact_figure(session: Session, key: int) -> PlotGrid:
    """The whole record of every force and acceleration, and beside it the contact with the
    extracted pulse.

    Where there is neither force nor acceleration, every channel is drawn. Raises `LookupError` for
    an impact without a recorded series.
    """
    impact = get_impact(session, key)
    pulse = session.scalars(
        select(Pulse).where(Pulse.impact_id == key, Pulse.current)
    ).one_or_none()
    rows = [] if impact.recording_id is None else list_channels(session, impact.recording_id)
    if impact.recording_id is None or not rows:
        raise LookupError(
            f"impact {key} has no recorded series to draw; only its figures were ingested"
        )
    quantities = [name for name in _DRAWN if any(row.quantity == name for row in rows)]
    quantities = quantities or list(dict.fromkeys(row.quantity for row in rows))
    grid = []
    for quantity in quantities:
        channels = [row for row in rows if row.quantity == quantity]
        plots = [record_plot(session, channels)]
        if pulse is not None and quantity == "force":
            plots.append(pulse_plot(session, impact.recording_id, pulse))
        elif pulse is not None:
            margin = pulse.contact_time_s
            span = pulse.start_s - margin, pulse.start_s + 3 * margin
            plots.append(record_plot(session, channels, span))
        grid.append(tuple(plots))
    title = f"impact {key}: whole record" + ("" if pulse is None else ", and the contact")
    return PlotGrid(title, tuple(grid))


def record_plot(
    session: Session,
    channels: Sequence[RecordedChannel],
    span_s: tuple[float, float] | None = None,
) -> Plot:
    """Channels of one quantity over the time of the recording, with their sum where they are cells
    of one array."""
    display = display_of_unit(channels[0].si_unit)
    series: list[PlotSeries] = []
    total: Any = None
    for i, row in enumerate(channels):
        first, stop = _samples(row, span_s)
        channel = read_channel(session, row, first, stop)
        values = np.asarray(channel.si) * display.scale
        time_ms = (channel.start_s + np.arange(values.size) / channel.sampling_rate_hz) * 1e3
        role, dash = curve_style(i)
        line = LineSeries(*_thinned(time_ms, values), dash, width=1, name=row.name, role=role)
        series.append(line)
        total = (
            values if total is None else total + values if values.size == np.size(total) else None
        )
    quantity = channels[0].quantity
    if quantity == "force" and len(channels) > 1 and total is not None:
        name = f"sum of {len(channels)} cells"
        sum_line = LineSeries(*_thinned(time_ms, total), name=name, role=ColourRole.INK)
        series.append(sum_line)
    y = PlotAxis(quantity, display.unit or "1")
    return Plot(quantity, PlotAxis("time", "ms"), y, tuple(series))


def _samples(row: RecordedChannel, span_s: tuple[float, float] | None) -> tuple[int, int]:
    if span_s is None:
        return 0, row.samples
    first, stop = (round((time - row.start_s) * row.sampling_rate_hz) for time in span_s)
    return max(0, first), min(row.samples, stop + 1)


def _thinned(time_ms: Any, values: Any) -> tuple[Any, Any]:
    """The extremes of each bucket: a picture shows no more, and no peak is lost."""
    width = max(1, values.size // _BUCKETS)
    if width < 3:
        return time_ms, values
    count = values.size // width
    buckets = values[: count * width].reshape(count, width)
    starts = np.arange(count) * width
    places = np.unique(
        np.concatenate([starts + buckets.argmin(axis=1), starts + buckets.argmax(axis=1)])
    )
    return time_ms[places], values[places]


def pulse_plot(session: Session, recording: int, pulse: Pulse) -> Plot:
    """One pulse: recorded samples with a margin of half a contact, their sum, spline, equidistant
    points."""
    margin, display = 0.5 * pulse.contact_time_s, display_of("force_n")
    span = (pulse.start_s - margin, pulse.start_s + pulse.contact_time_s + margin)
    cells = [row for row in list_channels(session, recording) if row.quantity == "force"]
    series: list[PlotSeries] = []
    total: Any = None
    for row in cells:
        channel = read_channel(session, row, *_samples(row, span))
        values = np.asarray(channel.si) * display.scale
        time_ms = (
            channel.start_s + np.arange(values.size) / channel.sampling_rate_hz - pulse.start_s
        ) * 1e3
        total = (
            values if total is None else total + values if values.size == np.size(total) else None
        )
        if len(cells) > 1:
            series.append(
                LineSeries(time_ms, values, width=1, name=row.name, role=ColourRole.QUIET)
            )
    if total is not None:
        words = f"sum of {len(cells)} cells" if len(cells) > 1 else f"recorded {cells[0].name}"
        series.append(PointSeries(time_ms, total, size=5, name=words, role=ColourRole.MEASURED))
    fine = as_floats(pulse.fine_force_n, f"the force of pulse {pulse.id}") * display.scale
    spline_ms = np.arange(fine.size, dtype=np.float64) * pulse.fine_period_s * 1e3
    series.append(LineSeries(spline_ms, fine, name="smoothing spline", role=ColourRole.MODEL))
    points = np.asarray(pulse.force_points_n) * display.scale
    at = np.linspace(0, pulse.contact_time_s, points.size) * 1e3
    name = f"{points.size} points"
    series.append(PointSeries(at, points, filled=False, name=name, role=ColourRole.INK))
    contact = ReferenceRegion(
        "x", 0.0, pulse.contact_time_s * 1e3, "contact", role=ColourRole.QUIET
    )
    axes = PlotAxis("time since first contact", "ms"), PlotAxis("force", display.unit)
    return Plot("contact", *axes, tuple(series), regions=(contact,))
