"""A prediction as a person reads it: as tables and as a picture of force, acceleration and spectra
with their bands."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from textwrap import fill
from typing import Any

from ....array_types import Floats
from ....twin.prediction import Band, Prediction, Quantity
from ...common.number_format import format_interval
from ...common.plots import MEASURED, MODEL, new_figure, save
from ...common.quantities import Display, display_of
from .predicting import warnings, warnings_of_number

#: Numbers of the prediction, in their order.
_QUANTITIES = (
    "velocity_m_s",
    "contact_time_s",
    "compression_time_s",
    "peak_force_n",
    "impulse_n_s",
)

_ACCELERATION, _TIME = "acceleration_m_s2", "time_since_first_contact_s"


def quantity_rows(prediction: Prediction) -> Iterator[dict[str, Any]]:
    """Named quantities, 90 % intervals as texts; with `warning` where an input is beyond what was
    learned."""
    for field in _QUANTITIES:
        warning = warnings_of_number(prediction, field)
        shown = display_of(field)
        yield _row(shown.label, shown, getattr(prediction, field)) | (
            {"warning": warning} if warning else {}
        )
    for sensor in prediction.sensors:
        yield _row(
            f"peak {sensor}, {band_words(prediction)}",
            display_of(_ACCELERATION),
            prediction.peak_acceleration_m_s2(sensor),
        )


def band_words(prediction: Prediction) -> str:
    """`0 to 19.9 kHz`: what the peak of an acceleration is of."""
    shown = display_of("sampling_rate_hz")
    return f"0 to {shown.scale * prediction.acceleration_band_hz:.3g} {shown.unit}"


def _row(what: str, shown: Display, quantity: Quantity) -> dict[str, Any]:
    mean, low, high = format_interval(
        *(shown.scale * item for item in (quantity.mean, *quantity.ci90))
    )
    return {"quantity": what, "unit": shown.unit, "mean": mean, "low": low, "high": high}


def spectrum_rows(prediction: Prediction) -> Iterator[dict[str, Any]]:
    """Lines of the spectra: every third, and the last; nothing without a plate."""
    if not prediction.sensors:
        return
    last, shown = prediction.frequency_hz.size - 1, display_of(_ACCELERATION)
    for line in dict.fromkeys((*range(0, last, 3), last)):
        row: dict[str, Any] = {"Hz": float(prediction.frequency_hz[line])}
        for sensor, band in prediction.spectra_m_s2.items():
            numbers = (
                shown.scale * float(curve[line]) for curve in (band.mean, band.lower, band.upper)
            )
            row[f"{sensor} ({shown.unit})"], low, high = format_interval(*numbers)
            row[f"{sensor} 90 %"] = f"{low} to {high}"
        yield row


_COLOURS = (MEASURED, MODEL, "#3a7d44", "#7b2d8b")


def plot_prediction(prediction: Prediction, path: Path) -> None:
    """Write the picture, above it what the bands rest on and the warnings; the suffix decides the
    format.

    `ValueError` for one that cannot be drawn.
    """
    figure = new_figure(8, 8 if prediction.sensors else 3)
    words = " ".join((prediction.rests_on.sentence, *warnings(prediction))).strip()
    figure.suptitle(fill(words, 110), fontsize="small", x=0.02, ha="left")
    draw_prediction(
        list(figure.subplots(3 if prediction.sensors else 1, squeeze=False)[:, 0]), prediction
    )
    save(figure, path)


def draw_prediction(rows: Sequence[Any], prediction: Prediction) -> None:
    """Force, accelerations and spectra with their bands on three axes; on one, the force alone."""
    force, time = display_of("force_n"), display_of(_TIME)
    _band(
        rows[0], prediction.time_s * time.scale, prediction.force_n, "force", MEASURED, force.scale
    )
    rows[0].set(xlabel=time.heading, ylabel=force.heading)
    for axes, draw in zip(rows[1:], (_accelerations, _spectra), strict=False):
        draw(axes, prediction)
        axes.legend(frameon=False)


def _accelerations(axes: Any, prediction: Prediction) -> None:
    shown, shown_time = display_of(_ACCELERATION), display_of(_TIME)
    for sensor, colour in zip(prediction.sensors, _COLOURS, strict=False):
        time, band = prediction.acceleration(sensor, 0.005)
        _band(axes, time * shown_time.scale, band, sensor, colour, shown.scale)
    axes.set(xlabel=shown_time.heading, ylabel=shown.heading)


def _spectra(axes: Any, prediction: Prediction) -> None:
    shown = display_of(_ACCELERATION)
    for (sensor, band), colour in zip(prediction.spectra_m_s2.items(), _COLOURS, strict=False):
        _band(axes, prediction.frequency_hz, band, sensor, colour, shown.scale)
    axes.set(xscale="log", yscale="log", xlabel="natural frequency (Hz)")
    axes.set_ylabel(f"maximax SRS, Q = {prediction.q:g} ({shown.unit})")


def _band(axes: Any, x: Floats, band: Band, label: str, colour: str, scale: float = 1.0) -> None:
    axes.plot(x, scale * band.mean, color=colour, lw=1.2, label=label)
    axes.fill_between(x, scale * band.lower, scale * band.upper, color=colour, alpha=0.2, lw=0)
