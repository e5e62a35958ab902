"""The tables of a prediction, as a person reads it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ....twin.prediction import Prediction, Quantity
from ...common.number_format import format_interval
from ...common.quantities import Display, display_of
from .same_setting import MeasuredRange, range_cells
from .validity import warnings_of_number

#: Numbers of the prediction, in their order.
QUANTITIES = (
    "velocity_m_s",
    "contact_time_s",
    "compression_time_s",
    "peak_force_n",
    "impulse_n_s",
)

_ACCELERATION = "acceleration_m_s2"


def quantity_rows(
    prediction: Prediction, measured: Mapping[str, MeasuredRange] | None = None
) -> Iterator[dict[str, Any]]:
    """Named quantities, 90 % intervals as texts; what was `measured` at this setting, where it was
    at all; with `warning` where an input is beyond what was learned."""
    for field in QUANTITIES:
        warning = warnings_of_number(prediction, field)
        shown = display_of(field)
        yield (
            _row(shown.label, shown, getattr(prediction, field))
            | (range_cells(measured, field) if measured else {})
            | ({"warning": warning} if warning else {})
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
