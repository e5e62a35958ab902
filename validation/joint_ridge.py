"""The naive baseline: all effects of a stage fitted together by ridge regression, without
selection.

It names no cause, but shrinks the gap: a diagnosis that shrinks it less has missed something. One
value of every parameter for all materials and bullets, least squares (Levenberg-Marquardt in
bounds) from near "off", in the folds by configuration that the diagnosis has.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..array_types import Floats, Rows
from ..diagnosis.gap import GapMetric, GapTable
from ..diagnosis.gap_reduction import by_configuration
from ..diagnosis.observables.base import Stage
from ..training.evaluation.summary import fraction
from ..twin.effects import Effect, Parameter, catalogue, effect

#: Standard deviation of a parameter about "off", 1 being the end of its likely range.
_RIDGE = 1.0
_STEP = 3e-3
#: Half of a tolerance is added to the noise: what no effect explains.
_MODEL_ERROR = 0.5
#: A fit that takes more of the processor's time stops where it is.
_PATIENCE_S = 12.0
#: A residual without an answer (a shot that stops) counts as so many standard deviations.
_NO_ANSWER = 30.0
#: A valve that opens slowly and hardly throttles takes forever to simulate: it has its steady
#: regime here.
_LEFT_AT_ZERO = {"gun.valve_flow": ("loss_coefficient", "opening_time_s")}


def joint_ridge(stages: Sequence[Stage], gap: GapTable) -> dict[str, Any]:
    """Gap `before`, `inside` the sample, `after` held out, `floor`, in the metric's unit;
    `fraction` held out; `shares` of the squared gap by what it grows without each effect;
    `seconds`."""
    began = time.perf_counter()
    metric = GapMetric.of(gap)
    measured_rows = np.flatnonzero(np.isfinite(gap.mean[:, metric.columns]).any(axis=1))
    inside, outside = gap.mean.copy(), gap.mean.copy()
    without: dict[str, Floats] = {}
    for stage in stages:
        columns = gap.columns(stage.name)
        fit = _JointFit.of(
            stage, gap.mean[:, columns], _noise(gap)[columns], gap.tolerance[columns]
        )
        if not fit.parameters:
            continue
        x = fit.solved(measured_rows)
        whole = fit.change([x])[0]
        inside[:, columns] -= whole
        for name in dict.fromkeys(name for name, _ in fit.parameters):
            rest = without.setdefault(name, gap.mean.copy())
            rest[:, columns] = gap.mean[:, columns] - fit.change([x], leave_out=name)[0]
        for rows in by_configuration(measured_rows).folds:
            training = np.setdiff1d(measured_rows, rows)
            outside[np.ix_(rows, columns)] -= fit.change([fit.solved(training, x)])[0][rows]
    floor = metric.rms(np.sqrt(gap.floor_variance))
    before, after, inside_rms = (
        metric.rms(table[measured_rows]) for table in (gap.mean, outside, inside)
    )
    share = float(fraction(*(np.array(value**2) for value in (before, after, floor))))
    grows = {
        name: max(metric.rms(table[measured_rows]) ** 2 - inside_rms**2, 0.0)
        for name, table in without.items()
    }
    total = sum(grows.values()) or 1.0
    return {
        "before": before,
        "inside": inside_rms,
        "after": after,
        "floor": floor,
        "fraction": share if np.isfinite(share) else None,
        "shares": {name: value / total for name, value in grows.items()},
        "seconds": time.perf_counter() - began,
    }


def _noise(gap: GapTable) -> Floats:
    """(D,) standard error of a typical configuration's mean."""
    variance = np.nanmean(
        np.where(np.isfinite(gap.floor_variance), gap.floor_variance, np.nan), axis=0
    )
    return np.asarray(np.sqrt(np.nan_to_num(variance)))


@dataclass(frozen=True, eq=False)
class _JointFit:
    """`gap` and `scale` (C, d) and (d,): what is fitted, and its standard deviation."""

    stage: Stage
    gap: Floats
    scale: Floats
    parameters: tuple[tuple[str, Parameter], ...]

    @classmethod
    def of(cls, stage: Stage, gap: Floats, noise: Floats, tolerance: Floats) -> _JointFit:
        effects = catalogue()
        parameters = tuple(
            (name, item)
            for name in stage.shows
            for item in effects[name].parameters()
            if item.likely is not None and item.name not in _LEFT_AT_ZERO.get(name, ())
        )
        return cls(stage, gap, np.hypot(noise, _MODEL_ERROR * tolerance), parameters)

    def change(self, points: Sequence[Floats], leave_out: str = "") -> Floats:
        """(k, C, d): what all effects together do at points (k, P), 0 where there is no answer."""
        return np.asarray(self.stage.changes([self._effects(x, leave_out) for x in points]))

    def solved(self, rows: Rows, start: Floats | None = None) -> Floats:
        """The parameters (P,) that fit some configurations best."""
        from scipy.optimize import least_squares

        signed = np.array([_signed(item) for _, item in self.parameters])
        lower = np.where(signed, -1.0, 0.0) - 1e-9
        began, best = (
            time.process_time(),
            (np.inf, np.where(signed, 0.0, 0.2) if start is None else start),
        )

        def cost(x: Floats) -> Floats:
            nonlocal best
            if time.process_time() - began > _PATIENCE_S:
                raise _OutOfTime
            values = self._misfit(self.change([x])[0], x, rows)
            best = min(best, (float(values @ values), x.copy()), key=lambda pair: pair[0])
            return values

        def slopes(x: Floats) -> Floats:
            return self._slopes(x, rows)

        first = np.clip(best[1], lower + 1e-6, 1.0)
        with suppress(_OutOfTime):  # then the best point so far is the answer
            least_squares(cost, first, slopes, bounds=(lower, 1.0 + 1e-9), max_nfev=20)
        return best[1]

    def _misfit(self, change: Floats, x: Floats, rows: Rows) -> Floats:
        residuals = ((self.gap - change) / self.scale)[rows]
        residuals = np.where(
            np.isfinite(residuals),
            residuals,
            np.where(np.isfinite(self.gap[rows]), _NO_ANSWER, 0.0),
        )
        return np.concatenate([np.clip(residuals, -200, 200).ravel(), _RIDGE * x])

    def _slopes(self, x: Floats, rows: Rows) -> Floats:
        steps = np.where(x + _STEP <= 1.0, _STEP, -_STEP)
        changes = self.change(
            [x, *(x + step * unit for step, unit in zip(steps, np.eye(x.size), strict=True))]
        )
        table = np.zeros((len(rows) * self.gap.shape[1] + x.size, x.size))
        for i, step in enumerate(steps):
            slope = -((changes[i + 1] - changes[0]) / self.scale)[rows] / step
            table[: -x.size, i] = np.where(np.isfinite(slope), slope, 0.0).ravel()
        table[-x.size :] = _RIDGE * np.eye(x.size)
        return table

    def _effects(self, x: Floats, leave_out: str) -> list[Effect]:
        settings: dict[str, dict[str, float]] = {}
        for (name, item), coordinate in zip(self.parameters, x, strict=True):
            if name != leave_out:
                values = settings.setdefault(name, dict.fromkeys(_LEFT_AT_ZERO.get(name, ()), 0.0))
                values[item.name] = _value(item, coordinate)
        return [effect(name, **values) for name, values in settings.items()]


class _OutOfTime(Exception):
    """The fit has used its time."""


def _signed(item: Parameter) -> bool:
    low, high = _likely(item)
    return low < item.off < high


def _likely(item: Parameter) -> tuple[float, float]:
    assert item.likely is not None
    return item.likely


def _value(item: Parameter, x: float) -> float:
    """A parameter from 0 (off) to 1 or -1 (the ends of its likely range)."""
    low, high = _likely(item)
    if low < item.off < high:
        value = item.off + x * max(high - item.off, item.off - low)
    elif item.off > 100 * high:  # off is far away: evenly in the logarithm
        far = 20 * high
        value = item.off if x <= 1e-6 else far * (low / far) ** min(max(x, 0.0), 1.0)
    else:
        value = item.off + min(max(x, 0.0), 1.0) ** 3 * (
            (high if item.off <= low else low) - item.off
        )
    return float(np.clip(value, item.low, item.high))
