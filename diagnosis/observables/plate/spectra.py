"""What is read from an acceleration alone, measured or simulated: spectrum lines and what it rests at afterwards."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....twin.plate.modal import ModalPlate
from ....twin.srs.spectrum import shock_response_spectrum
from ...record import Floats

Q, PER_OCTAVE = 10.0, 3
#: Lines reach from below the lowest mode to below the highest: beyond, modes that are not listed would tell.
_BELOW, _ABOVE = 0.7, 0.75
#: Lines are below this share of the sampling rate, and have so many cycles in a record.
_RATE, _CYCLES = 0.1, 3.0
#: Periods of the lowest mode that a window needs to see the level under the ringing; shares of the ringing it spans.
_PERIODS = 5.0
_HALVES, _WHOLE = ((0.0, 0.5), (0.5, 1.0)), ((0.0, 1.0),)


@dataclass(frozen=True, eq=False)
class Spectra:
    """How accelerations (..., n) are read: at `lines_hz` (f,), and in `windows`, in samples, for the level at rest."""

    lines_hz: Floats
    rate_hz: float
    windows: tuple[tuple[int, int], ...]

    @classmethod
    def of(cls, plate: ModalPlate, rate_hz: float, samples: int, ringing: int) -> Spectra:
        """For records of so many samples of a plate that rings freely from sample `ringing` on."""
        modes = plate.frequency_hz[plate.frequency_hz > 0]
        low = max(_BELOW * float(modes.min()), _CYCLES * rate_hz / samples)
        high = min(_ABOVE * float(modes.max()), _RATE * rate_hz)
        count = int(PER_OCTAVE * np.log2(high / low)) + 1 if low < high else 0
        lines = low * 2 ** (np.arange(count) / PER_OCTAVE)
        periods = (samples - ringing) / rate_hz * float(modes.min())
        parts = _HALVES if periods >= 2 * _PERIODS else _WHOLE if periods >= _PERIODS else ()
        at = [tuple(ringing + round(share * (samples - ringing)) for share in part) for part in parts]
        return cls(lines, rate_hz, tuple((first, last) for first, last in at))

    def levels_db(self, acceleration: Floats) -> Floats:
        """(..., f): maximax in dB over 1 m/s2, NaN for records that are not numbers or silent."""
        flat = acceleration.reshape(-1, acceleration.shape[-1])
        out = np.full((len(flat), self.lines_hz.size), np.nan)
        good = np.isfinite(flat).all(axis=1) & (np.ptp(flat, axis=1) > 0)
        if good.any() and self.lines_hz.size:
            found = shock_response_spectrum(flat[good], self.rate_hz, self.lines_hz, q=Q, threads=2)
            out[good] = 20 * np.log10(found.maximax)
        return out.reshape(*acceleration.shape[:-1], -1)

    def rests(self, acceleration: Floats) -> Floats:
        """(..., windows): the level under the ringing over the largest acceleration.

        Blackman's window lets modes of five periods in it through by less than 1e-4.
        """
        size = np.abs(acceleration).max(axis=-1)
        out = [acceleration[..., a:b] @ _weights(b - a) / np.where(size > 0, size, np.nan) for a, b in self.windows]
        return np.stack(out, axis=-1) if out else np.zeros((*acceleration.shape[:-1], 0))


def _weights(samples: int) -> Floats:
    window = np.blackman(samples)
    return np.asarray(window / window.sum())
