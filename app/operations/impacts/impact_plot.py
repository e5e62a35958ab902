"""One impact as a picture: its whole record, and beside it the contact; a record without contact is
drawn as well."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from ....ingest.storing.stored_channels import list_channels, read_channel
from ....schema.impacts import Pulse
from ....schema.recordings import RecordedChannel
from ....schema.series import as_floats
from ...common.plots import MEASURED, MODEL, QUIET, new_figure, save
from ...common.quantities import display_of, display_of_unit
from .impact import get_impact

#: Channels of the whole record, in this order from the top; of another quantity none is drawn where
#: there are these.
_DRAWN = ("force", "acceleration")
_COLOURS = (MEASURED, "#d55e00", "#00805e", "#b35d96", "#2b90c4", "#a67c00")
#: Samples of a whole record that are drawn: the extremes of so many buckets.
_BUCKETS = 2000


def plot_impact(session: Session, key: int, path: Path) -> None:
    """Write the whole record of every force and acceleration, and beside it the contact with the
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
    figure = new_figure(7 if pulse is None else 12, 3.2 * len(quantities))
    axes = figure.subplots(len(quantities), 1 if pulse is None else 2, squeeze=False)
    for place, quantity in enumerate(quantities):
        channels = [row for row in rows if row.quantity == quantity]
        draw_record(axes[place, 0], session, channels)
        if pulse is not None:
            if quantity == "force":
                draw_pulse(axes[place, 1], session, impact.recording_id, pulse)
            else:
                margin = pulse.contact_time_s
                draw_record(
                    axes[place, 1],
                    session,
                    channels,
                    (pulse.start_s - margin, pulse.start_s + 3 * margin),
                )
    figure.suptitle(f"impact {key}: whole record" + ("" if pulse is None else ", and the contact"))
    save(figure, path)


def draw_record(
    axes: Any,
    session: Session,
    channels: Sequence[RecordedChannel],
    span_s: tuple[float, float] | None = None,
) -> None:
    """Channels of one quantity over the time of the recording, with their sum where they are cells
    of one array."""
    display = display_of_unit(channels[0].si_unit)
    total: Any = None
    for number, row in enumerate(channels):
        first, stop = _samples(row, span_s)
        channel = read_channel(session, row, first, stop)
        values = np.asarray(channel.si) * display.scale
        time_ms = (channel.start_s + np.arange(values.size) / channel.sampling_rate_hz) * 1e3
        axes.plot(
            *_thinned(time_ms, values),
            color=_COLOURS[number % len(_COLOURS)],
            lw=0.8,
            label=row.name,
        )
        total = (
            values if total is None else total + values if values.size == np.size(total) else None
        )
    if channels[0].quantity == "force" and len(channels) > 1 and total is not None:
        axes.plot(
            *_thinned(time_ms, total), color="black", lw=1.2, label=f"sum of {len(channels)} cells"
        )
    axes.set(xlabel="time (ms)", ylabel=f"{channels[0].quantity} ({display.unit})")
    axes.legend(frameon=False, fontsize="small")


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


def draw_pulse(axes: Any, session: Session, recording: int, pulse: Pulse) -> None:
    """One pulse on `axes`: recorded samples with a margin of half a contact, their sum, spline,
    equidistant points."""
    margin, display = 0.5 * pulse.contact_time_s, display_of("force_n")
    span = (pulse.start_s - margin, pulse.start_s + pulse.contact_time_s + margin)
    cells = [row for row in list_channels(session, recording) if row.quantity == "force"]
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
            axes.plot(time_ms, values, color=QUIET, lw=0.8, label=row.name)
    if total is not None:
        words = f"sum of {len(cells)} cells" if len(cells) > 1 else f"recorded {cells[0].name}"
        axes.plot(time_ms, total, "o", color=MEASURED, ms=4, label=words)
    fine = as_floats(pulse.fine_force_n, f"the force of pulse {pulse.id}") * display.scale
    axes.plot(
        np.arange(fine.size) * pulse.fine_period_s * 1e3,
        fine,
        color=MODEL,
        lw=1.5,
        label="smoothing spline",
    )
    points = np.asarray(pulse.force_points_n) * display.scale
    at = np.linspace(0, pulse.contact_time_s, points.size) * 1e3
    axes.plot(at, points, "|", color="black", ms=9, label=f"{points.size} points")
    axes.axvspan(0, pulse.contact_time_s * 1e3, color=QUIET, alpha=0.15, lw=0, label="contact")
    axes.set(xlabel="time since first contact (ms)", ylabel=f"force ({display.unit})")
    axes.legend(frameon=False, loc="upper right", fontsize="small")
