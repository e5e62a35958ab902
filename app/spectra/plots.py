"""A shock response spectrum as a picture: its curves with the target's band, and the record that it is of."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...twin.srs.target import Target
from ..plots import MEASURED, MODEL, QUIET, new_figure, save
from .channel import Acceleration
from .recordings import MeasuredSpectrum


def plot_spectrum(measured: MeasuredSpectrum, path: Path) -> None:
    """Spectrum on log-log axes above, record below. `ValueError` for a suffix that cannot be drawn."""
    figure = new_figure(8, 8)
    above, below = figure.subplots(2, 1, height_ratios=(2, 1))
    draw_spectrum(above, measured)
    draw_record(below, measured.acceleration)
    save(figure, path)


def draw_spectrum(axes: Any, measured: MeasuredSpectrum) -> None:
    """Positive, negative and maximax spectrum; lines outside of the target's tolerance are marked."""
    spectrum, held = measured.spectrum, measured.comparison
    if held is not None:
        draw_band(axes, held.target)
    axes.loglog(spectrum.frequency_hz, spectrum.maximax, color="black", lw=1.6, label="maximax")
    axes.loglog(spectrum.frequency_hz, spectrum.positive, color=MEASURED, lw=1, ls="--", label="positive")
    axes.loglog(spectrum.frequency_hz, spectrum.negative, color=MODEL, lw=1, ls=":", label="negative")
    if held is not None and not held.within:
        out = held.margin_db < 0
        level = held.target.level_m_s2[out] * 10 ** (held.error_db[out] / 20)
        axes.loglog(held.frequency_hz[out], level, "o", color=MODEL, ms=5, mfc="none", label="out of tolerance")
    axes.set_xlabel("natural frequency (Hz)")
    axes.set_ylabel(f"absolute acceleration, Q = {spectrum.q:.3g} (m/s²)")
    axes.grid(which="both", color=QUIET, alpha=0.25, lw=0.5)
    axes.legend(frameon=False)


def draw_band(axes: Any, target: Target) -> None:
    """Level and tolerance; a side that is free has no edge."""
    upper, lower = (target.level_m_s2 * 10 ** (db / 20) for db in (target.upper_db, -target.lower_db))
    axes.loglog(target.frequency_hz, target.level_m_s2, color=QUIET, lw=1.2, label="target")
    for edge in (upper, lower):
        good = np.isfinite(edge) & (edge > 0)
        axes.loglog(target.frequency_hz[good], edge[good], color=QUIET, lw=0.8, ls="--")
    both = np.isfinite(upper) & (lower > 0)
    axes.fill_between(target.frequency_hz, lower, upper, where=both, color=QUIET, alpha=0.2, lw=0)


def draw_record(axes: Any, acceleration: Acceleration) -> None:
    """Acceleration against time."""
    values = acceleration.values_m_s2
    time = acceleration.start_s + np.arange(values.size) / acceleration.sampling_rate_hz
    axes.plot(time * 1e3, values, color=MEASURED, lw=0.7)
    axes.set_xlabel("time (ms)")
    axes.set_ylabel(f"{acceleration.channel} (m/s²)")
    axes.margins(x=0)
