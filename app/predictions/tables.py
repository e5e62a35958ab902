"""A prediction as a person reads it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ...twin.prediction import Prediction, Quantity
from .warnings import warnings_of_number

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


def spectrum_rows(prediction: Prediction, every: int = 3) -> Iterator[dict[str, Any]]:
    """Lines of the spectra, m/s2: `every` one of them, and the last; nothing without a plate."""
    if not prediction.sensors:
        return
    last = prediction.frequency_hz.size - 1
    for line in dict.fromkeys((*range(0, last, every), last)):
        row: dict[str, Any] = {"Hz": float(prediction.frequency_hz[line])}
        for sensor, band in prediction.spectra_m_s2.items():
            row[f"{sensor} (m/s2)"] = float(band.mean[line])
            row[f"{sensor} 90 %"] = f"{band.lower[line]:.4g} to {band.upper[line]:.4g}"
        yield row
