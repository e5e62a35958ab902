"""The errors of predicted pulses, one number a pulse and metric.

The cost of a predicted pulse (thesis, eq. 5.4): how many of its elements miss a tolerance in time
and force.

From 20 points back to a pulse (thesis, section 4.2.2 and Fig. 4.9).

The thesis feeds MATLAB's `csaps` the times in seconds; at such a scale its smoothing is whatever
the scaling makes of it. On the point's index the problem is the same for every pulse. The points
were read off a smoothed pulse already, so nothing is smoothed again: the natural cubic spline
through them is csaps' limit p = 1. Tried on 1,800 pulses against the stored fine ones: off by 0.10
% of the range (rms), with lam = 0.03 by 0.16 %, with lam = 0.3 by 0.49 %; straight lines 0.38 %.
Not-a-knot ends would make it 0.08 %, but are not csaps'.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...dataset.table import POINTS, PulseTable
from ..models.base import ContactPrediction

#: Spreads of eq. 5.4: in time by the measured contact time, in force by the measured peak.
TIME_SPREAD, FORCE_SPREAD = 0.05, 0.1


def pulse_cost(
    measured_n: Floats, measured_time_s: Floats, predicted_n: Floats, predicted_time_s: Floats
) -> Floats:
    """The cost of predicted pulses: how many of their elements miss a tolerance in time and force.

    Element i of either time vector is i / (m - 1) of its contact time (linspace). As the thesis
    does not print its m, only ratios of costs compare with its Table 5.2.

    Parameters:
        measured_n: Measured forces (n, m), equidistant over the contact.
        measured_time_s: Measured contact times (n,).
        predicted_n: Predicted forces (n, m), equidistant over the contact.
        predicted_time_s: Predicted contact times (n,).

    Returns:
        Costs (n,) from 0 for equal pulses to m for pulses without an element in common.

    Source:
        Thesis, eq. 5.4 and section 4.2.2.
    """
    phase = np.linspace(0.0, 1.0, measured_n.shape[1])
    late = (measured_time_s - predicted_time_s) / (TIME_SPREAD * measured_time_s)
    peak = measured_n.max(axis=1, keepdims=True)
    exponent = ((measured_n - predicted_n) / (FORCE_SPREAD * peak)) ** 2
    exponent += late[:, None] ** 2 * phase**2
    return np.asarray(-np.expm1(-exponent / 2).sum(axis=1))


#: Elements of a reconstructed pulse. The thesis prints no m; its cost of 611.57 (Table 5.2) needs
#: more than 611.
ELEMENTS = 1000


@dataclass(frozen=True, eq=False)
class PulseFigures:
    """What Table 5.3 compares, n-arrays, SI. Compression ends at the greatest force."""

    peak_force_n: Floats
    compression_time_s: Floats
    impulse_n_s: Floats
    compression_impulse_n_s: Floats


def reconstruct(force_n: Floats, elements: int = ELEMENTS) -> Floats:
    """Whole pulses from their points, by natural cubic splines.

    Parameters:
        force_n: Forces (n, p) at equidistant points of the contact, p >= 3.
        elements: The number of points of a whole pulse; by default `ELEMENTS`.

    Returns:
        Forces (n, elements), equidistant over the contact.

    Raises:
        ValueError: For fewer than 3 points, and for fewer than 2 elements.
    """
    return force_n @ _basis(force_n.shape[1], elements).T


def figures(fine_n: Floats, contact_time_s: Floats) -> PulseFigures:
    """The figures of whole pulses.

    Parameters:
        fine_n: Forces (n, elements), equidistant over the contact.
        contact_time_s: The duration (n,) of each contact.
    """
    n, elements = fine_n.shape
    period = contact_time_s / (elements - 1)
    top = np.argmax(fine_n, axis=1)
    rows = np.arange(n)
    grown = np.zeros_like(fine_n)
    np.cumsum((fine_n[:, 1:] + fine_n[:, :-1]) / 2, axis=1, out=grown[:, 1:])
    return PulseFigures(
        peak_force_n=fine_n[rows, top],
        compression_time_s=top * period,
        impulse_n_s=grown[:, -1] * period,
        compression_impulse_n_s=grown[rows, top] * period,
    )


@lru_cache(maxsize=8)
def _basis(points: int = POINTS, elements: int = ELEMENTS) -> Floats:
    """The spline is linear in its points: elements x points, read-only."""
    from scipy.interpolate import CubicSpline

    if points < 3 or elements < 2:
        raise ValueError(
            f"a pulse of {points} points cannot become one of {elements}: give at least 3 and 2"
        )
    spline = CubicSpline(np.arange(points, dtype=np.float64), np.eye(points), bc_type="natural")
    basis: Floats = np.asarray(spline(np.linspace(0.0, points - 1.0, elements)), dtype=np.float64)
    basis.flags.writeable = False
    return basis


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
#: Means that are shares, between 0 and 1; the others are errors, which are never negative.
SHARES = ("force_covered", "time_covered")

#: Force NRMSE of the mean pulse of those that a model learned from, on its held-out pulses.
OF_MEAN = "force_nrmse_of_mean"

#: Standard deviations on either side of the mean that hold 90 % of a normal law.
BAND = 1.6448536269514722

#: Pulses that are reconstructed at a time: some 8 MB a working array.
_AT_ONCE = 1024


@dataclass(frozen=True, eq=False)
class PulseErrors:
    """Errors of n pulses, each array (n,).

    `force_rmse_n` over the 20 points, `force_nrmse` the same over the measured pulse's range (eq.
    4.4), `contact_time_error` relative and absolute (eq. 4.7), `cost` of eq. 5.4; the four after it
    relative and absolute (eq. 5.7). `force_covered` is the share of a pulse's 20 points inside of
    the 90 % band, `time_covered` 1 or 0; None for a model without spread.
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
        """The same of some pulses.

        Parameters:
            rows: Which pulses are taken: numbers, a mask (n,) or a slice.
        """
        return replace(self, **{name: values[rows] for name, values in self.arrays().items()})


def pulse_errors(pulses: PulseTable, prediction: ContactPrediction) -> PulseErrors:
    """Errors of a prediction of pulses, row by row.

    Measured figures are the table's stored ones, of the finely smoothed pulse; predicted ones are
    those of the reconstructed pulse, which by itself costs 0.03 % of peak and impulse, 0.5 % of
    compression time and 0.9 % of compression impulse.

    Parameters:
        pulses: The measured pulses.
        prediction: What a model predicts of the same pulses, in their order.

    Raises:
        ValueError: For a prediction of another shape or with numbers that are not finite, for a
            measured pulse without a size to be relative to, and for no pulse.
    """
    _check(pulses, prediction)
    off = prediction.force_n - pulses.force_n
    rmse = np.sqrt(np.mean(off**2, axis=1))
    slices = [slice(first, first + _AT_ONCE) for first in range(0, len(pulses), _AT_ONCE)]
    parts = [
        _of_the_fine(pulses.take(rows), prediction.force_n[rows], prediction.contact_time_s[rows])
        for rows in slices
    ]
    errors = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return PulseErrors(
        force_rmse_n=rmse,
        force_nrmse=rmse / np.ptp(pulses.force_n, axis=1),
        contact_time_error=_relative(prediction.contact_time_s, pulses.contact_time_s),
        force_covered=_covered(off, prediction.force_spread_n),
        time_covered=_covered(
            prediction.contact_time_s - pulses.contact_time_s, prediction.contact_time_spread_s
        ),
        **errors,
    )


def _of_the_fine(pulses: PulseTable, force_n: Floats, contact_time_s: Floats) -> dict[str, Floats]:
    """Errors that need whole pulses."""
    measured, predicted = reconstruct(pulses.force_n), reconstruct(force_n)
    predicted_figures = figures(predicted, contact_time_s)
    return {
        "cost": pulse_cost(measured, pulses.contact_time_s, predicted, contact_time_s),
        "peak_force_error": _relative(predicted_figures.peak_force_n, pulses.peak_force_n),
        "compression_time_error": _relative(
            predicted_figures.compression_time_s, pulses.compression_time_s
        ),
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
                f"prediction.{name} is {given.shape}, the pulses' is "
                f"{expected.shape}: predict the same rows"
            )
        if not np.isfinite(given).all():
            row = int(np.argwhere(~np.isfinite(given))[0][0])
            raise ValueError(
                f"prediction.{name} of pulse {pulses.key[row]} (row {row}) is "
                f"not finite: see the model"
            )
    sizes = {f.name: getattr(pulses, f.name) for f in fields(PulseFigures)}
    sizes |= {
        "contact_time_s": pulses.contact_time_s,
        "range of force_n": np.ptp(pulses.force_n, axis=1),
    }
    for name, values in sizes.items():
        if not (values > 0).all():
            row = int(np.flatnonzero(~(values > 0))[0])
            raise ValueError(
                f"pulse {pulses.key[row]} has {name} = {values[row]:g}: no "
                f"error is relative to it; leave it out"
            )


def mean_pulse_errors(training: PulseTable, held_out: PulseTable) -> PulseErrors:
    """Errors of predicting every held-out pulse as the mean of the training pulses: what a model
    must beat to have learned anything.

    Parameters:
        training: The pulses whose mean is the prediction.
        held_out: The pulses that are predicted.
    """
    count = len(held_out)
    force_n = np.tile(training.force_n.mean(axis=0), (count, 1))
    time_s = np.full(count, training.contact_time_s.mean())
    return pulse_errors(held_out, ContactPrediction(force_n, time_s, None, None))
