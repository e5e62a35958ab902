"""Damped oscillators of unit mass under a force that is straight between its samples, exactly.

Glossary: z the complex state of a mode, z' = lambda z + F with lambda = -zeta omega + i omega_d, so that the modal
coordinate is q = Im(z) / omega_d and its acceleration q'' = F + Im(lambda^2 z) / omega_d.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Oscillators"]

_LONGEST_BLOCK = 1024
_MOST_DECAY = 5.0


@dataclass(frozen=True)
class Oscillators:
    """Poles (m,), and what takes the states (m,) to accelerations at the sensors (sensors, m)."""

    poles: NDArray[np.complex128]
    readings: NDArray[np.complex128]

    @classmethod
    def of(
        cls, frequencies_hz: NDArray[np.float64], damping: NDArray[np.float64], weights: NDArray[np.float64]
    ) -> Oscillators:
        """The elastic ones among modes (m,), `weights` (sensors, m) being shape at sensor times shape at the hit."""
        elastic = frequencies_hz > 0  # a rigid mode's acceleration is the force itself
        omega, zeta = 2 * np.pi * frequencies_hz[elastic], damping[elastic]
        damped = omega * np.sqrt(1 - zeta**2)
        poles = -zeta * omega + 1j * damped
        return cls(poles, weights[:, elastic] * poles**2 / damped)

    def block(self, step_s: float) -> int:
        """Steps over which no mode decays by more than exp(-5), so that `stepped` may divide by the decay."""
        fastest = float(-self.poles.real.min(initial=0.0)) * step_s
        return _LONGEST_BLOCK if fastest * _LONGEST_BLOCK <= _MOST_DECAY else max(1, int(_MOST_DECAY / fastest))

    def stepped(
        self, step_s: float, state: NDArray[np.complex128], samples: NDArray[np.float64]
    ) -> NDArray[np.complex128]:
        """States (m, samples) at the samples of a force, from the state (m,) at the first; one block at most."""
        unit, none = np.ones(1), np.zeros((self.poles.size, 1), dtype=np.complex128)
        from_level = self.after(step_s * unit, none, unit, 0 * unit)
        from_slope = self.after(step_s * unit, none, 0 * unit, unit / step_s)
        decay = np.exp(np.outer(self.poles, step_s * np.arange(samples.size - 1)))
        added = from_level * samples[:-1] + from_slope * np.diff(samples)
        gathered = np.cumsum(added / decay, axis=1) + (np.exp(self.poles * step_s) * state)[:, None]
        return np.concatenate([state[:, None], decay * gathered], axis=1)

    def after(
        self,
        since_s: NDArray[np.float64],
        states: NDArray[np.complex128],
        level: NDArray[np.float64],
        slope: NDArray[np.float64],
    ) -> NDArray[np.complex128]:
        """States (m, n) some times (n,) after `states` (m, n), under a force from `level` on, growing with `slope`."""
        x = self.poles[:, None] * since_s
        first = _divided(np.expm1(x), x, 1 + x / 2 + x**2 / 6 + x**3 / 24 + x**4 / 120)
        second = _divided(first - 1, x, 1 / 2 + x / 6 + x**2 / 24 + x**3 / 120 + x**4 / 720)
        return np.asarray(np.exp(x) * states + level * since_s * first + slope * since_s**2 * second)

    def decaying(self, state: NDArray[np.complex128], delay_s: float, step_s: float, count: int) -> NDArray[np.float64]:
        """Accelerations (sensors, count) without a force, from `delay_s` after the states (m,) on.

        exp(lambda (j B + k) step) is a product: two short tables instead of one number for every mode and instant.
        """
        length = math.isqrt(count - 1) + 1
        starts = np.exp(np.outer(self.poles, delay_s + step_s * length * np.arange(-(-count // length))))
        within = np.exp(np.outer(self.poles, step_s * np.arange(length)))
        rows = [((reading * state)[:, None] * starts).T @ within for reading in self.readings]
        return np.array([row.imag.ravel()[:count] for row in rows]).reshape(-1, count)


def _divided(
    over: NDArray[np.complex128], x: NDArray[np.complex128], series: NDArray[np.complex128]
) -> NDArray[np.complex128]:
    """over / x, by its series where that is the more exact."""
    small = np.abs(x) < 5e-3
    return np.where(small, series, over / np.where(small, 1, x))
