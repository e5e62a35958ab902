"""The errors of predicted pulses, one number a pulse and metric."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...dataset.table import PulseTable
from ..models.base import ContactPrediction
from .cost import pulse_cost
from .reconstruct import PulseFigures, figures, reconstruct

#: By which models are ranked, the less the better; the names under which commands print them.
METRICS = (
    "force_rmse_n",
    "force_nrmse",
    "contact_time_error",
    "cost",
    "peak_force_error",
    "compression_time_error",
    "impulse_error",
    "compression_impulse_error",
)

#: Standard deviations on either side of the mean that hold 90 % of a normal law.
BAND = 1.6448536269514722

#: Pulses that are reconstructed at a time: some 8 MB a working array.
_AT_ONCE = 1024


@dataclass(frozen=True, eq=False)
class PulseErrors:
    """Errors of n pulses, each array (n,).

    `force_rmse_n` over the 20 points, `force_nrmse` the same over the measured pulse's range (eq. 4.4),
    `contact_time_error` relative and absolute (eq. 4.7), `cost` of eq. 5.4; the four after it relative and absolute
    (eq. 5.7). `force_covered` is the share of a pulse's 20 points inside of the 90 % band, `time_covered` 1 or 0; None
    for a model without spread.
    """

    force_rmse_n: Floats
    force_nrmse: Floats
    contact_time_error: Floats
    cost: Floats
    peak_force_error: Floats
    compression_time_error: Floats
    impulse_error: Floats
    compression_impulse_error: Floats
    force_covered: Floats | None = None
    time_covered: Floats | None = None

    def __len__(self) -> int:
        return len(self.force_rmse_n)

    def arrays(self) -> dict[str, Floats]:
        """By name, without those that are None."""
        named = {f.name: getattr(self, f.name) for f in fields(self)}
        return {name: values for name, values in named.items() if values is not None}

    def take(self, rows: NDArray[Any] | slice) -> Self:
        """The same of some pulses."""
        return replace(self, **{name: values[rows] for name, values in self.arrays().items()})


def pulse_errors(pulses: PulseTable, prediction: ContactPrediction) -> PulseErrors:
    """Errors of a prediction of these pulses, row by row.

    Measured figures are the table's stored ones, of the finely smoothed pulse; predicted ones are those of the
    reconstructed pulse, which by itself costs 0.03 % of peak and impulse, 0.5 % of compression time and 0.9 % of
    compression impulse. Raises `ValueError` for a prediction of another shape or with numbers that are not finite, and
    for a measured pulse without a size to be relative to.
    """
    _check(pulses, prediction)
    off = prediction.force_n - pulses.force_n
    rmse = np.sqrt(np.mean(off**2, axis=1))
    slices = [slice(first, first + _AT_ONCE) for first in range(0, len(pulses), _AT_ONCE)]
    parts = [
        _of_the_fine(pulses.take(rows), prediction.force_n[rows], prediction.contact_time_s[rows]) for rows in slices
    ]
    errors = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return PulseErrors(
        force_rmse_n=rmse,
        force_nrmse=rmse / np.ptp(pulses.force_n, axis=1),
        contact_time_error=_relative(prediction.contact_time_s, pulses.contact_time_s),
        force_covered=_covered(off, prediction.force_spread_n),
        time_covered=_covered(prediction.contact_time_s - pulses.contact_time_s, prediction.contact_time_spread_s),
        **errors,
    )


def _of_the_fine(pulses: PulseTable, force_n: Floats, contact_time_s: Floats) -> dict[str, Floats]:
    """Errors that need whole pulses."""
    measured, predicted = reconstruct(pulses.force_n), reconstruct(force_n)
    predicted_figures = figures(predicted, contact_time_s)
    return {
        "cost": pulse_cost(measured, pulses.contact_time_s, predicted, contact_time_s),
        "peak_force_error": _relative(predicted_figures.peak_force_n, pulses.peak_force_n),
        "compression_time_error": _relative(predicted_figures.compression_time_s, pulses.compression_time_s),
        "impulse_error": _relative(predicted_figures.impulse_n_s, pulses.impulse_n_s),
        "compression_impulse_error": _relative(
            predicted_figures.compression_impulse_n_s, pulses.compression_impulse_n_s
        ),
    }


def _relative(predicted: Floats, measured: Floats) -> Floats:
    return np.abs(predicted - measured) / measured


def _covered(off: Floats, spread: Floats | None) -> Floats | None:
    if spread is None:
        return None
    inside = (np.abs(off) <= BAND * spread).astype(np.float64)
    return inside if inside.ndim == 1 else inside.mean(axis=1)


def _check(pulses: PulseTable, prediction: ContactPrediction) -> None:
    if len(pulses) == 0:
        raise ValueError("there are no pulses to compare with: give at least one")
    for name in ("force_n", "contact_time_s"):
        given, expected = getattr(prediction, name), getattr(pulses, name)
        if given.shape != expected.shape:
            raise ValueError(
                f"prediction.{name} is {given.shape}, the pulses' is {expected.shape}: predict the same rows"
            )
        if not np.isfinite(given).all():
            row = int(np.argwhere(~np.isfinite(given))[0][0])
            raise ValueError(f"prediction.{name} of pulse {pulses.key[row]} (row {row}) is not finite: see the model")
    sizes = {f.name: getattr(pulses, f.name) for f in fields(PulseFigures)}
    sizes |= {"contact_time_s": pulses.contact_time_s, "range of force_n": np.ptp(pulses.force_n, axis=1)}
    for name, values in sizes.items():
        if not (values > 0).all():
            row = int(np.flatnonzero(~(values > 0))[0])
            raise ValueError(
                f"pulse {pulses.key[row]} has {name} = {values[row]:g}: no error is relative to it; leave it out"
            )
