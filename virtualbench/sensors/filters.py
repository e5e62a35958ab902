"""Band limits: a conditioner's low-pass, and the recorder's anti-alias filter with its decimation.

The recorder is taken for one with sigma-delta converters, whose decimation filter is a long symmetric FIR: no
distortion of phase, so a pulse keeps its shape and its time. Before a sharp edge it rings, as the real ones do.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from ...array_types import Floats

#: Pass and stop band in sampling rates: flat to 39 kHz at 100 kHz (thesis, section 2.2.2), and nothing that could fold.
PASS, STOP = 0.39, 0.5
#: Attenuation of the stop band, as data sheets of 24-bit recorders state it.
STOP_DB = 100.0
#: Of a conditioner's low pass.
POLES = 4


@cache
def anti_alias_taps(ratio: int) -> Floats:
    """Symmetric FIR (2 * ratio * h + 1,) of unit gain for a signal sampled `ratio` times faster than the recorder.

    Sinc under a Kaiser window (Kaiser 1974); -6 dB midway between pass and stop band.
    """
    from scipy.signal import firwin, kaiser_beta

    half = anti_alias_reach() * ratio
    taps = firwin(2 * half + 1, (PASS + STOP) / ratio, window=("kaiser", kaiser_beta(STOP_DB)))
    return np.asarray(taps, dtype=np.float64)


def anti_alias_reach() -> int:
    """Samples of the recorder over which the filter sees ahead and back."""
    width = 2 * np.pi * (STOP - PASS)
    return int(np.ceil((STOP_DB - 7.95) / 2.285 / width / 2))  # Kaiser's estimate of the length


def decimated(values: Floats, ratio: int) -> Floats:
    """Every `ratio`-th of the band-limited `values` (n,), from the first on; before and after it stays at its ends.

    Ratio 1 returns the values: what is simulated at the recorder's own rate must be band-limited already.
    """
    if ratio == 1:
        return values
    from scipy.signal import upfirdn

    taps = anti_alias_taps(ratio)
    reach = taps.size // 2
    padded = np.pad(values, reach, mode="edge")
    kept = -(-values.size // ratio)
    first = 2 * (reach // ratio)
    return np.asarray(upfirdn(taps, padded, down=ratio)[first : first + kept], dtype=np.float64)


def low_passed(values: Floats, period_s: float, corner_hz: float) -> Floats:
    """Butterworth's low pass of four poles, as the filters of signal conditioners have, from rest at the first value.

    S. Butterworth, Experimental Wireless 7 (1930) 536; -3 dB at the corner, 24 dB per octave beyond. By the bilinear
    transform with the corner in place. A corner beyond 0.45 of the grid's rate leaves the values alone.
    """
    if corner_hz * period_s > 0.45:
        return values
    from scipy.signal import butter, sosfilt, sosfilt_zi

    sections = butter(POLES, 2 * corner_hz * period_s, output="sos")
    filtered, _ = sosfilt(sections, values, zi=sosfilt_zi(sections) * values[0])
    return np.asarray(filtered, dtype=np.float64)


def low_pass_decay_1_s(corner_hz: float) -> float:
    """At what rate (1/s) the slowest poles of `low_passed` die out."""
    return float(2 * np.pi * corner_hz * np.sin(np.pi / (2 * POLES)))
