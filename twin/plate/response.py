"""The plate's answer to short pulses, computed once and convolved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .modal import ModalPlate
from .respond import respond

#: Threads of one transform; more do not pay for some ten thousand samples.
_WORKERS = 2
#: Pulses are given room in steps of so many samples, so that few transforms of the plate's own answer serve all.
_ROOM = 512


@dataclass(frozen=True, eq=False)
class PlateResponse:
    """Acceleration (sensors, n) after a unit force that is 0 at the samples around one and straight between.

    `hat` begins a step before its peak, `jump` with the peak; both have their peak at the first sample. Any force that
    is straight between its samples is a sum of these, so that the answers are those of `respond`, to rounding.
    """

    hat: Floats
    jump: Floats
    step_s: float
    _spectra: dict[int, NDArray[np.complex128]] = field(default_factory=dict, init=False, repr=False)

    @classmethod
    def of(cls, plate: ModalPlate, point: str, sensors: Sequence[str] | None, step_s: float, samples: int) -> Self:
        """For records of so many samples; raises what `respond` does."""
        if samples < 2:
            raise ValueError(f"samples = {samples}: expected 2 or more")
        unit = np.zeros((2, samples + 1))
        unit[0, 1] = unit[1, 0] = 1.0
        late, jump = respond(plate, unit, step_s, point, sensors)
        return cls(np.ascontiguousarray(late[:, 1:]), np.ascontiguousarray(jump[:, :-1]), step_s)

    def accelerations(self, force_n: Floats) -> Floats:
        """(k, sensors, n) under forces (k, p) of p samples, `step_s` apart, at most n; zero after them.

        (sensors, n) under one (p,). Raises `ValueError` for another shape.
        """
        force = np.asarray(force_n, dtype=np.float64)
        samples = self.hat.shape[1]
        if force.ndim not in (1, 2) or force.shape[-1] > samples or not np.all(np.isfinite(force)):
            raise ValueError(f"force_n has shape {force.shape}: expected (p,) or (k, p), p up to {samples}, all finite")
        rows = np.atleast_2d(force)
        out = self._convolved(rows)
        begun = np.flatnonzero(rows[:, 0])
        out[begun] += rows[begun, 0, None, None] * (self.jump - self.hat)
        return np.asarray(out[0] if force.ndim == 1 else out)

    def _convolved(self, rows: Floats) -> Floats:
        from scipy.fft import irfft, next_fast_len, rfft

        samples = self.hat.shape[1]
        length = next_fast_len(samples + _ROOM * -(-rows.shape[1] // _ROOM), real=True)
        spectra = rfft(rows, length, workers=_WORKERS)
        if length not in self._spectra:
            self._spectra[length] = rfft(self.hat, length)
        answers = self._spectra[length]
        return np.asarray(irfft(spectra[:, None] * answers, length, workers=_WORKERS, overwrite_x=True)[..., :samples])
