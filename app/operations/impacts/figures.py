"""Figures of pulses (one impact's segmentation, many by the levels of a factor), of recorded
channels, and of shock response spectra: levels with tolerance bands, and pseudo-velocity on
four-coordinate paper."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ....array_types import Floats
from ...common.number_format import format_number
from ...common.quantities import display_of, display_of_unit
from ...common.unit_endings import STANDARD_GRAVITY_M_S2
from ...figures.figure import (
    DASHES,
    BandSeries,
    ColourRole,
    Dash,
    LineSeries,
    Plot,
    PlotAxis,
    PlotSeries,
    PointSeries,
    ReferenceLine,
    TextLabel,
    as_floats,
    category,
)
from .curves import PulseCurve, PulseView
from .overlays import ImpactSpectrum, PulseOverlay, ReferenceBand, SpectrumOverlay
from .signals import SignalWindow

#: Thin curves beside a mean: more of them are a stain.
_CURVES = 60
_SINCE_CONTACT, _FORCE = PlotAxis("time since contact", "ms"), PlotAxis("force", "kN")
_FREQUENCY = PlotAxis("frequency", "Hz", scale="log")


def segmentation_figure(view: PulseView) -> Plot:
    """Force about the contact in N over ms since the contact of the version in use, each version
    over it."""
    used = next((version for version in view.versions if version.in_use), view.versions[-1])
    zero = used.start_s
    record = PointSeries(
        _ms(view.time_s, zero),
        _kilo(view.force_n),
        size=4,
        name="record",
        role=ColourRole.QUIET,
    )
    series: list[PlotSeries] = [record]
    edges: list[ReferenceLine] = []
    for i, curve in enumerate([*view.versions, *([view.preview] if view.preview else [])]):
        role = category(i)
        series += _version(curve, zero, role)
        if curve.in_use or curve.key is None:
            edges += [
                ReferenceLine("x", (instant - zero) * 1e3, role=role, dash="dot")
                for instant in (curve.start_s, curve.stop_s)
            ]
    return Plot("Pulse", _SINCE_CONTACT, _FORCE, tuple(series), tuple(edges))


def _version(curve: PulseCurve, zero: float, role: ColourRole) -> list[PlotSeries]:
    name = (
        "preview"
        if curve.key is None
        else f"version {curve.key}" + (", in use" if curve.in_use else "")
    )
    dash: Dash = "dash" if curve.key is None else "solid" if curve.in_use else "dot"
    time, force = _ms(curve.time_s, zero), _kilo(curve.force_n)
    return [
        LineSeries(time, force, dash, name=name, role=role),
        PointSeries(
            _ms(curve.points_time_s, zero),
            _kilo(curve.points_n),
            name=f"points of {name}",
            role=role,
            hidden=True,
        ),  # what the models take
    ]


def _ms(time_s: ArrayLike, zero: float) -> Floats:
    return (np.asarray(time_s, dtype=np.float64) - zero) * 1e3


def _kilo(force_n: ArrayLike) -> Floats:
    return np.asarray(force_n, dtype=np.float64) * 1e-3


def overlay_figure(overlay: PulseOverlay) -> Plot:
    """Mean pulse of each level in kN with its standard deviation, and some of the pulses."""
    scale = 1.0 if overlay.normalised else 1e3
    x = overlay.axis * scale
    series: list[PlotSeries] = []
    per_group = max(1, _CURVES // max(1, len(overlay.groups)))
    for i, group in enumerate(overlay.groups):
        role, name = category(i), f"{level_words(overlay.factor, group.level)} ({group.count})"
        if group.count > 1:
            low, high = (_kilo(group.mean_n + sign * group.deviation_n) for sign in (-1, 1))
            words = f"{name}: ± standard deviation"
            series.append(BandSeries(x, low, high, name=name, detail=words, role=role))
        series += [
            LineSeries(
                x,
                _kilo(group.force_n[place]),
                width=1,
                name=name,
                detail=f"impact {group.impacts[place]}",
                role=role,
                opacity=0.35,
            )
            for place in np.linspace(0, group.count - 1, min(per_group, group.count)).astype(int)
        ]
        series.append(LineSeries(x, _kilo(group.mean_n), width=3, name=name, role=role))
    axis = PlotAxis("share of contact", "1") if overlay.normalised else _SINCE_CONTACT
    return Plot("Pulses", axis, _FORCE, tuple(series))


def level_words(factor: str, level: float | str | None) -> str:
    """A level as a person reads it, in the unit of its heading."""
    if level is None:
        return "not recorded"
    if isinstance(level, str):
        return level
    display = display_of(factor)
    return f"{_number(level * display.scale)} {display.unit}".strip()


def signal_figure(window: SignalWindow) -> Plot:
    """A channel over ms of the recording's clock; the page fetches more samples as one zooms in
    (impact.js)."""
    display = display_of_unit(window.unit)
    curve = LineSeries(
        window.time_s * 1e3, window.values * display.scale, width=1.2, detail=window.channel
    )
    y = PlotAxis(window.quantity, display.unit or "1")
    return Plot(f"Channel {window.channel}", PlotAxis("time", "ms"), y, (curve,))


def spectra_figure(overlay: SpectrumOverlay, sides: bool = False) -> Plot:
    """Maximax of each, or its positive and negative sides; the cursor reads dB from the reference
    at that line."""
    target = overlay.comparison.target
    lines = overlay.comparison.frequency_hz
    series: list[PlotSeries] = []
    for overlaid_band in sorted(overlay.bands, key=_width, reverse=True):
        low, high = (
            edge / STANDARD_GRAVITY_M_S2
            for edge in (overlaid_band.lower_m_s2, overlaid_band.upper_m_s2)
        )
        name = _band_name(overlaid_band)
        series.append(BandSeries(lines, low, high, name=name, role=ColourRole.TOLERANCE))
    series.append(
        LineSeries(
            lines,
            target.level_m_s2 / STANDARD_GRAVITY_M_S2,
            "dash",
            name="reference",
            role=ColourRole.REFERENCE,
        )
    )
    for i, overlaid in enumerate(overlay.spectra):
        series += _curves(overlay, overlaid, i, sides)
    level = PlotAxis("shock response", "g", scale="log")
    title = "Shock response spectra"
    return Plot(title, _FREQUENCY, level, tuple(series), cursor="column")


def _curves(
    overlay: SpectrumOverlay, impact_spectrum: ImpactSpectrum, i: int, sides: bool
) -> list[PlotSeries]:
    name = f"impact {impact_spectrum.impact}, {impact_spectrum.channel}"
    spectrum = impact_spectrum.spectrum
    shown: dict[str, tuple[Floats, Dash]] = {"": (spectrum.maximax, DASHES[i % len(DASHES)])}
    if sides:
        shown = {" positive": (spectrum.positive, "solid"), " negative": (spectrum.negative, "dot")}
    return [
        LineSeries(
            overlay.frequency_hz,
            level / STANDARD_GRAVITY_M_S2,
            dash,
            labels=_decibels(overlay, level),
            name=name + side,
            role=category(i),
        )
        for side, (level, dash) in shown.items()
    ]


def _decibels(overlay: SpectrumOverlay, level: Floats) -> tuple[str, ...]:
    """From the reference, along its straight lines between break points; "" beyond it."""
    target = overlay.reference
    inside = target.covers(overlay.frequency_hz)
    held = np.interp(
        np.log(overlay.frequency_hz), np.log(target.frequency_hz), np.log10(target.level_m_s2)
    )
    with np.errstate(divide="ignore"):
        error = 20 * (np.log10(level) - held)
    shown = np.where(inside & (level > 0), error, np.nan)
    return tuple("" if math.isnan(value) else f"{value:+.1f} dB" for value in shown)


def _width(band: ReferenceBand) -> float:
    return band.db if band.db is not None else math.inf


def _band_name(band: ReferenceBand) -> str:
    return "specification's tolerance" if band.db is None else f"±{band.db:g} dB"


def four_coordinate_figure(overlay: SpectrumOverlay) -> Plot:
    """Pseudo-velocity on four-coordinate paper: diagonals are constant acceleration (falling) and
    displacement."""
    x = overlay.frequency_hz
    curves = [overlaid.spectrum.pseudo_velocity_m_s for overlaid in overlay.spectra]
    series = [
        LineSeries(
            x,
            curve,
            DASHES[i % len(DASHES)],
            name=f"impact {overlaid.impact}, {overlaid.channel}",
            role=category(i),
        )
        for i, (overlaid, curve) in enumerate(zip(overlay.spectra, curves, strict=True))
    ]
    positive = np.concatenate([curve[curve > 0] for curve in curves])
    low, high = 10 ** np.floor(np.log10(positive.min())), 10 ** np.ceil(np.log10(positive.max()))
    return four_coordinate_plot("Pseudo-velocity", x, (float(low), float(high)), series)


def four_coordinate_plot(
    title: str, frequency_hz: Floats, velocity_m_s: tuple[float, float], series: list[LineSeries]
) -> Plot:
    """Curves of pseudo-velocity on four-coordinate paper between two velocities."""
    ends = float(frequency_hz.min()), float(frequency_hz.max())
    paper, words = paper_lines(*ends, *velocity_m_s)
    velocity = PlotAxis("pseudo-velocity", "m/s", scale="log", limits=velocity_m_s)
    frequency = PlotAxis("natural frequency", "Hz", scale="log")
    return Plot(title, frequency, velocity, (*paper, *series), labels=tuple(words))


def paper_lines(
    lowest: float, right: float, low: float, high: float
) -> tuple[list[LineSeries], list[TextLabel]]:
    """Diagonals of whole decades within a frame of Hz and m/s: v = a / (2 pi f) and v = 2 pi f d,
    and their names."""
    frame = lowest, right, low, high
    corners = [(f, v) for f in (lowest, right) for v in (low, high)]
    diagonals = [
        (10.0**exponent * STANDARD_GRAVITY_M_S2 / (2 * math.pi), -1, f"{10.0**exponent:g} g")
        for exponent in _decades([2 * math.pi * f * v / STANDARD_GRAVITY_M_S2 for f, v in corners])
    ]
    diagonals += [
        (2 * math.pi * 10.0**exponent, 1, _length(10.0**exponent))
        for exponent in _decades([v / (2 * math.pi * f) for f, v in corners])
    ]
    drawn = [_diagonal(constant, slope, frame, name) for constant, slope, name in diagonals]
    pairs = [pair for pair in drawn if pair is not None]
    return [line for line, _ in pairs], [label for _, label in pairs]


def _decades(values: list[float]) -> range:
    return range(math.ceil(math.log10(min(values))), math.floor(math.log10(max(values))) + 1)


def _length(metres: float) -> str:
    for unit, scale in (("m", 1.0), ("mm", 1e3), ("µm", 1e6), ("nm", 1e9)):
        if metres * scale >= 0.999:
            return f"{metres * scale:g} {unit}"
    return f"{metres:g} m"


def _diagonal(
    constant: float, slope: int, frame: tuple[float, float, float, float], name: str
) -> tuple[LineSeries, TextLabel] | None:
    """v = constant * f ** slope, cut by the frame, and its name; None where it crosses a corner
    only."""
    lowest_hz, right, low, high = frame
    crossings = sorted((v / constant) ** slope for v in (low, high))
    begin, end = max(lowest_hz, crossings[0]), min(right, crossings[1])
    if end <= begin * 1.05:
        return None
    f = as_floats([begin, end])
    rule = LineSeries(
        f, constant * f**slope, width=1, detail=name, role=ColourRole.RULE, silent=True
    )
    # falling lines are named at their left, rising ones at their right: apart
    share = 0.15 if slope < 0 else 0.85
    place = begin ** (1 - share) * end**share
    return rule, TextLabel(name, place, constant * place**slope)


def _number(value: float | None, digits: int = 4) -> str:
    """A number with a true minus sign."""
    return format_number(value, digits).replace("-", "−")
