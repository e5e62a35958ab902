"""Figures of shock response spectra: levels with the tolerance about their reference, how far each
spectrum is from it in dB, and pseudo-velocity on four-coordinate paper."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ....array_types import Floats
from ...common.unit_endings import STANDARD_GRAVITY_M_S2
from ...figures.figure import (
    BandSeries,
    ColourRole,
    Dash,
    LineSeries,
    Plot,
    PlotAxis,
    PlotGrid,
    PlotSeries,
    ReferenceLine,
    as_floats,
    curve_style,
)
from .four_coordinate_paper import four_coordinate_plot
from .overlays import ImpactSpectrum, ReferenceBand, SpectrumOverlay

#: Of the widest band, and what each narrower one within it adds: their shades differ at a glance.
_OPACITY, _DEEPER = 0.14, 0.2
#: Heights in px of a page: levels, and differences below them.
_LEVELS_PX, _DIFFERENCES_PX = 330.0, 230.0
#: The differences are shown to at least so many dB, and to at most so many.
_LEAST_DB, _MOST_DB = 8.0, 60.0
_LEVEL = PlotAxis("shock response", "g", scale="log")


def compared_figure(overlay: SpectrumOverlay, sides: bool = False) -> PlotGrid:
    """Spectra with their reference, and below them their differences from it.

    Parameters:
        overlay: The spectra, and what they are compared with.
        sides: Positive and negative sides in place of the maximax.
    """
    return PlotGrid(
        "Shock response spectra",
        ((spectra_plot(overlay, sides),), (differences_plot(overlay, sides),)),
        share_x=True,
    )


def impact_spectra_plot(
    overlay: SpectrumOverlay, predicted: Mapping[str, Any] | None = None
) -> Plot:
    """The maximax of each channel of one impact, in g over Hz, with the 90 % band that was
    predicted before the shot.

    Parameters:
        overlay: The spectra of one impact.
        predicted: What a stored prediction has of spectra (`RunPrediction.spectra`), of the same Q;
            by default nothing.
    """
    series: list[PlotSeries] = []
    for i, part in enumerate(overlay.spectra):
        role, dash = curve_style(i)
        level = part.spectrum.maximax / STANDARD_GRAVITY_M_S2
        series.append(LineSeries(overlay.frequency_hz, level, dash, name=part.channel, role=role))
        band = None if predicted is None else predicted["sensors"].get(part.channel)
        if band is not None and predicted is not None:
            lower, upper = (as_floats(band[end]) / STANDARD_GRAVITY_M_S2 for end in _ENDS)
            lines = as_floats(predicted["frequency_hz"])
            name = f"{part.channel}, 90 % predicted before"
            series.append(BandSeries(lines, lower, upper, name=name, role=role, silent=True))
    axis = _frequency_axis(overlay.frequency_hz)
    return Plot("Shock response spectra", axis, _LEVEL, tuple(series), cursor="column", height=300)


#: Keys of the ends of a stored band.
_ENDS = ("lower", "upper")


def spectra_plot(overlay: SpectrumOverlay, sides: bool = False) -> Plot:
    """Maximax of each in g over Hz, or its positive and negative sides; the cursor reads dB from
    the reference at that line.

    Parameters:
        overlay: The spectra, and what they are compared with.
        sides: Positive and negative sides in place of the maximax.
    """
    target, lines = overlay.comparison.target, overlay.comparison.frequency_hz
    series: list[PlotSeries] = []
    for place, band in enumerate(_widest_first(overlay.bands)):
        low, high = (edge / STANDARD_GRAVITY_M_S2 for edge in (band.lower_m_s2, band.upper_m_s2))
        series += _band(lines, low, high, band, place)
    series.append(
        LineSeries(
            lines,
            target.level_m_s2 / STANDARD_GRAVITY_M_S2,
            "dash",
            name="reference",
            role=ColourRole.REFERENCE,
        )
    )
    for name, level, role, dash in _curves(overlay, sides):
        series.append(
            LineSeries(
                overlay.frequency_hz,
                level / STANDARD_GRAVITY_M_S2,
                dash,
                labels=_decibel_words(overlay, level),
                name=name,
                role=role,
            )
        )
    return Plot(
        "Shock response spectra",
        _frequency_axis(overlay.frequency_hz),
        _LEVEL,
        tuple(series),
        cursor="column",
        height=_LEVELS_PX,
    )


def differences_plot(overlay: SpectrumOverlay, sides: bool = False) -> Plot:
    """How far each spectrum is above its reference, in dB over Hz; a gap where the reference has no
    line.

    Parameters:
        overlay: The spectra, and what they are compared with.
        sides: Positive and negative sides in place of the maximax.
    """
    lines = overlay.comparison.frequency_hz
    level = overlay.comparison.target.level_m_s2
    series: list[PlotSeries] = []
    for place, band in enumerate(_widest_first(overlay.bands)):
        with np.errstate(divide="ignore"):
            low, high = (20 * np.log10(edge / level) for edge in (band.lower_m_s2, band.upper_m_s2))
        series += _band(lines, low, high, band, place)
    curves = [
        LineSeries(overlay.frequency_hz, _decibels(overlay, level), dash, name=name, role=role)
        for name, level, role, dash in _curves(overlay, sides)
    ]
    farthest = max(
        (float(np.nanmax(np.abs(own.y))) for own in curves if np.isfinite(own.y).any()), default=0.0
    )
    end = min(_MOST_DB, max(_LEAST_DB, 1.1 * farthest))
    return Plot(
        "Differences from the reference",
        _frequency_axis(overlay.frequency_hz),
        PlotAxis("difference", "dB", limits=(-end, end)),
        (*series, *curves),
        (ReferenceLine("y", 0.0, "reference"),),
        cursor="column",
        height=_DIFFERENCES_PX,
    )


def _frequency_axis(frequency_hz: Floats) -> PlotAxis:
    """The same ends for both plots, so that they lie below each other."""
    ends = float(frequency_hz.min()) / 1.05, float(frequency_hz.max()) * 1.05
    return PlotAxis("frequency", "Hz", scale="log", limits=ends)


def _widest_first(bands: Sequence[ReferenceBand]) -> list[ReferenceBand]:
    return sorted(bands, key=lambda band: math.inf if band.db is None else band.db, reverse=True)


def _band(
    lines: Floats, low: Floats, high: Floats, band: ReferenceBand, place: int
) -> list[PlotSeries]:
    """A shade, or of a specification's own tolerance its two edges."""
    if band.db is None:
        name = "specification's tolerance"
        return [
            LineSeries(lines, edge, "dashdot", 1.5, name=name, role=ColourRole.INK, silent=True)
            for edge in (low, high)
        ]
    opacity = _OPACITY + _DEEPER * place
    role = ColourRole.TOLERANCE
    return [BandSeries(lines, low, high, name=f"±{band.db:g} dB", role=role, opacity=opacity)]


def _curves(
    overlay: SpectrumOverlay, sides: bool
) -> Iterator[tuple[str, Floats, ColourRole, Dash]]:
    """Name, level (f,) in m/s2, colour and dashes of each curve."""
    for i, part in enumerate(overlay.spectra):
        role, dash = curve_style(i)
        name = _name(part)
        if sides:
            yield f"{name} positive", part.spectrum.positive, role, dash
            yield f"{name} negative", part.spectrum.negative, role, "dot"
        else:
            yield name, part.spectrum.maximax, role, dash


def _name(part: ImpactSpectrum) -> str:
    return f"impact {part.impact}, {part.channel}"


def _decibels(overlay: SpectrumOverlay, level: Floats) -> Floats:
    """From the reference (f,), along its straight lines between break points; NaN beyond it."""
    target = overlay.reference
    inside = target.covers(overlay.frequency_hz)
    held = np.interp(
        np.log(overlay.frequency_hz), np.log(target.frequency_hz), np.log10(target.level_m_s2)
    )
    with np.errstate(divide="ignore"):
        error = 20 * (np.log10(level) - held)
    return np.asarray(np.where(inside & (level > 0), error, np.nan))


def _decibel_words(overlay: SpectrumOverlay, level: Floats) -> tuple[str, ...]:
    return tuple(
        "" if math.isnan(value) else f"{value:+.1f} dB" for value in _decibels(overlay, level)
    )


def four_coordinate_figure(overlay: SpectrumOverlay) -> Plot:
    """Pseudo-velocity on four-coordinate paper, in m/s over Hz.

    Parameters:
        overlay: The spectra.
    """
    curves = []
    for i, part in enumerate(overlay.spectra):
        role, dash = curve_style(i)
        velocity = part.spectrum.pseudo_velocity_m_s
        curves.append(LineSeries(overlay.frequency_hz, velocity, dash, name=_name(part), role=role))
    return four_coordinate_plot("Pseudo-velocity", overlay.frequency_hz, curves)
