"""All lines that ring, run by run, from the poles that the runs of a configuration share."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...record import Floats
from .poles import Basis, Complexes, Poles, bounded_step, moved, refined

#: Steps that each configuration's poles are refined by.
_STEPS = 3
#: Below this an amplitude is silence.
_SILENCE = 1e-12


@dataclass(frozen=True, eq=False)
class Reading:
    """All lines, (R, M) and (R, S, M), with their standard deviations under noise; `phase` where ringing begins."""

    frequency: Floats
    damping: Floats
    level: Floats
    phase: Floats
    damping_noise: Floats
    level_noise: Floats

    @classmethod
    def empty(cls, runs: int, channels: int, lines: int) -> Self:
        flat, deep = (runs, lines), (runs, channels, lines)
        return cls(*(np.full(shape, np.nan) for shape in (flat, flat, deep, deep, flat, deep)))

    def of_lines(self, lines: NDArray[np.intp]) -> Self:
        """Some lines of the reading."""
        return type(self)(*(getattr(self, item.name)[..., lines] for item in fields(self)))

    def enter_step(
        self, run: int, channels: NDArray[np.intp], scale: Floats, basis: Basis, amplitudes: Complexes, timed: Floats
    ) -> tuple[Floats, Complexes]:
        """Enters a run, one Gauss-Newton step from the poles of `basis`, and returns J'J and the new amplitudes.

        `scale` (k,) is the loudness of its records, by which amplitudes (M, k) are multiplied; `timed` as in
        `Basis.normal`.
        """
        jtj, jtr = basis.normal(amplitudes, timed)
        step = bounded_step(basis, jtj, jtr)
        poles, amplitudes = moved(basis.poles, step), basis.shifted(amplitudes, step)
        self.frequency[run], self.damping[run] = np.log(poles.frequency_hz), np.log(poles.damping_ratio)
        self.level[run, channels] = np.log(np.maximum(np.abs(amplitudes), _SILENCE) * scale).T
        self.phase[run, channels] = np.angle(amplitudes).T
        return jtj, amplitudes


def median(values: Floats, axis: int) -> Floats:
    """Median of what is known; NaN where nothing is."""
    ranked = np.sort(values, axis=axis)  # NaN goes last
    count = np.isfinite(values).sum(axis=axis, keepdims=True)
    low, high = np.maximum((count - 1) // 2, 0), np.maximum(count // 2, 0)
    ends = [np.take_along_axis(ranked, np.minimum(at, ranked.shape[axis] - 1), axis=axis) for at in (low, high)]
    return np.asarray(np.where(count > 0, (ends[0] + ends[1]) / 2, np.nan).squeeze(axis))


def read_runs(ringing: Floats, configuration: NDArray[np.intp], poles: Poles, step_s: float) -> Reading:
    """Each configuration has its poles, from all its runs; each run is one Gauss-Newton step from them."""
    runs, channels, samples = ringing.shape
    reading = Reading.empty(runs, channels, poles.omega.size)
    good = np.isfinite(ringing[:, :, 0])
    for c in np.unique(configuration[good.any(axis=1)]):
        rows = np.flatnonzero((configuration == c) & good.any(axis=1))
        basis = Basis.of(refined(poles, scaled(ringing[rows])[0], step_s, _STEPS), samples, step_s)
        for run in rows:
            measured = np.flatnonzero(good[run])
            records, scale = scaled(ringing[run])
            residual = basis.residual(records)
            amplitudes, timed = basis.amplitudes(records), basis.timed.T @ residual
            jtj, amplitudes = reading.enter_step(int(run), measured, scale, basis, amplitudes, timed)
            noise = float(np.sqrt(np.mean(residual**2)))
            reading.damping_noise[run], level_noise = basis.deviations(jtj, amplitudes, noise)
            reading.level_noise[run, measured] = level_noise.T
    return reading


def read_simulated(basis: Basis, ringing: Floats) -> Reading:
    """As `read_runs`, of records (R, S, n) without noise, all with the poles of `basis`: their deviations are not asked
    for. A run is NaN in all of its channels or in none."""
    runs, channels, _ = ringing.shape
    reading = Reading.empty(runs, channels, basis.poles.omega.size)
    records, scale = scaled(ringing)
    amplitudes, timed = basis.projected(records)
    every = np.arange(channels)
    for k, run in enumerate(np.flatnonzero(np.isfinite(ringing[:, 0, 0]))):
        columns = slice(k * channels, (k + 1) * channels)
        reading.enter_step(int(run), every, scale[columns], basis, amplitudes[:, columns], timed[:, columns])
    return reading


def scaled(ringing: Floats) -> tuple[Floats, Floats]:
    """Records (n, k) of one loudness each, from (..., n), and their loudness (k,); those not measured are left out."""
    flat = ringing.reshape(-1, ringing.shape[-1])
    flat = flat[np.isfinite(flat[:, 0])]
    scale = np.maximum(np.abs(flat).max(axis=1), 1e-300)
    return np.asarray((flat / scale[:, None]).T), scale
