"""Pictures. matplotlib is imported here and nowhere else, and only when something is drawn."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from ...ingest.stored import list_channels, read_channel
from ...schema.atomic_write import whole_file
from ...schema.impacts import Pulse
from ...schema.series import as_floats
from ..impacts.impact import get_impact

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MEASURED, MODEL, QUIET = "#1b6ca8", "#d1495b", "#8d99ae"


def new_figure(width: float, height: float) -> Figure:
    """A figure that needs no display and no global state."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained", dpi=150)


def save(figure: Figure, path: Path) -> None:
    """Write a figure; the suffix decides the format. `ValueError` for one that cannot be drawn."""
    formats = figure.canvas.get_supported_filetypes()
    if path.suffix.lstrip(".").lower() not in formats:
        raise ValueError(f"cannot draw {path.name!r}; expected one of {', '.join('.' + k for k in sorted(formats))}")
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as partial:
        figure.savefig(partial)


def plot_impact(session: Session, key: int, path: Path) -> None:
    """The recorded force about a contact, its spline and its 20 points. `LookupError` where there is no pulse."""
    impact = get_impact(session, key)
    pulse = session.scalars(select(Pulse).where(Pulse.impact_id == key, Pulse.current)).one_or_none()
    if pulse is None or impact.recording_id is None:
        raise LookupError(f"impact {key} has no pulse to draw")
    figure = new_figure(7, 4)
    draw_pulse(figure.subplots(), session, impact.recording_id, pulse)
    save(figure, path)


def draw_pulse(axes: Any, session: Session, recording: int, pulse: Pulse) -> None:
    """One pulse on `axes`: recorded samples with a margin of half a contact, spline, equidistant points."""
    margin = 0.5 * pulse.contact_time_s
    for row in list_channels(session, recording):
        if row.quantity != "force":
            continue
        first = round((pulse.start_s - margin - row.start_s) * row.sampling_rate_hz)
        last = round((pulse.start_s + pulse.contact_time_s + margin - row.start_s) * row.sampling_rate_hz)
        channel = read_channel(session, row, max(0, first), min(row.samples, last + 1))
        time = channel.start_s + np.arange(channel.si.size) / channel.sampling_rate_hz - pulse.start_s
        axes.plot(time * 1e3, channel.si, "o", color=MEASURED, ms=4, label=f"recorded {row.name}")
    fine = as_floats(pulse.fine_force_n, f"the force of pulse {pulse.id}")
    axes.plot(np.arange(fine.size) * pulse.fine_period_s * 1e3, fine, color=MODEL, lw=1.5, label="smoothing spline")
    points = np.asarray(pulse.force_points_n)
    at = np.linspace(0, pulse.contact_time_s, points.size) * 1e3
    axes.plot(at, points, "|", color="black", ms=9, label=f"{points.size} points")
    axes.axvspan(0, pulse.contact_time_s * 1e3, color=QUIET, alpha=0.15, lw=0, label="contact")
    axes.set_xlabel("time since first contact (ms)")
    axes.set_ylabel("force (N)")
    axes.legend(frameon=False, loc="center right")
