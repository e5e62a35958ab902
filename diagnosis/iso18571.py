"""The rating of a simulated record beside a measured one after ISO/TS 18571: from 0 to 1 for a
perfect simulation.

Written from the specification's formulas. `objective-rating-metrics` (TU Graz) is a peer for the
tests and no dependency: it brings seaborn, shapely and others along.

Ratings of the force pulses after ISO/TS 18571, before and after a correction.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ..array_types import Floats, Rows
from ..twin.effects import Effect
from .observables.base import Stage, at_rows
from .observables.contact.stage import ContactObservables, pulse_residuals

#: Inner and outer corridor as parts of the largest measured value; the largest shift and the
#: warping's window as parts of the record; the errors of magnitude and slope at which their scores
#: are 0.
_INNER, _OUTER, _SHIFT, _WINDOW, _MAGNITUDE, _SLOPE = 0.05, 0.50, 0.20, 0.10, 0.50, 2.0
#: Of corridor, phase, magnitude and slope.
_WEIGHTS = np.array([0.4, 0.2, 0.2, 0.2])
_SMOOTH = 9
_CONSTANT = 1e-12
#: Samples to which a pulse is brought: its rating needs its shape, not its rate.
_SAMPLES = 256
#: A pulse and its surroundings: from before its rise to where the longest one has died out.
_QUIET = 0.01


def rating(measured: Floats, simulated: Floats) -> float:
    """The rating of a simulated record beside a measured one.

    Parameters:
        measured: The measured record (n,), n > 18.
        simulated: The simulated record (n,) in the same unit, at the same even steps.

    Raises:
        ValueError: For different lengths, for less than 19 samples, and for a constant record.

    Source:
        ISO/TS 18571.
    """
    if measured.shape != simulated.shape or len(measured) <= 2 * _SMOOTH:
        raise ValueError(
            f"records of {len(measured)} and {len(simulated)} samples: give "
            f"two of one length, above 18"
        )
    if not (np.ptp(measured) > 0 and np.ptp(simulated) > 0):
        raise ValueError(
            "a constant record cannot be rated: nothing was measured, or nothing simulated"
        )
    shift = _best_shift(measured, simulated)
    x, y = _overlap(measured, simulated, shift)
    phase = max(0.0, 1.0 - abs(shift) / (_SHIFT * len(measured)))
    return float(_WEIGHTS @ [_corridor(measured, simulated), phase, _magnitude(x, y), _slope(x, y)])


def pulse_rating(measured: Floats, simulated: Floats) -> float:
    """The rating of a simulated pulse beside a measured one, of the stretch that is not quiet; NaN
    where there is none.

    Parameters:
        measured: The measured pulse (n,).
        simulated: The simulated pulse (n,) in the same unit, at the same even steps.
    """
    if not (np.isfinite(measured).all() and np.isfinite(simulated).all()):
        return float("nan")
    size = np.maximum(np.abs(measured), np.abs(simulated))
    loud = np.flatnonzero(size > _QUIET * size.max())
    if loud.size < 2:
        return float("nan")
    position, samples = np.linspace(loud[0], loud[-1], _SAMPLES), np.arange(measured.size)
    return rating(np.interp(position, samples, measured), np.interp(position, samples, simulated))


def _corridor(measured: Floats, simulated: Floats) -> float:
    top = np.abs(measured).max()
    ratio = (_OUTER * top - np.abs(simulated - measured)) / ((_OUTER - _INNER) * top)
    return float(np.mean(np.clip(ratio, 0.0, 1.0) ** 2))


def _overlap(measured: Floats, simulated: Floats, shift: int) -> tuple[Floats, Floats]:
    """The parts that lie over each other when the simulation, `shift` samples late, is moved
    forward."""
    count = len(measured)
    return measured[max(0, -shift) : count - max(0, shift)], simulated[
        max(0, shift) : count - max(0, -shift)
    ]


def _best_shift(measured: Floats, simulated: Floats) -> int:
    """In samples, above 0 where the simulation comes late: where both correlate best; the smallest
    of equals.

    An overlap where either is constant does not count: a force that rests for part of its record
    has no phase there.
    """
    least = [_CONSTANT * values.size * values.var() for values in (measured, simulated)]

    def correlation(shift: int) -> float:
        x, y = (part - part.mean() for part in _overlap(measured, simulated, shift))
        if x @ x <= least[0] or y @ y <= least[1]:
            return -math.inf
        return float(x @ y) / math.sqrt((x @ x) * (y @ y))

    most = int(_SHIFT * len(measured))
    return max(
        sorted(range(-most, most + 1), key=lambda shift: (abs(shift), -shift)), key=correlation
    )


def _magnitude(measured: Floats, simulated: Floats) -> float:
    """Of the records after dynamic time warping, which takes local differences in phase away."""
    path = warping_path(simulated, measured, int(np.ceil(_WINDOW * len(measured))) - 1)
    error = np.abs(simulated[path[:, 0]] - measured[path[:, 1]]).sum()
    return _score(error, np.abs(measured[path[:, 1]]).sum(), _MAGNITUDE)


def _slope(measured: Floats, simulated: Floats) -> float:
    x, y = _smooth_slope(measured), _smooth_slope(simulated)
    return _score(np.abs(y - x).sum(), np.abs(x).sum(), _SLOPE)


def _score(error: float, size: float, most: float) -> float:
    """1 without an error, 0 from `most` of the size on; 0 for an error of what is nothing."""
    return 0.0 if error > most * size else float(1.0 - error / (most * size)) if size > 0 else 1.0


def _smooth_slope(values: Floats) -> Floats:
    """Central differences averaged over nine samples; over the first or last 1, 3, 5, 7 at the
    ends."""
    slope, half = np.gradient(values), _SMOOTH // 2
    smooth = np.convolve(slope, np.ones(_SMOOTH) / _SMOOTH, mode="same")
    for i in range(half):
        smooth[i], smooth[-1 - i] = slope[: 2 * i + 1].mean(), slope[-2 * i - 1 :].mean()
    return np.asarray(smooth)


@njit(cache=True)
def warping_path(x: Floats, y: Floats, window: int) -> NDArray[np.int64]:
    """(k, 2): pairs of samples of two records on the path of the least sum of squared differences.

    Steps of one sample in x, in y or in both, all of one weight.

    Parameters:
        x: One record (n,).
        y: The other record (m,), in the same unit.
        window: How many samples a pair may be apart at most.

    Source:
        Sakoe and Chiba, IEEE Trans. ASSP 26 (1978) 43.
    """
    n, m = len(x), len(y)
    cost = np.full((n + 1, m + 1), np.inf)
    cost[0, 0] = 0.0
    for i in range(1, n + 1):
        for j in range(max(1, i - window), min(m, i + window) + 1):
            least = min(cost[i - 1, j - 1], cost[i - 1, j], cost[i, j - 1])
            cost[i, j] = (x[i - 1] - y[j - 1]) ** 2 + least
    path = np.empty((n + m, 2), dtype=np.int64)
    i, j, length = n, m, 0
    while i > 0 and j > 0:
        path[length, 0], path[length, 1] = i - 1, j - 1
        length += 1
        before_x, before_y, before_both = cost[i - 1, j], cost[i, j - 1], cost[i - 1, j - 1]
        if before_both <= min(before_x, before_y):
            i, j = i - 1, j - 1
        elif before_x <= before_y:
            i -= 1
        else:
            j -= 1
    return path[:length][::-1]


def pulse_ratings(
    stages: Sequence[Stage], folds: Sequence[Rows], effects_of_folds: Sequence[Sequence[Effect]]
) -> tuple[float, float] | None:
    """Mean ratings, before and after a correction, over one run of each held-out configuration;
    None without measured pulses.

    Records are aligned at half their peak, so that the rating is of size and shape and no trigger
    counts.

    Parameters:
        stages: The stages of the campaign.
        folds: The places of the configurations that each fold holds out.
        effects_of_folds: The effects that each fold fitted. A parameter is one value or one for
            each configuration (C,).
    """
    pairs: list[tuple[float, float]] = []
    for stage in [stage for stage in stages if isinstance(stage, ContactObservables)]:
        for held, effects in zip(folds, effects_of_folds, strict=True):
            contact = [effect for effect in effects if effect.id in stage.shows]
            before = _ratings(stage, held, ())
            pairs += zip(before, _ratings(stage, held, contact) if contact else before, strict=True)
    ratings = np.array(pairs).reshape(-1, 2)
    ratings = ratings[np.isfinite(ratings).all(axis=1)]
    return (float(ratings[:, 0].mean()), float(ratings[:, 1].mean())) if len(ratings) else None


def _ratings(stage: ContactObservables, held: Rows, effects: Sequence[Effect]) -> list[float]:
    """Of each held-out configuration that has a pulse: of its first run with a force and a
    velocity."""
    runs = stage.record.runs
    usable = [i for i, run in enumerate(runs) if run.force is not None and run.velocity_m_s]
    rows = sorted(
        {
            runs[i].configuration: i for i in reversed(usable) if runs[i].configuration in held
        }.values()
    )
    if (
        type(stage) is ContactObservables and rows
    ):  # a physical stage is cut down to these runs, a learned one is not
        stage = ContactObservables(replace(stage.record, runs=tuple(runs[i] for i in rows)))
        rows = list(range(len(rows)))
    if not rows:
        return []
    pulses = pulse_residuals(stage, at_rows(stage.acting(effects), stage.record.configuration_of))
    return [pulse_rating(pulses.measured[row], pulses.simulated[row]) for row in rows]
