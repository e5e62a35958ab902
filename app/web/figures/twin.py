"""Charts of a prediction: pulse, acceleration and spectrum with their 90 % bands; and of proposals for a spectrum."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ....twin.prediction import Prediction
from .base import COLOURS, Figure, Trace, band, figure, line

#: Points of an acceleration on the screen, and how much of it is shown.
_POINTS, _UNTIL_S = 400, 0.01


def force_figure(prediction: Prediction) -> Figure:
    """Contact force in kN over ms."""
    time, force = prediction.time_s * 1e3, prediction.force_n
    traces = band(time, force.lower / 1e3, force.upper / 1e3, "90 % band")
    return figure([*traces, line(time, force.mean / 1e3, "mean")], "time since contact (ms)", "force (kN)")


def acceleration_figure(prediction: Prediction) -> Figure:
    """Acceleration of each sensor in m/s² over ms, from the beginning of contact."""
    traces: list[Trace] = []
    for i, sensor in enumerate(prediction.sensors):
        time, acceleration = prediction.acceleration(sensor, _UNTIL_S)
        every = slice(None, None, max(1, time.size // _POINTS))
        colour = COLOURS[i % len(COLOURS)]
        traces += band(
            time[every] * 1e3, acceleration.lower[every], acceleration.upper[every], f"{sensor}: 90 %", colour
        )
        traces.append(line(time[every] * 1e3, acceleration.mean[every], sensor, colour, width=1.2))
    return figure(traces, "time since contact (ms)", "acceleration (m/s²)")


def spectrum_figure(prediction: Prediction) -> Figure:
    """Maximax shock response spectrum of each sensor."""
    traces: list[Trace] = []
    lines = prediction.frequency_hz
    for i, (sensor, spectrum_band) in enumerate(prediction.spectra_m_s2.items()):
        colour = COLOURS[i % len(COLOURS)]
        traces += band(lines, spectrum_band.lower, spectrum_band.upper, f"{sensor}: 90 %", colour)
        traces.append(line(lines, spectrum_band.mean, sensor, colour))
    title = f"maximax (m/s²), Q = {prediction.q:g}"
    return figure(traces, "frequency (Hz)", title, log_x=True, log_y=True)


def prediction_figures(prediction: Prediction) -> dict[str, Figure]:
    """By name; without a plate, the force alone."""
    figures = {"force": force_figure(prediction)}
    if prediction.sensors:
        figures |= {"spectrum": spectrum_figure(prediction), "acceleration": acceleration_figure(prediction)}
    return figures


def tuned_figure(found: Mapping[str, Any], most: int = 3) -> Figure:
    """The first proposals in the tolerance of what is prescribed (`tuning.tune_job`'s result)."""
    lines = found["frequency_hz"]
    low, high = (np.asarray(found[key]) for key in ("lower_m_s2", "upper_m_s2"))
    traces = band(lines, low, high, "tolerance", "c7")
    traces.append(line(lines, found["prescribed_m_s2"], "prescribed", "quiet", dash="dash"))
    for i, proposal in enumerate(found["proposals"][:most]):
        name = f"proposal {proposal['rank']}: {proposal['probability_within']:.0%}"
        if i == 0:
            traces += band(lines, proposal["lower_m_s2"], proposal["upper_m_s2"], "90 % of the first", COLOURS[i])
        traces.append(line(lines, proposal["expected_m_s2"], name, COLOURS[i], dash="solid" if i == 0 else "dot"))
    return figure(traces, "frequency (Hz)", "maximax (m/s²)", log_x=True, log_y=True)
