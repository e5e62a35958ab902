"""The part of a record in which a plate rings freely, at no higher rate than the modes that are looked for need."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...record import Floats

#: Samples to a cycle of the highest mode that are kept at least; attenuation of what is beyond, dB.
_PER_CYCLE, _ATTENUATION = 4.0, 70.0
#: From here on, over the highest mode, nothing is left.
_STEEP = 1.2


@dataclass(frozen=True, eq=False)
class RingingWindow:
    """Samples from `first` to before `last`, every `factor`-th, of records that `taps` have filtered; none for None."""

    first: int
    last: int
    factor: int
    rate_hz: float
    taps: Floats | None

    @classmethod
    def of(cls, ringing: int, samples: int, rate_hz: float, highest_hz: float) -> RingingWindow:
        """For records of so many samples that ring freely from sample `ringing` on."""
        from scipy.signal import firwin, kaiser_beta, kaiserord

        factor = int(rate_hz / (_PER_CYCLE * highest_hz))
        if factor < 2:
            return cls(ringing, samples, 1, rate_hz, None)
        stop = min(rate_hz / factor - highest_hz, _STEEP * highest_hz)
        count = kaiserord(_ATTENUATION, 2 * (stop - highest_hz) / rate_hz)[0] | 1
        middle = 0.5 * (stop + highest_hz)
        taps = firwin(count, middle, window=("kaiser", kaiser_beta(_ATTENUATION)), fs=rate_hz)
        return cls(ringing + count // 2, samples - count // 2, factor, rate_hz, np.asarray(taps))

    @property
    def start_s(self) -> float:
        """From a record's first sample."""
        return self.first / self.rate_hz

    @property
    def step_s(self) -> float:
        return self.factor / self.rate_hz

    @property
    def samples(self) -> int:
        return max(0, -(-(self.last - self.first) // self.factor))

    def cut(self, acceleration: Floats) -> Floats:
        """(..., samples) of (..., n). The filter is even: it delays nothing, and leaves modes below as they are."""
        from scipy.signal import fftconvolve

        if self.taps is None:
            return acceleration[..., self.first : self.last]
        taps = self.taps.reshape((1,) * (acceleration.ndim - 1) + (-1,))
        return np.asarray(
            fftconvolve(acceleration, taps, mode="same", axes=-1)[..., self.first : self.last : self.factor]
        )
