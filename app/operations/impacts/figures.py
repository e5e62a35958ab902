"""Figures of pulses: one impact's segmentation, and many by the levels of a factor."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ....array_types import Floats
from ...common.number_format import format_number
from ...common.quantities import display_of
from ...figures.figure import (
    BandSeries,
    ColourRole,
    Dash,
    LineSeries,
    Plot,
    PlotAxis,
    PlotSeries,
    PointSeries,
    ReferenceLine,
    category,
    curve_style,
)
from .curves import PulseCurve, PulseView
from .overlays import PulseOverlay

#: Thin curves beside a mean: more of them are a stain.
_CURVES = 60
_SINCE_CONTACT, _FORCE = PlotAxis("time since contact", "ms"), PlotAxis("force", "kN")


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
        role, dash = curve_style(i)
        name = f"{level_words(overlay.factor, group.level)} ({group.count})"
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
        series.append(LineSeries(x, _kilo(group.mean_n), dash, width=3, name=name, role=role))
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


def _number(value: float | None, digits: int = 4) -> str:
    """A number with a true minus sign."""
    return format_number(value, digits).replace("-", "−")
