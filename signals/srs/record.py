"""A shock response spectrum."""

from __future__ import annotations

from dataclasses import dataclass

from ...array_types import Floats


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Shock response spectra at `frequency_hz` (f,); arrays are (..., f), absolute acceleration in m/s2, >= 0.

    `positive` and `negative` are the largest responses either way over all time, `primary` the larger of both while the
    record lasts, `residual` after it; `maximax` is the largest of all. `pseudo_velocity_m_s` is the maximax of the
    relative displacement times omega. `sampling_error` (f,): how much of a peak may be missed between samples,
    relative, at most.
    """

    frequency_hz: Floats
    damping_ratio: float
    maximax: Floats
    positive: Floats
    negative: Floats
    primary: Floats
    residual: Floats
    pseudo_velocity_m_s: Floats
    sampling_error: Floats

    @property
    def q(self) -> float:
        return 1 / (2 * self.damping_ratio)
