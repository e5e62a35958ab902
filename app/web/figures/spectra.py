"""Charts of shock response spectra: levels with tolerance bands, and pseudo-velocity on four-coordinate paper."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ....array_types import Floats
from ...spectra.overlays import ImpactSpectrum, ReferenceBand, SpectrumOverlay
from .base import COLOURS, Figure, Trace, band, figure, line

#: Under a cursor: the level, and how far it is from the reference.
_CURSOR = "%{y:.4g} m/s², %{customdata:+.1f} dB<extra>%{fullData.name}</extra>"
_HELD = "shock response (m/s²)"


def spectra_figure(overlay: SpectrumOverlay, sides: bool = False) -> Figure:
    """Maximax of each, or its positive and negative sides; the cursor reads dB from the reference at that line."""
    target = overlay.comparison.target
    lines = overlay.comparison.frequency_hz
    traces: list[Trace] = []
    for overlaid_band in sorted(overlay.bands, key=_width, reverse=True):
        traces += band(lines, overlaid_band.lower_m_s2, overlaid_band.upper_m_s2, _band_name(overlaid_band), "c7")
    shown = "%{y:.4g} m/s²<extra>reference</extra>"
    reference = line(lines, target.level_m_s2, "reference", "quiet", dash="dash", hovertemplate=shown)
    traces.append(reference)
    for i, overlaid in enumerate(overlay.spectra):
        traces += _curves(overlay, overlaid, COLOURS[i % len(COLOURS)], sides)
    return figure(traces, "frequency (Hz)", _HELD, log_x=True, log_y=True, hovermode="x")


def _curves(overlay: SpectrumOverlay, one: ImpactSpectrum, colour: str, sides: bool) -> list[Trace]:
    name = f"impact {one.impact}, {one.channel}"
    spectrum = one.spectrum
    shown = {"": (spectrum.maximax, "solid")}
    if sides:
        shown = {" positive": (spectrum.positive, "solid"), " negative": (spectrum.negative, "dot")}
    x = overlay.frequency_hz
    return [
        {
            **line(x, _above(level), name + side, colour, dash=dash),
            "customdata": _decibels(overlay, level),
            "hovertemplate": _CURSOR,
        }
        for side, (level, dash) in shown.items()
    ]


def _above(level: Floats) -> Floats:
    """A logarithmic axis has no zero."""
    return np.where(level > 0, level, np.nan)


def _decibels(overlay: SpectrumOverlay, level: Floats) -> list[float | None]:
    """From the reference, along its straight lines between break points; None beyond it."""
    target = overlay.reference
    inside = target.covers(overlay.frequency_hz)
    held = np.interp(np.log(overlay.frequency_hz), np.log(target.frequency_hz), np.log10(target.level_m_s2))
    with np.errstate(divide="ignore"):
        error = 20 * (np.log10(level) - held)
    shown = np.where(inside & (level > 0), error, np.nan)
    return [None if math.isnan(value) else round(float(value), 2) for value in shown]


def _width(each: ReferenceBand) -> float:
    return each.db if each.db is not None else math.inf


def _band_name(each: ReferenceBand) -> str:
    return "specification's tolerance" if each.db is None else f"±{each.db:g} dB"


def four_coordinate_figure(overlay: SpectrumOverlay) -> Figure:
    """Pseudo-velocity on four-coordinate paper: diagonals are constant acceleration (falling) and displacement."""
    x = overlay.frequency_hz
    curves = [overlaid.spectrum.pseudo_velocity_m_s for overlaid in overlay.spectra]
    traces = [
        line(x, _above(curve), f"impact {overlaid.impact}, {overlaid.channel}", COLOURS[i % len(COLOURS)])
        for i, (overlaid, curve) in enumerate(zip(overlay.spectra, curves, strict=True))
    ]
    positive = np.concatenate([curve[curve > 0] for curve in curves])
    low, high = 10 ** np.floor(np.log10(positive.min())), 10 ** np.ceil(np.log10(positive.max()))
    paper, words = paper_lines(float(x.min()), float(x.max()), float(low), float(high))
    return figure(
        [*paper, *traces],
        "frequency (Hz)",
        "pseudo-velocity (m/s)",
        log_x=True,
        log_y=True,
        annotations=words,
    )


def paper_lines(left: float, right: float, low: float, high: float) -> tuple[list[Trace], list[dict[str, Any]]]:
    """Diagonals of whole decades within a frame of Hz and m/s: v = a / (2 pi f) and v = 2 pi f d, and their names."""
    traces: list[Trace] = []
    words: list[dict[str, Any]] = []
    corners = [(f, v) for f in (left, right) for v in (low, high)]
    for exponent in _decades([2 * math.pi * f * v for f, v in corners]):
        acceleration = 10.0**exponent
        _diagonal(traces, words, acceleration / (2 * math.pi), -1, (left, right, low, high), f"{acceleration:g} m/s²")
    for exponent in _decades([v / (2 * math.pi * f) for f, v in corners]):
        displacement = 10.0**exponent
        _diagonal(traces, words, 2 * math.pi * displacement, 1, (left, right, low, high), _length(displacement))
    return traces, words


def _decades(values: list[float]) -> range:
    return range(math.ceil(math.log10(min(values))), math.floor(math.log10(max(values))) + 1)


def _length(metres: float) -> str:
    for unit, scale in (("m", 1.0), ("mm", 1e3), ("µm", 1e6), ("nm", 1e9)):
        if metres * scale >= 0.999:
            return f"{metres * scale:g} {unit}"
    return f"{metres:g} m"


def _diagonal(
    traces: list[Trace],
    words: list[dict[str, Any]],
    constant: float,
    slope: int,
    frame: tuple[float, float, float, float],
    name: str,
) -> None:
    """v = constant * f ** slope, cut by the frame; a corner alone is no line."""
    lowest_hz, right, low, high = frame
    crossings = sorted((v / constant) ** slope for v in (low, high))
    begin, end = max(lowest_hz, crossings[0]), min(right, crossings[1])
    if end <= begin * 1.05:
        return
    f = np.array([begin, end])
    thin = line(f, constant * f**slope, name, "rule", width=1)
    traces.append({**thin, "showlegend": False, "hoverinfo": "skip"})
    named = begin**0.85 * end**0.15  # near its left end: falling and rising names keep apart
    place = {"x": math.log10(named), "y": math.log10(constant * named**slope), "showarrow": False}
    words.append({**place, "text": name, "bgcolor": "card/0.8", "font": {"size": 10, "color": "quiet"}})
