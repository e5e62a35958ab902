"""How accelerations are read, measured or simulated: the ringing, spectrum lines and what a channel rests at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....array_types import Floats
from ....signals.srs.spectrum import shock_response_spectrum
from ....twin.plate.modal import ModalPlate
from .signals import PlateSignals

Q, PER_OCTAVE = 10.0, 3
#: Lines reach from below the lowest mode to below the highest: beyond, modes that are not listed would tell.
_BELOW, _ABOVE = 0.7, 0.75
#: Lines are below this share of the sampling rate, and have so many cycles in a record.
_RATE, _CYCLES = 0.1, 3.0
#: Periods of the lowest mode that a window needs to see the level under the ringing; shares of the ringing it spans.
_PERIODS = 5.0
_HALVES, _WHOLE = ((0.0, 0.5), (0.5, 1.0)), ((0.0, 1.0),)
#: Samples to a cycle of the highest mode that are kept at least; attenuation of what is beyond, dB.
_PER_CYCLE, _ATTENUATION = 4.0, 70.0
#: From here on, over the highest mode, nothing is left.
_STEEP = 1.2


@dataclass(frozen=True, eq=False)
class RingingWindow:
    """The part of a record in which a plate rings freely, at no higher rate than the modes that are looked for need.

    The samples `kept` of records that `taps` have filtered; none for None. They begin `start_s` after the first.
    """

    kept: slice
    step_s: float
    start_s: float
    taps: Floats | None = None

    @classmethod
    def of(cls, ringing: int, samples: int, rate_hz: float, highest_hz: float) -> RingingWindow:
        """For records of so many samples that ring freely from sample `ringing` on."""
        from scipy.signal import firwin, kaiser_beta, kaiserord

        factor = int(rate_hz / (_PER_CYCLE * highest_hz))
        if factor < 2:
            return cls(slice(ringing, samples, 1), 1 / rate_hz, ringing / rate_hz)
        stop = min(rate_hz / factor - highest_hz, _STEEP * highest_hz)
        count = kaiserord(_ATTENUATION, 2 * (stop - highest_hz) / rate_hz)[0] | 1
        middle = 0.5 * (stop + highest_hz)
        taps = firwin(count, middle, window=("kaiser", kaiser_beta(_ATTENUATION)), fs=rate_hz)
        first, last = ringing + count // 2, samples - count // 2
        return cls(slice(first, last, factor), factor / rate_hz, first / rate_hz, np.asarray(taps))

    @property
    def samples(self) -> int:
        return len(range(self.kept.start, self.kept.stop, self.kept.step))

    def cut(self, acceleration: Floats) -> Floats:
        """(..., samples) of (..., n). The filter is even: it delays nothing, and leaves modes below as they are."""
        from scipy.signal import fftconvolve

        if self.taps is not None:
            taps = self.taps.reshape((1,) * (acceleration.ndim - 1) + (-1,))
            acceleration = np.asarray(fftconvolve(acceleration, taps, mode="same", axes=-1))
        return acceleration[..., self.kept]


@dataclass(frozen=True, eq=False)
class Spectra:
    """How accelerations (..., n) are read: at `lines_hz` (f,), and in `windows`, in samples, for the level at rest."""

    lines_hz: Floats
    rate_hz: float
    windows: tuple[tuple[int, int], ...]

    @classmethod
    def of(cls, plate: ModalPlate, signals: PlateSignals) -> Spectra:
        samples, ringing, rate_hz = signals.samples, signals.ringing, signals.rate_hz
        modes = plate.frequency_hz[plate.frequency_hz > 0]
        low = max(_BELOW * float(modes.min()), _CYCLES * rate_hz / samples)
        high = min(_ABOVE * float(modes.max()), _RATE * rate_hz)
        count = int(PER_OCTAVE * np.log2(high / low)) + 1 if low < high else 0
        periods = (samples - ringing) / rate_hz * float(modes.min())
        parts = _HALVES if periods >= 2 * _PERIODS else _WHOLE if periods >= _PERIODS else ()
        ends = [[ringing + round(share * (samples - ringing)) for share in part] for part in parts]
        return cls(low * 2 ** (np.arange(count) / PER_OCTAVE), rate_hz, tuple((begin, end) for begin, end in ends))

    def levels_db(self, acceleration: Floats) -> Floats:
        """(..., f): maximax in dB over 1 m/s2, NaN for records that are not numbers or silent."""
        flat = acceleration.reshape(-1, acceleration.shape[-1])
        levels = np.full((len(flat), self.lines_hz.size), np.nan)
        good = np.isfinite(flat).all(axis=1) & (np.ptp(flat, axis=1) > 0)
        if good.any() and self.lines_hz.size:
            spectrum = shock_response_spectrum(flat[good], self.rate_hz, self.lines_hz, q=Q, threads=2)
            levels[good] = 20 * np.log10(spectrum.maximax)
        return levels.reshape(*acceleration.shape[:-1], -1)

    def rests(self, acceleration: Floats) -> Floats:
        """(..., windows): the level under the ringing over the largest acceleration.

        Blackman's window lets modes of five periods in it through by less than 1e-4.
        """
        size = np.abs(acceleration).max(axis=-1)
        rests = np.zeros((*acceleration.shape[:-1], len(self.windows)))
        for i, (begin, end) in enumerate(self.windows):
            weights = np.blackman(end - begin)
            rests[..., i] = acceleration[..., begin:end] @ (weights / weights.sum()) / np.where(size > 0, size, np.nan)
        return rests
