"""The exact step of a mode under a force that is straight between its samples: the ramp-invariant rule.

Glossary: q modal coordinate, q'' + 2 zeta omega q' + omega^2 q = F for a unit shape; lambda = -zeta omega + i omega_d
its pole; z' = lambda z + F, so that q = Im(z) / omega_d; w = lambda^2 z / omega_d, so that q'' = F + Im(w).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...array_types import Complexes, Floats

#: Below this |lambda dt| a series of five terms is the more exact one.
_SMALL = 2e-2


@dataclass(frozen=True, eq=False)
class Recursion:
    """w[n+1] = turn w[n] + before F[n] + after F[n+1] for every mode; each (m,), complex.

    Smallwood's rule (Shock and Vibration Bulletin 51, 1981; ISO 18431-4) in the form of a turning pointer. His two-step
    form has the same numbers on paper, but the roots of its polynomial crowd at 1 where omega dt is small, and it loses
    (omega dt)^-2 of the precision; the pointer loses nothing.
    """

    turn: Complexes
    before: Complexes
    after: Complexes

    @classmethod
    def of(cls, frequency_hz: Floats, damping_ratio: Floats, step_s: float) -> Recursion:
        """For modes (m,) above 0 Hz, damping ratio below 1."""
        omega = 2 * np.pi * frequency_hz
        damped = omega * np.sqrt(1 - damping_ratio**2)
        pole = -damping_ratio * omega + 1j * damped
        x = np.asarray(pole * step_s, dtype=np.complex128)
        level = _over(np.expm1(x), x, (1, 1 / 2, 1 / 6, 1 / 24, 1 / 120, 1 / 720))
        slope = _over(level - 1, x, (1 / 2, 1 / 6, 1 / 24, 1 / 120, 1 / 720, 1 / 5040))
        gain = pole**2 / damped * step_s
        return cls(np.exp(x), gain * (level - slope), gain * slope)


def _over(numerator: Complexes, x: Complexes, series: tuple[float, ...]) -> Complexes:
    """numerator / x, by its series (rising powers) where x is small."""
    small = np.abs(x) < _SMALL
    powers = np.polynomial.polynomial.polyval(x, np.asarray(series))
    return np.where(small, powers, numerator / np.where(small, 1, x))
