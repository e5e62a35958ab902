"""All lines that ring, run by run, from the poles that the runs of a configuration share."""

from __future__ import annotations

from dataclasses import dataclass
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
        every = (self.frequency, self.damping, self.level, self.phase, self.damping_noise, self.level_noise)
        return type(self)(*(each[..., lines] for each in every))


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
    out = Reading.empty(runs, channels, poles.omega.size)
    good = np.isfinite(ringing[:, :, 0])
    for c in np.unique(configuration[good.any(axis=1)]):
        mine = np.flatnonzero((configuration == c) & good.any(axis=1))
        basis = Basis.of(refined(poles, scaled(ringing[mine]), step_s, _STEPS), samples, step_s)
        for run in mine:
            read_run(basis, ringing[run], int(run), out)
    return out


def read_run(basis: Basis, ringing: Floats, run: int, out: Reading) -> None:
    """One run (S, n) into row `run` of `out`: one Gauss-Newton step from the poles of `basis`."""
    there, scale, records = _there(ringing)
    amplitudes, residual = basis.amplitudes(records), basis.left(records)
    jtj, jtr = basis.normal(amplitudes, residual)
    step = bounded_step(basis, jtj, jtr)
    shifted = basis.shifted(amplitudes, step)
    _keep(basis, step, shifted, (there, scale, run), out)
    noise = float(np.sqrt(np.mean(residual**2)))
    _, out.damping_noise[run], level = basis.deviations(jtj, shifted, noise)
    out.level_noise[run, there] = level.T


def read_simulated(basis: Basis, ringing: Floats) -> Reading:
    """As `read_run`, of records (R, S, n) without noise, all with the poles of `basis`: their deviations are not asked
    for. A run is NaN in all of its channels or in none."""
    out = Reading.empty(ringing.shape[0], ringing.shape[1], basis.poles.omega.size)
    runs, every = np.flatnonzero(np.isfinite(ringing[:, 0, 0])), np.arange(ringing.shape[1])
    scale = np.maximum(np.abs(ringing[runs]).max(axis=2), 1e-300)
    records = (ringing[runs] / scale[:, :, None]).reshape(-1, ringing.shape[2]).T
    amplitudes, timed = basis.projected(records)
    for k, run in enumerate(runs):
        own = slice(k * every.size, (k + 1) * every.size)
        step = bounded_step(basis, *basis.normal_of(amplitudes[:, own], timed[:, own]))
        _keep(basis, step, basis.shifted(amplitudes[:, own], step), (every, scale[k], int(run)), out)
    return out


def _there(ringing: Floats) -> tuple[NDArray[np.intp], Floats, Floats]:
    """Channels that were measured, their loudness, and their records (n, k) over it."""
    there = np.flatnonzero(np.isfinite(ringing[:, 0]))
    scale = np.maximum(np.abs(ringing[there]).max(axis=1), 1e-300)
    return there, scale, (ringing[there] / scale[:, None]).T


def _keep(
    basis: Basis, step: Floats, amplitudes: Complexes, place: tuple[NDArray[np.intp], Floats, int], out: Reading
) -> None:
    there, scale, run = place
    poles = moved(basis.poles, step)
    out.frequency[run], out.damping[run] = np.log(poles.frequency_hz), np.log(poles.damping_ratio)
    out.level[run, there] = np.log(np.maximum(np.abs(amplitudes), _SILENCE) * scale).T
    out.phase[run, there] = np.angle(amplitudes).T


def scaled(ringing: Floats) -> Floats:
    """Records (n, k) of one loudness each, from (R, S, n); those not measured are left out."""
    flat = ringing.reshape(-1, ringing.shape[-1])
    flat = flat[np.isfinite(flat[:, 0])]
    return np.asarray((flat / np.maximum(np.abs(flat).max(axis=1, keepdims=True), 1e-300)).T)
