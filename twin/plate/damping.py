"""Laws of modal damping, for a plate whose modes have not been measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ...array_types import Floats


class DampingLaw(Protocol):
    """Ratio as a function of frequency; a frozen record, so that a plate that has one is hashable."""

    def ratios(self, frequency_hz: Floats) -> Floats:
        """(m,) at modes (m,), rigid ones at 0 Hz among them."""
        ...


@dataclass(frozen=True)
class ConstantDamping:
    """The same ratio at every mode.

    0.5 % is our assumption: metal alone has a tenth of that or less (Cremer, Heckl, Petersson, Structure-Borne Sound:
    loss factors, 2 zeta, of 1e-4 to 1e-3); cables, joints and what the plate hangs from bring it to 0.2 to 1 %.
    """

    ratio: float = 0.005

    def __post_init__(self) -> None:
        if not 0 <= self.ratio < 1:
            raise ValueError(f"ratio = {self.ratio!r}: expected 0 to below 1")

    def ratios(self, frequency_hz: Floats) -> Floats:
        return np.full(frequency_hz.shape, self.ratio)


@dataclass(frozen=True)
class RayleighDamping:
    """C = alpha M + beta K: zeta = alpha / (2 omega) + beta omega / 2; a rigid mode, which nothing damps, has 0.

    Given by the ratio at two frequencies, low and high. Raises `ValueError` where that takes a negative alpha or beta.
    """

    low_hz: float
    low_ratio: float
    high_hz: float
    high_ratio: float

    def __post_init__(self) -> None:
        if not 0 < self.low_hz < self.high_hz:
            raise ValueError(f"frequencies {self.low_hz!r} and {self.high_hz!r} Hz: expected rising ones above 0")
        if not (min(self._coefficients()) >= 0 and 0 <= self.low_ratio < 1 and 0 <= self.high_ratio < 1):
            raise ValueError(f"ratios {self.low_ratio!r} and {self.high_ratio!r}: no Rayleigh damping has them")

    def ratios(self, frequency_hz: Floats) -> Floats:
        alpha, beta = self._coefficients()
        omega = 2 * np.pi * frequency_hz
        elastic = omega > 0
        return np.where(elastic, alpha / (2 * np.where(elastic, omega, 1)) + beta * omega / 2, 0.0)

    def _coefficients(self) -> tuple[float, float]:
        low, high = 2 * np.pi * self.low_hz, 2 * np.pi * self.high_hz
        alpha = 2 * low * high * (self.low_ratio * high - self.high_ratio * low) / (high**2 - low**2)
        return alpha, 2 * (self.high_ratio * high - self.low_ratio * low) / (high**2 - low**2)
