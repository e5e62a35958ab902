"""Charts of pulses (one impact's segmentation, many by the levels of a factor), of recorded
channels, and of shock response spectra: levels with tolerance bands, and pseudo-velocity on
four-coordinate paper."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ....array_types import Floats
from ...common.number_format import format_number
from ...common.quantities import display_of, display_of_unit
from ...common.unit_endings import STANDARD_GRAVITY_M_S2
from ...figures.plotly_base import COLOURS, DASHES, Figure, Trace, band, figure, line, points
from .curves import PulseCurve, PulseView
from .overlays import ImpactSpectrum, PulseOverlay, ReferenceBand, SpectrumOverlay
from .signals import SignalWindow

#: Thin curves beside a mean: more of them are a stain.
_CURVES = 60


def segmentation_figure(view: PulseView) -> Figure:
    """Force about the contact in N over ms since the contact of the version in use, each version
    over it."""
    used = next((version for version in view.versions if version.in_use), view.versions[-1])
    zero = used.start_s
    traces = [
        points(_ms(view.time_s, zero), _kilo(view.force_n), "record", "quiet", hoverinfo="x+y")
    ]
    traces[0]["marker"]["size"] = 4
    shapes: list[dict[str, Any]] = []
    shown = [*view.versions, *([view.preview] if view.preview else [])]
    for i, curve in enumerate(shown):
        colour = COLOURS[i % len(COLOURS)]
        traces += _version(curve, zero, colour)
        if curve.in_use or curve.key is None:
            shapes += [
                _edge((instant - zero) * 1e3, colour) for instant in (curve.start_s, curve.stop_s)
            ]
    return figure(traces, "time since contact (ms)", "force (kN)", shapes=shapes)


def _version(curve: PulseCurve, zero: float, colour: str) -> list[Trace]:
    name = (
        "preview"
        if curve.key is None
        else f"version {curve.key}" + (", in use" if curve.in_use else "")
    )
    dash = "dash" if curve.key is None else "solid" if curve.in_use else "dot"
    return [
        line(_ms(curve.time_s, zero), _kilo(curve.force_n), name, colour, dash=dash),
        points(
            _ms(curve.points_time_s, zero),
            _kilo(curve.points_n),
            f"points of {name}",
            colour,
            visible="legendonly",
        ),  # what the models take
    ]


def _ms(time_s: Any, zero: float) -> Any:
    return (np.asarray(time_s) - zero) * 1e3


def _kilo(force_n: Any) -> Any:
    return np.asarray(force_n, dtype=np.float64) * 1e-3


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
    scale, axis = (
        (1.0, "share of contact") if overlay.normalised else (1e3, "time since contact (ms)")
    )
    x = overlay.axis * scale
    traces: list[Trace] = []
    per_group = max(1, _CURVES // max(1, len(overlay.groups)))
    for i, group in enumerate(overlay.groups):
        colour, name = (
            COLOURS[i % len(COLOURS)],
            f"{level_words(overlay.factor, group.level)} ({group.count})",
        )
        if group.count > 1:
            low, high = (group.mean_n + sign * group.deviation_n for sign in (-1, 1))
            traces += band(x, low * 1e-3, high * 1e-3, f"{name}: ± standard deviation", colour)
            traces[-1]["legendgroup"] = traces[-2]["legendgroup"] = name
            traces[-1]["showlegend"] = False
        for place in np.linspace(0, group.count - 1, min(per_group, group.count)).astype(int):
            thin = line(
                x,
                group.force_n[place] * 1e-3,
                f"impact {group.impacts[place]}",
                f"{colour}/0.35",
                width=1,
            )
            traces.append({**thin, "showlegend": False, "legendgroup": name, "hoverinfo": "name"})
        traces.append({**line(x, group.mean_n * 1e-3, name, colour, width=3), "legendgroup": name})
    return figure(traces, axis, "force (kN)")


def level_words(factor: str, level: float | str | None) -> str:
    """A level as a person reads it, in the unit of its heading."""
    if level is None:
        return "not recorded"
    if isinstance(level, str):
        return level
    display = display_of(factor)
    return f"{_number(level * display.scale)} {display.unit}".strip()


def signal_figure(window: SignalWindow) -> Figure:
    """A channel over ms of the recording's clock; the page fetches more samples as one zooms in
    (impact.js)."""
    display = display_of_unit(window.unit)
    curve = line(
        window.time_s * 1e3, window.values * display.scale, window.channel, "c0", width=1.2
    )
    return figure([curve], "time (ms)", f"{window.quantity} ({display.unit})", showlegend=False)


#: Under a cursor: the level, and how far it is from the reference.
_CURSOR = "%{y:.4g} g, %{customdata:+.1f} dB<extra>%{fullData.name}</extra>"
_HELD = "shock response (g)"


def spectra_figure(overlay: SpectrumOverlay, sides: bool = False) -> Figure:
    """Maximax of each, or its positive and negative sides; the cursor reads dB from the reference
    at that line."""
    target = overlay.comparison.target
    lines = overlay.comparison.frequency_hz
    traces: list[Trace] = []
    for overlaid_band in sorted(overlay.bands, key=_width, reverse=True):
        edges = (
            overlaid_band.lower_m_s2 / STANDARD_GRAVITY_M_S2,
            overlaid_band.upper_m_s2 / STANDARD_GRAVITY_M_S2,
        )
        traces += band(lines, *edges, _band_name(overlaid_band), "c7")
    shown = "%{y:.4g} g<extra>reference</extra>"
    reference = line(
        lines,
        target.level_m_s2 / STANDARD_GRAVITY_M_S2,
        "reference",
        "quiet",
        dash="dash",
        hovertemplate=shown,
    )
    traces.append(reference)
    for i, overlaid in enumerate(overlay.spectra):
        traces += _curves(
            overlay, overlaid, COLOURS[i % len(COLOURS)], DASHES[i % len(DASHES)], sides
        )
    return figure(traces, "frequency (Hz)", _HELD, log_x=True, log_y=True, hovermode="x")


def _curves(
    overlay: SpectrumOverlay, impact_spectrum: ImpactSpectrum, colour: str, dash: str, sides: bool
) -> list[Trace]:
    name = f"impact {impact_spectrum.impact}, {impact_spectrum.channel}"
    spectrum = impact_spectrum.spectrum
    shown = {"": (spectrum.maximax, dash)}
    if sides:
        shown = {" positive": (spectrum.positive, "solid"), " negative": (spectrum.negative, "dot")}
    x = overlay.frequency_hz
    return [
        {
            **line(x, _above(level) / STANDARD_GRAVITY_M_S2, name + side, colour, dash=dash),
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
    held = np.interp(
        np.log(overlay.frequency_hz), np.log(target.frequency_hz), np.log10(target.level_m_s2)
    )
    with np.errstate(divide="ignore"):
        error = 20 * (np.log10(level) - held)
    shown = np.where(inside & (level > 0), error, np.nan)
    return [None if math.isnan(value) else round(float(value), 2) for value in shown]


def _width(band: ReferenceBand) -> float:
    return band.db if band.db is not None else math.inf


def _band_name(band: ReferenceBand) -> str:
    return "specification's tolerance" if band.db is None else f"±{band.db:g} dB"


def four_coordinate_figure(overlay: SpectrumOverlay) -> Figure:
    """Pseudo-velocity on four-coordinate paper: diagonals are constant acceleration (falling) and
    displacement."""
    x = overlay.frequency_hz
    curves = [overlaid.spectrum.pseudo_velocity_m_s for overlaid in overlay.spectra]
    traces = [
        line(
            x,
            _above(curve),
            f"impact {overlaid.impact}, {overlaid.channel}",
            COLOURS[i % len(COLOURS)],
            dash=DASHES[i % len(DASHES)],
        )
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


def paper_lines(
    lowest: float, right: float, low: float, high: float
) -> tuple[list[Trace], list[dict[str, Any]]]:
    """Diagonals of whole decades within a frame of Hz and m/s: v = a / (2 pi f) and v = 2 pi f d,
    and their names."""
    traces: list[Trace] = []
    words: list[dict[str, Any]] = []
    corners = [(f, v) for f in (lowest, right) for v in (low, high)]
    for exponent in _decades([2 * math.pi * f * v / STANDARD_GRAVITY_M_S2 for f, v in corners]):
        acceleration = 10.0**exponent * STANDARD_GRAVITY_M_S2
        _diagonal(
            traces,
            words,
            acceleration / (2 * math.pi),
            -1,
            (lowest, right, low, high),
            f"{10.0**exponent:g} g",
        )
    for exponent in _decades([v / (2 * math.pi * f) for f, v in corners]):
        displacement = 10.0**exponent
        _diagonal(
            traces,
            words,
            2 * math.pi * displacement,
            1,
            (lowest, right, low, high),
            _length(displacement),
        )
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
    share = (
        0.15 if slope < 0 else 0.85
    )  # falling lines are named at their left, rising ones at their right: apart
    named = begin ** (1 - share) * end**share
    place = {"x": math.log10(named), "y": math.log10(constant * named**slope), "showarrow": False}
    words.append(
        {**place, "text": name, "bgcolor": "card/0.8", "font": {"size": 10, "color": "quiet"}}
    )


def _number(value: float | None, digits: int = 4) -> str:
    """A number with a true minus sign."""
    return format_number(value, digits).replace("-", "−")
