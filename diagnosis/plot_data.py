"""What a report draws of a diagnosis beside its numbers: residuals and curves before and after the first cause."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .observables.base import Observable

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ResidualPicture:
    """One observable over the configurations: measured less simulated, means over runs, NaN where there is none.

    `before` (C,) is the nominal simulator's, `after` (C,) with the fitted cause, None without one. `floor` (C,) is
    what repetitions leave of such a mean, one standard deviation. All in `unit`.
    """

    name: str
    stage: str
    unit: str
    tolerance: float
    before: Floats
    after: Floats | None
    floor: Floats


@dataclass(frozen=True, eq=False)
class CurvePicture:
    """A record as it was measured, and as it is simulated before and after: a pulse (x in s), a spectrum (x in Hz)."""

    title: str
    x_name: str
    x_unit: str
    y_name: str
    y_unit: str
    x: Floats
    measured: Floats
    before: Floats
    after: Floats | None = None
    logarithmic: bool = False


@dataclass(frozen=True)
class Pictures:
    """What is drawn. `configurations` are the labels of the C configurations."""

    configurations: tuple[str, ...] = ()
    residuals: tuple[ResidualPicture, ...] = ()
    curves: tuple[CurvePicture, ...] = ()


def residual_pictures(
    observables: Sequence[Observable], before: Floats, after: Floats | None, floor: Floats, most: int = 6
) -> tuple[ResidualPicture, ...]:
    """Up to `most` observables whose gap before lies beyond tolerance and floor, in the order of `observables`.

    The largest gaps, as many of each unit; at least one, also where all agree. `before` and `after` are
    (C, d) means over the runs of configurations, `floor` (C, d) one standard deviation of such a mean; NaN where a
    configuration has none.
    """
    return tuple(
        ResidualPicture(
            observables[i].name,
            observables[i].stage,
            observables[i].unit,
            observables[i].tolerance,
            before[:, i],
            None if after is None else after[:, i],
            floor[:, i],
        )
        for i in _chosen(observables, before, floor, most)
    )


def _chosen(observables: Sequence[Observable], gap: Floats, floor: Floats, most: int) -> list[int]:
    """By falling rms over tolerance and floor, only the first below one; of each unit no more than its share."""
    tolerance = np.array([each.tolerance for each in observables])
    scale = np.hypot(tolerance, floor)
    known = np.isfinite(gap) & np.isfinite(scale) & (scale > 0)
    ratio = np.divide(gap, scale, out=np.zeros_like(gap), where=known)
    score = np.sqrt((ratio**2).sum(axis=0) / np.maximum(known.sum(axis=0), 1))
    order = [int(i) for i in np.argsort(-score, kind="stable") if known[:, i].any()]
    order = [i for place, i in enumerate(order) if score[i] >= 1 or place == 0]
    units = dict.fromkeys(observables[i].unit for i in order)
    share = -(-most // max(len(units), 1))
    kept = [i for unit in units for i in [each for each in order if observables[each].unit == unit][:share]]
    return sorted(kept)[:most]
