"""Figures of a prediction with its bands, and of the measured shots beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ....array_types import Floats
from ....twin.prediction import Prediction
from ....twin.srs.target import Target
from ...common.number_format import format_number
from ...common.quantities import display_of
from ...figures.figure import (
    BandSeries,
    ColourRole,
    LineSeries,
    Plot,
    PlotAxis,
    PlotGrid,
    PlotSeries,
    PointSeries,
    as_floats,
    category,
)
from .nearest_shots import MeasuredShot
from .validity import warning_sentences

#: Points of an acceleration on the screen, and how much of it is shown.
_POINTS, _UNTIL_S = 400, 0.01
#: A side of a tolerance without a limit is drawn so far away (dB).
_FAR_DB = 40.0
#: Of the spectra that are stored of measured shots.
_MEASURED_Q = 10.0
#: Sensor -> frequencies and maximax, by the key of the impact.
Spectra = Mapping[int, Mapping[str, tuple[Any, Any]]]
#: Measured shots, and the nearest of them.
_SHOTS, _NEAREST = ColourRole.CATEGORY_7, ColourRole.CATEGORY_3


def _shown(key: str) -> tuple[str, float]:
    """Unit and scale of a quantity."""
    display = display_of(key)
    return display.unit, display.scale


def force_figure(prediction: Prediction, shots: Sequence[MeasuredShot] = ()) -> Plot:
    """Contact force in kN over ms, and that of measured shots."""
    (time_unit, per_s), (unit, per_n) = _shown("contact_time_s"), _shown("peak_force_n")
    seconds, force = prediction.time_s * per_s, prediction.force_n
    series: list[PlotSeries] = [
        BandSeries(seconds, force.lower * per_n, force.upper * per_n, name="90 % band")
    ]
    for shot in shots:
        if shot.contact_time_s is not None and len(shot.force_n) > 1:
            times = np.linspace(0.0, shot.contact_time_s * per_s, len(shot.force_n))
            series.append(
                LineSeries(
                    times,
                    per_n * as_floats(shot.force_n),
                    width=1,
                    name="nearest measured shots",
                    detail=shot.name,
                    role=_NEAREST,
                )
            )
    series.append(LineSeries(seconds, force.mean * per_n, name="mean"))
    axes = PlotAxis("time since contact", time_unit), PlotAxis("force", unit)
    return Plot("Contact force", *axes, tuple(series))


def acceleration_figure(prediction: Prediction) -> Plot:
    """Acceleration of each sensor in g over ms, from the beginning of contact."""
    series: list[PlotSeries] = []
    (time_unit, per_s), (unit, scale) = _shown("contact_time_s"), _shown("peak_acceleration_m_s2")
    for i, sensor in enumerate(prediction.sensors):
        seconds, acceleration = prediction.acceleration(sensor, _UNTIL_S)
        every = slice(None, None, max(1, seconds.size // _POINTS))
        shown = seconds[every] * per_s
        mean, low, high = (
            scale * values[every]
            for values in (acceleration.mean, acceleration.lower, acceleration.upper)
        )
        series += _with_band(shown, mean, low, high, sensor, i, width=1.2)
    axes = PlotAxis("time since contact", time_unit), PlotAxis("acceleration", unit)
    return Plot("Acceleration", *axes, tuple(series))


def _with_band(
    x: Floats, mean: Floats, low: Floats, high: Floats, name: str, i: int, width: float = 2.0
) -> list[PlotSeries]:
    return [
        BandSeries(x, low, high, name=f"{name}: 90 %", role=category(i)),
        LineSeries(x, mean, width=width, name=name, role=category(i)),
    ]


def spectrum_figure(
    prediction: Prediction, spectra: Spectra | None = None, target: Target | None = None
) -> Plot:
    """Maximax shock response spectrum of each sensor in g; `spectra` are those of measured shots,
    at Q = 10; `target` is a specification that is shown with its tolerance."""
    lines, (unit, scale) = prediction.frequency_hz, _shown("peak_acceleration_m_s2")
    series: list[PlotSeries] = [] if target is None else _prescribed(target, lines, scale)
    for i, (sensor, levels) in enumerate(prediction.spectra_m_s2.items()):
        mean, low, high = (scale * values for values in (levels.mean, levels.lower, levels.upper))
        series += _with_band(lines, mean, low, high, sensor, i)
        measured = [
            of_sensor[sensor] for of_sensor in (spectra or {}).values() if sensor in of_sensor
        ]
        if measured and prediction.q == _MEASURED_Q:
            frequency, maximax = (np.concatenate(values) for values in zip(*measured, strict=True))
            inside = (frequency >= lines[0]) & (frequency <= lines[-1])
            series.append(
                PointSeries(
                    frequency[inside],
                    maximax[inside] * scale,
                    name=f"{sensor}, measured",
                    role=category(i),
                    opacity=0.7,
                )
            )
    x = PlotAxis("natural frequency", "Hz", scale="log")
    y = PlotAxis(f"maximax SRS, Q = {prediction.q:g}", unit, scale="log")
    return Plot("Shock response spectrum", x, y, tuple(series))


def _prescribed(target: Target, lines: Floats, scale: float) -> list[PlotSeries]:
    """A specification with its tolerance as far as the lines of the prediction reach. A side
    without a limit is drawn as far away as any spectrum is shown."""
    dense = np.union1d(np.geomspace(lines[0], lines[-1], 100), target.frequency_hz)
    inside = (dense >= max(lines[0], target.frequency_hz[0])) & (
        dense <= min(lines[-1], target.frequency_hz[-1])
    )
    if not inside.any():
        return []
    at = target.at(dense[inside])
    level, hz = scale * at.level_m_s2, at.frequency_hz
    low, high = (
        level * 10 ** (side.clip(-_FAR_DB, _FAR_DB) / 20) for side in (-at.lower_db, at.upper_db)
    )
    return [
        BandSeries(hz, low, high, name=tolerance_words(target), role=ColourRole.TOLERANCE),
        LineSeries(hz, level, "dash", name="prescribed", role=ColourRole.REFERENCE),
    ]


def tolerance_words(target: Target) -> str:
    """`tolerance +6/−6 dB`, with the sides of the first three bands."""
    sides = list(
        dict.fromkeys(zip(target.upper_db.tolist(), target.lower_db.tolist(), strict=True))
    )
    words = " and ".join(f"{_side('+', up)}/{_side('−', low)} dB" for up, low in sides[:3])
    return f"tolerance {words}{' and others' if len(sides) > 3 else ''}"


def _side(sign: str, value: float) -> str:
    return f"{sign}{format_number(value, 3)}" if np.isfinite(value) else "no limit"


def velocity_figure(
    prediction: Prediction, shots: Sequence[MeasuredShot], near: Sequence[MeasuredShot]
) -> Plot:
    """The predicted velocity with its band at its tank pressure, and the measured shots."""
    unit, scale = _shown("tank_pressure_pa")
    pressure, velocity = prediction.setting.tank_pressure_pa or 0.0, prediction.velocity_m_s
    series: list[PlotSeries] = []
    for group, name, role in (
        (shots, "measured shots", _SHOTS),
        (near, "nearest measured shots", _NEAREST),
    ):
        measured = [shot for shot in group if _has_velocity(shot)]
        if measured:
            x = scale * as_floats([shot.setting["tank_pressure_pa"] for shot in measured])
            y = as_floats([shot.velocity_m_s for shot in measured])
            labels = tuple(shot.name for shot in measured)
            series.append(PointSeries(x, y, labels=labels, name=name, role=role))
    low, high = velocity.ci90
    series.append(
        PointSeries(
            as_floats([pressure * scale]),
            as_floats([velocity.mean]),
            y_low=as_floats([low]),
            y_high=as_floats([high]),
            name="prediction with its 90 % band",
        )
    )
    axes = PlotAxis("tank pressure, gauge", unit), PlotAxis("impact velocity", "m/s")
    return Plot("Impact velocity", *axes, tuple(series))


def _has_velocity(shot: MeasuredShot) -> bool:
    return shot.velocity_m_s is not None and "tank_pressure_pa" in shot.setting


def prediction_figures(
    prediction: Prediction,
    shots: Sequence[MeasuredShot] = (),
    near: Sequence[MeasuredShot] = (),
    spectra: Spectra | None = None,
    target: Target | None = None,
) -> dict[str, Plot]:
    """By name; without a plate no spectrum, without a gun no velocity. `target` is shown in the
    spectrum."""
    figures = {"force": force_figure(prediction, near)}
    if prediction.sensors:
        figures["spectrum"] = spectrum_figure(prediction, spectra, target)
    if prediction.setting.tank_pressure_pa is not None:
        figures["velocity"] = velocity_figure(prediction, shots, near)
    if prediction.sensors:
        figures["acceleration"] = acceleration_figure(prediction)
    return figures


def prediction_figure(prediction: Prediction) -> PlotGrid:
    """Force, accelerations and spectra below each other, the force alone without a plate; and what
    the bands rest on, with the warnings."""
    makers = (force_figure, acceleration_figure, spectrum_figure)
    plots = [make(prediction) for make in makers[: 3 if prediction.sensors else 1]]
    notes = tuple(
        sentence
        for sentence in (prediction.rests_on.sentence, *map(str, warning_sentences(prediction)))
        if sentence
    )
    return PlotGrid("Predicted shot", tuple((plot,) for plot in plots), notes=notes)
