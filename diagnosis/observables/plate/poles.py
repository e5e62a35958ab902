"""Damped ringing in records: poles by least squares, with amplitudes eliminated (variable projection).

Every record is a sum of modes exp(-s t) (a cos w t + b sin w t) and a slow offset; all records have the same poles.
Golub and Pereyra, Inverse Problems 19 (2003) R1; the Jacobian is Kaufman's (BIT 15, 1975).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

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
    def taken(self) -> Floats:
        """(2M + 3, 2M): coefficients of the modes times t in the columns."""
        return np.asarray(np.linalg.solve(self.r, self._inside), dtype=np.float64)

    @cached_property
    def gram(self) -> Floats:
        """(2M, 2M): products of the modes times t, less what the columns span of them."""
        return np.asarray(self._timed.T @ self._timed - self._inside.T @ self._inside)

    @cached_property
    def _timed(self) -> Floats:
        return np.asarray(self.step_s * np.arange(self.modes.shape[0])[:, None] * self.modes)

    @cached_property
    def _inside(self) -> Floats:
        return np.asarray(self.q.T @ self._timed)

    def amplitudes(self, records: Floats) -> Complexes:
        """Complex (M, k) of records (n, k): mode m is Re(amplitude exp(lambda t))."""
        return self._amplitudes(self.q.T @ records)

    def _amplitudes(self, inside: Floats) -> Complexes:
        m = self.poles.omega.size
        found = np.linalg.solve(self.r, inside)
        return np.asarray(found[:m] - 1j * found[m : 2 * m])

    def projected(self, records: Floats) -> tuple[Complexes, Floats]:
        """Amplitudes (M, k), and (2M, k) the modes times t on what is left of records (n, k): `left` is not needed."""
        inside = self.q.T @ records
        return self._amplitudes(inside), np.asarray(self._timed.T @ records - self._inside.T @ inside)

    def shifted(self, amplitudes: Complexes, step: Floats) -> Complexes:
        """Amplitudes (M, k) that go with poles moved by `step` (2, M), to first order."""
        a, b = amplitudes.real, -amplitudes.imag
        decay, omega = step[:, :, None]
        moved_by = np.concatenate([-a * decay + b * omega, -b * decay - a * omega])
        m = self.poles.omega.size
        change = self.taken @ moved_by
        return np.asarray(amplitudes - (change[:m] - 1j * change[m : 2 * m]))

    def deviations(self, jtj: Floats, amplitudes: Complexes, noise: float) -> tuple[Floats, Floats, Floats]:
        """Standard deviations under white noise: of ln frequency (M,), ln damping (M,), ln amplitude (M, k)."""
        m = self.poles.omega.size
        spread = noise * np.sqrt(np.maximum(np.diag(np.linalg.pinv(jtj)), 0.0)).reshape(2, m)
        rows = np.linalg.norm(np.linalg.inv(self.r), axis=1)[: 2 * m].reshape(2, m)
        level = noise * np.sqrt(np.mean(rows**2, axis=0))[:, None] / np.maximum(np.abs(amplitudes), 1e-300)
        return spread[1] / self.poles.omega, spread[0] / self.poles.decay, level

    def left(self, records: Floats) -> Floats:
        return np.asarray(records - self.q @ (self.q.T @ records))

    def normal(self, amplitudes: Complexes, residual: Floats) -> tuple[Floats, Floats]:
        """J'J (2M, 2M) and J'r (2M,) for changes of (decay, omega), over all records (n, k)."""
        return self.normal_of(amplitudes, self._timed.T @ residual)

    def normal_of(self, amplitudes: Complexes, timed: Floats) -> tuple[Floats, Floats]:
        """As `normal`, from what `projected` says."""
        a, b = amplitudes.real, -amplitudes.imag
        # a record changes by t (-a u - b v) with the decay, by t (b u - a v) with omega; u, v cosine and sine
        weights = np.stack([np.stack([-a, -b]), np.stack([b, -a])])  # (parameter, column, M, k)
        m = self.poles.omega.size
        gram = self.gram.reshape(2, m, 2, m)
        flat = weights.transpose(0, 2, 1, 3).reshape(4 * m, -1)
        both = (flat @ flat.T).reshape(2, m, 2, 2, m, 2)
        jtj = np.einsum("pmxqny,xmyn->pmqn", both, gram)
        jtr = np.einsum("pxmk,xmk->pm", weights, timed.reshape(2, m, -1))
        return jtj.reshape(2 * m, 2 * m), jtr.reshape(2 * m)


def waves(poles: Poles, samples: int, step_s: float) -> Floats:
    """Cosines, then sines, of the modes as they decay (n, 2M)."""
    step = (-poles.decay + 1j * poles.omega) * step_s
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
    size = np.diag(r) / np.sqrt(np.diag(gram))
    if size.min() < _PARALLEL:
        return np.linalg.qr(base)
    return base @ np.linalg.inv(r), np.asarray(r, dtype=np.float64)


def refined(poles: Poles, records: Floats, step_s: float, iterations: int) -> Poles:
    """Poles (M,) after Gauss-Newton steps on records (n, k), each kept only where it helps."""
    basis = Basis.of(poles, records.shape[0], step_s)
    residual = basis.left(records)
    size = float(np.sum(residual**2))
    for _ in range(iterations):
        step = bounded_step(basis, *basis.normal(basis.amplitudes(records), residual))
        for halving in range(_HALVINGS):
            other = Basis.of(moved(basis.poles, step / 2**halving), records.shape[0], step_s)
            other_residual = other.left(records)
            if (other_size := float(np.sum(other_residual**2))) < size:
                break
        else:
            break
        gained = size - other_size
        basis, residual, size = other, other_residual, other_size
        if gained < 1e-6 * size:
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
    return replace(poles, decay=decay, omega=np.maximum(poles.omega + step[1], 0.2 * poles.omega))
