"""Damped ringing in records: poles by least squares, with amplitudes eliminated (variable
projection).

Every record is a sum of modes Re(A exp(lambda t)) and a slow offset; all records have the same
poles lambda = -s + i w. Golub and Pereyra, Inverse Problems 19 (2003) R1; the Jacobian is Kaufman's
(BIT 15, 1975). Without a guess the loudest line of the residual is taken, one after the other, in
the order of RELAX (Li and Stoica, IEEE Trans. Signal Process. 44, 1996, 281) with damped lines:
find one, refine all, go on.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...array_types import Complexes, Floats

#: Powers of time that take an offset up, so that it does not leak into the modes.
_OFFSET = 3
#: Halvings of a step that does not help.
_HALVINGS = 5
#: Columns nearer than this to the span of those before are too near for Cholesky's factor.
_PARALLEL = 1e-4
#: The search ends at a line that is less than this times the quiet tenth of the band, or so much
#: below the loudest.
_OVER_NOISE, _RANGE = 8.0, 3e-3
#: Refining steps after each line, and at the end.
_STEPS, _LAST_STEPS = 2, 8
_PADDING = 2
#: Dampings that a new line is tried with, over the guess; no line is damped more than the last.
_WIDTHS, _MOST_DAMPED = (0.3, 1.0, 2.0, 4.0, 8.0), 0.3


def poles_of(frequency_hz: Floats, damping_ratio: Floats) -> Complexes:
    """-s + i w in 1/s, of the same shape: its magnitude is the undamped circular frequency, s over
    that the ratio."""
    return np.asarray(
        2 * np.pi * frequency_hz * (1j * np.sqrt(1 - damping_ratio**2) - damping_ratio)
    )


def frequencies_hz(poles: Complexes) -> Floats:
    return np.asarray(np.abs(poles) / (2 * np.pi))


def damping_ratios(poles: Complexes) -> Floats:
    return np.asarray(-poles.real / np.abs(poles))


@dataclass(frozen=True, eq=False)
class Basis:
    """What poles (M,) span on a time axis, ready for any number of records of that length."""

    poles: Complexes
    step_s: float
    modes: Floats  # (n, 2M): cosines, then sines
    q: Floats  # (n, 2M + 3), the offset's columns last
    r: Floats

    @classmethod
    def of(cls, poles: Complexes, samples: int, step_s: float) -> Basis:
        modes = waves(poles, samples, step_s)
        offset = np.linspace(0.0, 1.0, samples)[:, None] ** np.arange(_OFFSET)
        return cls(poles, step_s, modes, *orthonormal(np.concatenate([modes, offset], axis=1)))

    @cached_property
    def _timed(self) -> Floats:
        """(n, 2M): the modes times t."""
        return np.asarray(self.step_s * np.arange(self.modes.shape[0])[:, None] * self.modes)

    @cached_property
    def _timed_inside(self) -> Floats:
        return np.asarray(self.q.T @ self._timed)

    @cached_property
    def _timed_coefficients(self) -> Floats:
        """(2M + 3, 2M): of the columns, in the modes times t."""
        return np.asarray(np.linalg.solve(self.r, self._timed_inside), dtype=np.float64)

    @cached_property
    def _gram(self) -> Floats:
        """(2, M, 2, M): products of the modes times t, less what the columns span of them."""
        gram = self._timed.T @ self._timed - self._timed_inside.T @ self._timed_inside
        return np.asarray(gram.reshape(2, self.poles.size, 2, self.poles.size))

    def residual(self, records: Floats) -> Floats:
        return np.asarray(records - self.q @ (self.q.T @ records))

    def projected(self, records: Floats) -> tuple[Complexes, Floats]:
        """Amplitudes A (M, k) of records (n, k), and the modes times t on their residual (2M,
        k)."""
        inside = self.q.T @ records
        timed = self._timed.T @ records - self._timed_inside.T @ inside
        coefficients = np.asarray(np.linalg.solve(self.r, inside), dtype=np.float64)
        return self._complex(coefficients), np.asarray(timed)

    def _complex(self, coefficients: Floats) -> Complexes:
        m = self.poles.size
        return np.asarray(coefficients[:m] - 1j * coefficients[m : 2 * m], dtype=np.complex128)

    def step(self, amplitudes: Complexes, timed: Floats) -> tuple[Complexes, Floats]:
        """The Gauss-Newton step of the poles (M,), no further than their own widths, and J'J (2M,
        2M) for (s, w).

        `amplitudes` (M, k) and `timed` (2M, k) as `projected` gives them.
        """
        m = self.poles.size
        # a record changes by t Re(-A exp(lambda t)) with s, by t Re(iA exp(lambda t)) with w
        weights = np.stack([_coefficients(-amplitudes), _coefficients(1j * amplitudes)]).reshape(
            2, 2, m, -1
        )
        flat = weights.transpose(0, 2, 1, 3).reshape(4 * m, -1)  # of (parameter, M, column)
        products = (flat @ flat.T).reshape(2, m, 2, 2, m, 2)
        jtj = np.einsum("pmxqny,xmyn->pmqn", products, self._gram).reshape(2 * m, 2 * m)
        jtr = np.einsum("pxmk,xmk->pm", weights, timed.reshape(2, m, -1)).reshape(2 * m)
        level = (
            1e-9 * float(np.trace(jtj)) / (2 * m)
        )  # Levenberg's, for modes that are hardly there
        decay, omega = np.linalg.solve(jtj + level * np.eye(2 * m), jtr).reshape(2, m)
        span, width = 1 / (self.modes.shape[0] * self.step_s), -self.poles.real
        most_decay, most_omega = 0.7 * width + 0.2 * span, width + 1.5 * span
        return 1j * np.clip(omega, -most_omega, most_omega) - np.clip(
            decay, -most_decay, most_decay
        ), jtj

    def shifted(self, amplitudes: Complexes, step: Complexes) -> Complexes:
        """Amplitudes (M, k) that go with poles moved by `step` (M,), to first order."""
        moved_by = _coefficients(amplitudes * step[:, None])
        return np.asarray(amplitudes - self._complex(self._timed_coefficients @ moved_by))

    def deviations(self, jtj: Floats, amplitudes: Complexes, noise: float) -> tuple[Floats, Floats]:
        """Standard deviations under white noise: of ln damping (M,) and of ln amplitude (M, k)."""
        m = self.poles.size
        spread = noise * np.sqrt(np.maximum(np.diag(np.linalg.pinv(jtj))[:m], 0.0))
        rows = np.linalg.norm(np.linalg.inv(self.r), axis=1)[: 2 * m].reshape(2, m)
        level = (
            noise
            * np.sqrt(np.mean(rows**2, axis=0))[:, None]
            / np.maximum(np.abs(amplitudes), 1e-300)
        )
        return spread / -self.poles.real, level


def _coefficients(amplitudes: Complexes) -> Floats:
    """(2M, k): of cosines, then of sines, of complex amplitudes (M, k)."""
    return np.concatenate([amplitudes.real, -amplitudes.imag])


def waves(poles: Complexes, samples: int, step_s: float) -> Floats:
    """Cosines, then sines, of the modes as they decay (n, 2M)."""
    block = int(np.ceil(np.sqrt(samples)))  # powers of powers: few exponentials
    fine, coarse = (np.exp(np.outer(by * np.arange(block), poles * step_s)) for by in (1, block))
    turning = (coarse[:, None] * fine).reshape(block * block, -1)[:samples]
    return np.concatenate([turning.real, turning.imag], axis=1)


def orthonormal(base: Floats) -> tuple[Floats, Floats]:
    """Q and R of (n, c), by Cholesky's factor where columns are far from parallel: a fifth of the
    time."""
    gram = base.T @ base
    try:
        r = np.asarray(np.linalg.cholesky(gram).T, dtype=np.float64)
    except np.linalg.LinAlgError:
        return np.linalg.qr(base)
    if (np.diag(r) / np.sqrt(np.diag(gram))).min() < _PARALLEL:
        return np.linalg.qr(base)
    return base @ np.linalg.inv(r), r


def refined(poles: Complexes, records: Floats, step_s: float, iterations: int) -> Complexes:
    """Poles (M,) after Gauss-Newton steps on records (n, k), each kept only where it helps."""
    basis = Basis.of(poles, records.shape[0], step_s)
    size = float(np.sum(basis.residual(records) ** 2))
    for _ in range(iterations):
        step, _ = basis.step(*basis.projected(records))
        for halving in range(_HALVINGS):
            next_basis = Basis.of(
                stepped_poles(basis.poles, step / 2**halving), records.shape[0], step_s
            )
            if (next_size := float(np.sum(next_basis.residual(records) ** 2))) < size:
                break
        else:
            break
        basis, gain, size = next_basis, size - next_size, next_size
        if gain < 1e-6 * size:
            break
    return basis.poles


def stepped_poles(poles: Complexes, step: Complexes) -> Complexes:
    """Poles after a step (M,); they keep ringing and decaying."""
    after, omega = poles + step, poles.imag
    return np.minimum(after.real, -1e-5 * omega) + 1j * np.maximum(after.imag, 0.2 * omega)


def search_poles(
    records: Floats, step_s: float, band_hz: tuple[float, float], damping_ratio: float, most: int
) -> Complexes:
    """Poles within a band, at most so many, of records (n, k), in rising order; `damping_ratio` is
    a first guess."""
    poles = np.zeros(0, dtype=np.complex128)
    residual = records - records.mean(axis=0)
    loudest = 0.0
    for _ in range(most):
        frequency, level, quiet = _loudest_line(residual, step_s, band_hz)
        loudest = max(loudest, level)
        if level < _OVER_NOISE * quiet or level < _RANGE * loudest:
            break
        poles = np.append(poles, _best_damped(residual, step_s, frequency, damping_ratio))
        poles = _inside(refined(poles, records, step_s, _STEPS), band_hz)
        if not poles.size:
            break
        residual = Basis.of(poles, records.shape[0], step_s).residual(records)
    return _rising(refined(poles, records, step_s, _LAST_STEPS)) if poles.size else poles


def _loudest_line(
    residual: Floats, step_s: float, band_hz: tuple[float, float]
) -> tuple[float, float, float]:
    """Frequency and amplitude of the loudest line in a band, and the amplitude of the band's quiet
    tenth."""
    from scipy.fft import next_fast_len, rfft

    n = residual.shape[0]
    window = np.cos(0.5 * np.pi * np.arange(n) / n) ** 2  # ringing is loudest at its beginning
    length = next_fast_len(_PADDING * n, real=True)
    level = np.sqrt(np.mean(np.abs(rfft(residual * window[:, None], length, axis=0)) ** 2, axis=1))
    frequency = np.arange(level.size) / (length * step_s)
    inside = np.flatnonzero((frequency >= band_hz[0]) & (frequency <= band_hz[1]))
    loudest = inside[int(np.argmax(level[inside]))]
    return float(frequency[loudest]), float(level[loudest]), float(np.quantile(level[inside], 0.1))


def _best_damped(
    residual: Floats, step_s: float, frequency_hz: float, damping_ratio: float
) -> Complexes:
    """The pole (1,) at a frequency whose damping, of some about a guess, takes most of the
    residual."""
    poles = poles_of(
        np.array([frequency_hz]), np.minimum(damping_ratio * np.array(_WIDTHS), _MOST_DAMPED)
    )
    columns = [
        orthonormal(waves(poles[i : i + 1], residual.shape[0], step_s))[0]
        for i in range(poles.size)
    ]
    best = int(np.argmax([float(np.sum((q.T @ residual) ** 2)) for q in columns]))
    return poles[best : best + 1]


def _inside(poles: Complexes, band_hz: tuple[float, float]) -> Complexes:
    """Without those that left the band, fell together, or no longer ring."""
    poles = _rising(poles)
    apart = np.diff(poles.imag, prepend=-np.inf) > -0.1 * poles.real
    in_band = (frequencies_hz(poles) >= 0.8 * band_hz[0]) & (
        frequencies_hz(poles) <= 1.1 * band_hz[1]
    )
    return poles[apart & in_band & (damping_ratios(poles) <= _MOST_DAMPED)]


def _rising(poles: Complexes) -> Complexes:
    return poles[np.argsort(poles.imag)]
