"""Fig. 1.1: a shock response spectrum, built from the responses of oscillators to one record.

The oscillators respond to the record as the spectrum takes it: resampled, where its content
requires that.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pyroshock.app.figures.matplotlib_renderer import new_figure
from pyroshock.array_types import Floats
from pyroshock.ingest.extraction.channels import read_channels
from pyroshock.ingest.folder.campaign_file import read_campaign_file
from pyroshock.signals.channel import Channel
from pyroshock.signals.srs.resampling import upsampled
from pyroshock.signals.srs.spectrum import octave_grid, oscillator_response, shock_response_spectrum

from .picture import MEASURED, MODEL, QUIET

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FOLDER = Path(__file__).resolve().parents[1] / "modal-hammer-hit"
#: Natural frequencies of the oscillators that are drawn: lines of the spectrum.
OSCILLATORS_HZ = (200.0, 800.0, 3200.0)
_SHOWN_S = 0.02


def recorded() -> Channel:
    """The acceleration of a structure under a hit, as it was recorded and ships with the
    software."""
    channels, _ = read_channels(
        FOLDER / "recordings" / "acceleration.lvm", read_campaign_file(FOLDER).sensors
    )
    return next(channel for channel in channels if channel.quantity == "acceleration")


def draw() -> Figure:
    """Base, responses of three oscillators with their largest values, and the spectrum that these
    are points of."""
    base = recorded()
    spectrum = shock_response_spectrum(
        base.si, base.sampling_rate_hz, octave_grid(100.0, 5000.0, 6)
    )
    factor = int(spectrum.resampled)
    record, rate_hz = upsampled(base.si[np.newaxis], factor)[0], factor * base.sampling_rate_hz
    figure = new_figure(10.0, 5.0)
    halves: Any = figure.subfigures(1, 2, width_ratios=(1.15, 1))
    left, right = halves
    panels = left.subplots(1 + len(OSCILLATORS_HZ), 1, sharex=True)
    _draw_series(panels[0], record, rate_hz, "base", QUIET)
    axes: Any = right.subplots()
    axes.loglog(
        spectrum.frequency_hz, spectrum.maximax, color="black", lw=1.2, label="maximax spectrum"
    )
    for panel, frequency in zip(panels[1:], OSCILLATORS_HZ, strict=True):
        response = oscillator_response(record, rate_hz, frequency).absolute_acceleration_m_s2
        largest = int(np.argmax(np.abs(response)))
        _draw_series(panel, response, rate_hz, f"{frequency:g} Hz", MEASURED)
        panel.plot(1e3 * largest / rate_hz, response[largest], "o", color=MODEL, ms=4)
        axes.plot(frequency, abs(response[largest]), "o", color=MODEL)
    panels[-1].set_xlabel("time (ms)")
    left.supylabel("acceleration (m/s²)", fontsize=10)
    axes.set_xlabel("natural frequency (Hz)")
    axes.set_ylabel(f"largest absolute acceleration, Q = {spectrum.q:g} (m/s²)")
    axes.grid(which="both", color=QUIET, alpha=0.25, lw=0.5)
    axes.legend(frameon=False)
    return figure


def _draw_series(axes: Any, values: Floats, rate_hz: float, name: str, ink: str) -> None:
    shown = values[: round(_SHOWN_S * rate_hz)]
    axes.plot(1e3 * np.arange(shown.size) / rate_hz, shown, color=ink, lw=0.9)
    axes.set_title(name, loc="left", fontsize=8, pad=2)
    axes.tick_params(labelsize=7)
