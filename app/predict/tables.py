"""A prediction as a person reads it: as tables and as a picture of force, acceleration and spectra with their bands."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from textwrap import fill
from typing import Any

from ...array_types import Floats
from ...twin.prediction import Band, Prediction, Quantity
from ..common.plots import MEASURED, MODEL, new_figure, save
from .predicting import warnings, warnings_of_number

#: Field of the prediction: (what it is, unit, how many of them one SI unit is).
_QUANTITIES = {
    "velocity_m_s": ("impact velocity", "m/s", 1.0),
    "contact_time_s": ("contact time", "ms", 1e3),
    "compression_time_s": ("compression time", "ms", 1e3),
    "peak_force_n": ("peak force", "kN", 1e-3),
    "impulse_n_s": ("impulse", "N s", 1.0),
}


def quantity_rows(prediction: Prediction) -> Iterator[dict[str, Any]]:
    """Named quantities with their 90 % intervals; with `warning` where an input is beyond what was learned."""
    for field, (what, unit, scale) in _QUANTITIES.items():
        warning = warnings_of_number(prediction, field)
        yield _row(what, unit, getattr(prediction, field), scale) | ({"warning": warning} if warning else {})
    for sensor in prediction.sensors:
        yield _row(f"peak {sensor}", "m/s2", prediction.peak_acceleration_m_s2(sensor), 1.0)


def _row(what: str, unit: str, quantity: Quantity, scale: float) -> dict[str, Any]:
    low, high = (scale * end for end in quantity.ci90)
    return {"quantity": what, "unit": unit, "mean": scale * quantity.mean, "low": low, "high": high}


def spectrum_rows(prediction: Prediction) -> Iterator[dict[str, Any]]:
    """Lines of the spectra, m/s2: every third, and the last; nothing without a plate."""
    if not prediction.sensors:
        return
    last = prediction.frequency_hz.size - 1
    for line in dict.fromkeys((*range(0, last, 3), last)):
        row: dict[str, Any] = {"Hz": float(prediction.frequency_hz[line])}
        for sensor, band in prediction.spectra_m_s2.items():
            row[f"{sensor} (m/s2)"] = float(band.mean[line])
            row[f"{sensor} 90 %"] = f"{band.lower[line]:.4g} to {band.upper[line]:.4g}"
        yield row


_COLOURS = (MEASURED, MODEL, "#3a7d44", "#7b2d8b")


def plot_prediction(prediction: Prediction, path: Path) -> None:
    """Write the picture, above it what the bands rest on and the warnings; the suffix decides the format.

    `ValueError` for one that cannot be drawn.
    """
    figure = new_figure(8, 8 if prediction.sensors else 3)
    words = " ".join((prediction.rests_on.sentence, *warnings(prediction))).strip()
    figure.suptitle(fill(words, 110), fontsize="small", x=0.02, ha="left")
    draw_prediction(list(figure.subplots(3 if prediction.sensors else 1, squeeze=False)[:, 0]), prediction)
    save(figure, path)


def draw_prediction(rows: Sequence[Any], prediction: Prediction) -> None:
    """Force, accelerations and spectra with their bands on three axes; on one, the force alone."""
    _band(rows[0], prediction.time_s * 1e3, prediction.force_n, "force", MEASURED, 1e-3)
    rows[0].set(xlabel="time since first contact (ms)", ylabel="force (kN)")
    for axes, draw in zip(rows[1:], (_accelerations, _spectra), strict=False):
        draw(axes, prediction)
        axes.legend(frameon=False)


def _accelerations(axes: Any, prediction: Prediction) -> None:
    for sensor, colour in zip(prediction.sensors, _COLOURS, strict=False):
        time, band = prediction.acceleration(sensor, 0.005)
        _band(axes, time * 1e3, band, sensor, colour)
    axes.set(xlabel="time since first contact (ms)", ylabel="acceleration (m/s2)")


def _spectra(axes: Any, prediction: Prediction) -> None:
    for (sensor, band), colour in zip(prediction.spectra_m_s2.items(), _COLOURS, strict=False):
        _band(axes, prediction.frequency_hz, band, sensor, colour)
    axes.set(xscale="log", yscale="log", xlabel="natural frequency (Hz)")
    axes.set_ylabel(f"maximax SRS, Q = {prediction.q:g} (m/s2)")


def _band(axes: Any, x: Floats, band: Band, label: str, colour: str, scale: float = 1.0) -> None:
    axes.plot(x, scale * band.mean, color=colour, lw=1.2, label=label)
    axes.fill_between(x, scale * band.lower, scale * band.upper, color=colour, alpha=0.2, lw=0)
