"""Damped ringing in records: poles by least squares, with amplitudes eliminated (variable projection).

Every record is a sum of modes exp(-s t) (a cos w t + b sin w t) and a slow offset; all records have the same poles.
Golub and Pereyra, Inverse Problems 19 (2003) R1; the Jacobian is Kaufman's (BIT 15, 1975). Without a guess the loudest
line of the residual is taken, one after the other, in the order of RELAX (Li and Stoica, IEEE Trans. Signal Process.
44, 1996, 281) with damped lines: find one, refine all, go on.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...record import Floats

Complexes = NDArray[np.complex128]

#: Powers of time that take an offset up, so that it does not leak into the modes.
_OFFSET = 3
#: Halvings of a step that does not help.
_HALVINGS = 5
#: Columns nearer than this to the span of those before are too near for Cholesky's factor.
_PARALLEL = 1e-4
#: The search ends at a line that is less than this times the quiet tenth of the band, or so much below the loudest.
_OVER_NOISE, _RANGE = 8.0, 3e-3
#: Refining steps after each line, and at the end.
_STEPS, _LAST_STEPS = 2, 8
_PADDING = 2
#: Dampings that a new line is tried with, over the guess; no line is damped more than the last.
_WIDTHS, _MOST_DAMPED = (0.3, 1.0, 2.0, 4.0, 8.0), 0.3


@dataclass(frozen=True, eq=False)
class Poles:
    """Of M modes: `decay` s and `omega` w, (M,), 1/s. Frequency |s + i w| / 2 pi, damping ratio s / |s + i w|."""

    decay: Floats
    omega: Floats

    @classmethod
    def of(cls, frequency_hz: Floats, damping_ratio: Floats) -> Poles:
        circular = 2 * np.pi * frequency_hz
        return cls(damping_ratio * circular, circular * np.sqrt(1 - damping_ratio**2))

    @property
    def root(self) -> Complexes:
        """(M,): -s + i w."""
        return np.asarray(-self.decay + 1j * self.omega)

    @property
    def frequency_hz(self) -> Floats:
        return np.asarray(np.hypot(self.decay, self.omega) / (2 * np.pi))

    @property
    def damping_ratio(self) -> Floats:
        return np.asarray(self.decay / np.hypot(self.decay, self.omega))

    def sorted(self) -> Poles:
        order = np.argsort(self.omega)
        return Poles(self.decay[order], self.omega[order])


@dataclass(frozen=True, eq=False)
class Basis:
    """What poles span on a time axis, ready for any number of records of that length."""

    poles: Poles
    step_s: float
    modes: Floats  # (n, 2M): cosines, then sines
    q: Floats  # (n, 2M + 3), the offset's columns last
    r: Floats

    @classmethod
    def of(cls, poles: Poles, samples: int, step_s: float) -> Basis:
        modes = waves(poles, samples, step_s)
        offset = np.linspace(0.0, 1.0, samples)[:, None] ** np.arange(_OFFSET)
        return cls(poles, step_s, modes, *orthonormal(np.concatenate([modes, offset], axis=1)))

    @cached_property
    def timed(self) -> Floats:
        """(n, 2M): the modes times t."""
        return np.asarray(self.step_s * np.arange(self.modes.shape[0])[:, None] * self.modes)

    @cached_property
    def _timed_inside(self) -> Floats:
        return np.asarray(self.q.T @ self.timed)

    @cached_property
    def _timed_coefficients(self) -> Floats:
        """(2M + 3, 2M): of the columns, in the modes times t."""
        return np.asarray(np.linalg.solve(self.r, self._timed_inside), dtype=np.float64)

    @cached_property
    def _gram(self) -> Floats:
        """(2, M, 2, M): products of the modes times t, less what the columns span of them."""
        m = self.poles.omega.size
        gram = self.timed.T @ self.timed - self._timed_inside.T @ self._timed_inside
        return np.asarray(gram.reshape(2, m, 2, m))

    def amplitudes(self, records: Floats) -> Complexes:
        """Complex (M, k) of records (n, k): mode m is Re(amplitude exp(lambda t))."""
        return self._complex(np.linalg.solve(self.r, self.q.T @ records))

    def _complex(self, coefficients: NDArray[np.floating[Any]]) -> Complexes:
        m = self.poles.omega.size
        return np.asarray(coefficients[:m] - 1j * coefficients[m : 2 * m], dtype=np.complex128)

    def projected(self, records: Floats) -> tuple[Complexes, Floats]:
        """Amplitudes (M, k), and the modes times t on the residual (2M, k) of records (n, k), which is not needed."""
        inside = self.q.T @ records
        timed = self.timed.T @ records - self._timed_inside.T @ inside
        return self._complex(np.linalg.solve(self.r, inside)), np.asarray(timed)

    def shifted(self, amplitudes: Complexes, step: Floats) -> Complexes:
        """Amplitudes (M, k) that go with poles moved by `step` (2, M), to first order."""
        a, b = amplitudes.real, -amplitudes.imag
        decay, omega = step[:, :, None]
        moved_by = np.concatenate([-a * decay + b * omega, -b * decay - a * omega])
        return np.asarray(amplitudes - self._complex(self._timed_coefficients @ moved_by))

    def deviations(self, jtj: Floats, amplitudes: Complexes, noise: float) -> tuple[Floats, Floats]:
        """Standard deviations under white noise: of ln damping (M,) and of ln amplitude (M, k)."""
        m = self.poles.omega.size
        spread = noise * np.sqrt(np.maximum(np.diag(np.linalg.pinv(jtj))[:m], 0.0))
        rows = np.linalg.norm(np.linalg.inv(self.r), axis=1)[: 2 * m].reshape(2, m)
        level = noise * np.sqrt(np.mean(rows**2, axis=0))[:, None] / np.maximum(np.abs(amplitudes), 1e-300)
        return spread / self.poles.decay, level

    def residual(self, records: Floats) -> Floats:
        return np.asarray(records - self.q @ (self.q.T @ records))

    def normal(self, amplitudes: Complexes, timed: Floats) -> tuple[Floats, Floats]:
        """J'J (2M, 2M) and J'r (2M,) for changes of (decay, omega), over all records.

        `timed` (2M, k) are the modes times t on the residual, as `projected` gives them.
        """
        a, b = amplitudes.real, -amplitudes.imag
        # a record changes by t (-a u - b v) with the decay, by t (b u - a v) with omega; u, v cosine and sine
        weights = np.stack([np.stack([-a, -b]), np.stack([b, -a])])  # (parameter, column, M, k)
        m = self.poles.omega.size
        flat = weights.transpose(0, 2, 1, 3).reshape(4 * m, -1)
        products = (flat @ flat.T).reshape(2, m, 2, 2, m, 2)
        jtj = np.einsum("pmxqny,xmyn->pmqn", products, self._gram)
        jtr = np.einsum("pxmk,xmk->pm", weights, timed.reshape(2, m, -1))
        return jtj.reshape(2 * m, 2 * m), jtr.reshape(2 * m)


def waves(poles: Poles, samples: int, step_s: float) -> Floats:
    """Cosines, then sines, of the modes as they decay (n, 2M)."""
    step = poles.root * step_s
    block = int(np.ceil(np.sqrt(samples)))  # powers of powers: few exponentials
    fine, coarse = (np.exp(np.outer(by * np.arange(block), step)) for by in (1, block))
    turning = (coarse[:, None] * fine).reshape(block * block, -1)[:samples]
    return np.concatenate([turning.real, turning.imag], axis=1)


def orthonormal(base: Floats) -> tuple[Floats, Floats]:
    """Q and R of (n, c), by Cholesky's factor where columns are far from parallel: a fifth of the time."""
    gram = base.T @ base
    try:
        r = np.linalg.cholesky(gram).T
    except np.linalg.LinAlgError:
        return np.linalg.qr(base)
    if (np.diag(r) / np.sqrt(np.diag(gram))).min() < _PARALLEL:
        return np.linalg.qr(base)
    return base @ np.linalg.inv(r), np.asarray(r, dtype=np.float64)


def refined(poles: Poles, records: Floats, step_s: float, iterations: int) -> Poles:
    """Poles (M,) after Gauss-Newton steps on records (n, k), each kept only where it helps."""
    basis = Basis.of(poles, records.shape[0], step_s)
    residual = basis.residual(records)
    size = float(np.sum(residual**2))
    for _ in range(iterations):
        step = bounded_step(basis, *basis.normal(basis.amplitudes(records), basis.timed.T @ residual))
        for halving in range(_HALVINGS):
            next_basis = Basis.of(moved(basis.poles, step / 2**halving), records.shape[0], step_s)
            next_residual = next_basis.residual(records)
            if (next_size := float(np.sum(next_residual**2))) < size:
                break
        else:
            break
        gain = size - next_size
        basis, residual, size = next_basis, next_residual, next_size
        if gain < 1e-6 * size:
            break
    return basis.poles


def bounded_step(basis: Basis, jtj: Floats, jtr: Floats) -> Floats:
    """(2, M): the Gauss-Newton step of `Basis.normal`, no further than the poles' own widths."""
    damping = 1e-9 * float(np.trace(jtj)) / jtj.shape[0]
    step = np.linalg.solve(jtj + damping * np.eye(len(jtj)), jtr).reshape(2, -1)
    span = 1 / (basis.modes.shape[0] * basis.step_s)
    limit = np.stack([0.7 * basis.poles.decay + 0.2 * span, basis.poles.decay + 1.5 * span])
    return np.asarray(np.clip(step, -limit, limit))


def moved(poles: Poles, step: Floats) -> Poles:
    """Poles after a step (2, M); they keep ringing and decaying."""
    decay = np.maximum(poles.decay + step[0], 1e-5 * poles.omega)
    return Poles(decay, np.maximum(poles.omega + step[1], 0.2 * poles.omega))


def search_poles(
    records: Floats, step_s: float, band_hz: tuple[float, float], damping_ratio: float, most: int
) -> Poles:
    """Poles within a band, at most so many, of records (n, k), in rising order; `damping_ratio` is a first guess."""
    poles = Poles(np.zeros(0), np.zeros(0))
    residual = records - records.mean(axis=0)
    loudest = 0.0
    for _ in range(most):
        frequency, level, quiet = _loudest_line(residual, step_s, band_hz)
        loudest = max(loudest, level)
        if level < _OVER_NOISE * quiet or level < _RANGE * loudest:
            break
        line = _best_damped(residual, step_s, frequency, damping_ratio)
        poles = Poles(np.append(poles.decay, line.decay), np.append(poles.omega, line.omega))
        poles = _inside(refined(poles, records, step_s, _STEPS), band_hz)
        if not poles.omega.size:
            break
        residual = Basis.of(poles, records.shape[0], step_s).residual(records)
    return refined(poles, records, step_s, _LAST_STEPS).sorted() if poles.omega.size else poles


def _loudest_line(residual: Floats, step_s: float, band_hz: tuple[float, float]) -> tuple[float, float, float]:
    """Frequency and amplitude of the loudest line in a band, and the amplitude of the band's quiet tenth."""
    from scipy.fft import next_fast_len, rfft

    n = residual.shape[0]
    window = np.cos(0.5 * np.pi * np.arange(n) / n) ** 2  # ringing is loudest at its beginning
    length = next_fast_len(_PADDING * n, real=True)
    level = np.sqrt(np.mean(np.abs(rfft(residual * window[:, None], length, axis=0)) ** 2, axis=1))
    frequency = np.arange(level.size) / (length * step_s)
    inside = np.flatnonzero((frequency >= band_hz[0]) & (frequency <= band_hz[1]))
    loudest = inside[int(np.argmax(level[inside]))]
    return float(frequency[loudest]), float(level[loudest]), float(np.quantile(level[inside], 0.1))


def _best_damped(residual: Floats, step_s: float, frequency_hz: float, damping_ratio: float) -> Poles:
    """The line at a frequency whose damping, of some about a guess, takes most of the residual."""
    lines = [Poles.of(np.array([frequency_hz]), np.array([min(damping_ratio * by, _MOST_DAMPED)])) for by in _WIDTHS]
    columns = [orthonormal(waves(line, residual.shape[0], step_s))[0] for line in lines]
    return lines[int(np.argmax([float(np.sum((q.T @ residual) ** 2)) for q in columns]))]


def _inside(poles: Poles, band_hz: tuple[float, float]) -> Poles:
    """Without those that left the band, fell together, or no longer ring."""
    poles = poles.sorted()
    apart = np.diff(poles.omega, prepend=-np.inf) > 0.1 * poles.decay
    in_band = (poles.frequency_hz >= 0.8 * band_hz[0]) & (poles.frequency_hz <= 1.1 * band_hz[1])
    good = apart & in_band & (poles.damping_ratio <= _MOST_DAMPED)
    return Poles(poles.decay[good], poles.omega[good])
