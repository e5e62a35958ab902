"""Charts of recorded channels."""

from __future__ import annotations

from ...pulses.signals import SignalWindow
from .base import Figure, figure, line


def signal_figure(window: SignalWindow) -> Figure:
    """A channel over ms of the recording's clock; the page fetches more samples as one zooms in (impact.js)."""
    curve = line(window.time_s * 1e3, window.values, window.channel, "c0", width=1.2)
    unit = window.unit.replace("m/s2", "m/s²").replace("dimensionless", "1")
    return figure([curve], "time (ms)", f"{window.quantity} ({unit})", showlegend=False)
