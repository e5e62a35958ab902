"""Band limits: a conditioner's low-pass, and the recorder's anti-alias filter with its decimation.

The recorder is taken for one with sigma-delta converters, whose decimation filter is a long
symmetric FIR: no distortion of phase, so a pulse keeps its shape and its time. Before a sharp edge
it rings, as the real ones do.

An accelerometer on its mounting: a mass on a spring that the structure shakes.

Errors of gain and zero: of the calibration, after a shock, and over the day.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache, lru_cache

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ...array_types import Floats
from .build import SensorBuild

#: Pass and stop band in sampling rates: flat to 39 kHz at 100 kHz (thesis, section 2.2.2), and
#: nothing that could fold.
PASS, STOP = 0.39, 0.5
#: Attenuation of the stop band, as data sheets of 24-bit recorders state it.
STOP_DB = 100.0
#: Of a conditioner's low pass.
POLES = 4


@cache
def anti_alias_taps(ratio: int) -> Floats:
    """Symmetric FIR (2 * ratio * h + 1,) of unit gain for a signal sampled `ratio` times faster
    than the recorder.

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
    """Every `ratio`-th of the band-limited `values` (n,), from the first on; before and after it
    stays at its ends.

    Ratio 1 returns the values: what is simulated at the recorder's own rate must be band-limited
    already.
    """
    if ratio == 1:
        return values
    taps = anti_alias_taps(ratio)
    padded = np.pad(values, taps.size // 2, mode="edge")
    return _every(ratio, np.ascontiguousarray(padded, dtype=np.float64), taps)


@njit(cache=True, fastmath={"reassoc"})  # the sum in the order that the processor likes
def _every(ratio: int, padded: Floats, taps: Floats) -> Floats:
    """Every `ratio`-th sum of the symmetric `taps` (k,) over `padded` (n + k - 1,)."""
    out = np.empty((padded.size - taps.size) // ratio + 1)
    for i in range(out.size):
        window = padded[i * ratio : i * ratio + taps.size]
        total = 0.0
        for j in range(taps.size):
            total += taps[j] * window[j]
        out[i] = total
    return out


def low_passed(values: Floats, period_s: float, corner_hz: float) -> Floats:
    """Butterworth's low pass of four poles, as the filters of signal conditioners have, from rest
    at the first value.

    S. Butterworth, Experimental Wireless 7 (1930) 536; -3 dB at the corner, 24 dB per octave
    beyond. By the bilinear transform with the corner in place. A corner beyond 0.45 of the grid's
    rate leaves the values alone.
    """
    if corner_hz * period_s > 0.45:
        return values
    from scipy.signal import sosfilt

    sections, at_rest = _low_pass_sections(corner_hz * period_s)
    filtered, _ = sosfilt(sections, values, zi=at_rest * values[0])
    return np.asarray(filtered, dtype=np.float64)


@lru_cache(maxsize=64)
def _low_pass_sections(corner: float) -> tuple[Floats, Floats]:
    """The sections (n, 6) of `low_passed` for a corner over the grid's rate, and their state (n, 2)
    under a constant 1."""
    from scipy.signal import butter, sosfilt_zi

    sections = butter(POLES, 2 * corner, output="sos")
    return sections, sosfilt_zi(sections)


def low_pass_decay_1_s(corner_hz: float) -> float:
    """At what rate (1/s) the slowest poles of `low_passed` die out."""
    return float(2 * np.pi * corner_hz * np.sin(np.pi / (2 * POLES)))


def resonance_hz(sensor: SensorBuild, effects: Mapping[str, float]) -> float | None:
    """Where a sensor's mounting resonates: its own resonance over the effect's strength; None for a
    rigid one."""
    strength = effects["sensor.mount_resonance"]
    if sensor.quantity != "acceleration" or sensor.mount_resonance_hz is None or not strength:
        return None
    return sensor.mount_resonance_hz / strength


def transmissibility(
    roots: NDArray[np.complex128], sensor: SensorBuild, effects: Mapping[str, float]
) -> NDArray[np.complex128]:
    """What the sensor feels of accelerations exp(s t) of its base, by complex frequency s (m,) in
    1/s."""
    resonance = resonance_hz(sensor, effects)
    if resonance is None:
        return np.ones_like(roots)
    omega = 2 * np.pi * resonance
    follows = 2 * sensor.mount_damping * omega * roots + omega**2
    return np.asarray(follows / (roots**2 + follows))


def mounted(acceleration: Floats, period_s: float, resonance_hz: float, damping: float) -> Floats:
    """What the sensor feels (n,), same unit: (2 z w s + w^2) / (s^2 + 2 z w s + w^2), the
    transmissibility of a base.

    Exact for an acceleration that is linear between samples (first-order hold, the ramp invariance
    of Smallwood 1981), from rest at the first value. A resonance beyond 0.4 of the grid's rate is
    taken for a rigid mounting.
    """
    if resonance_hz * period_s > 0.4:
        return acceleration
    from scipy.signal import lfilter

    b, a, at_rest = _mounting(period_s, resonance_hz, damping)
    felt, _ = lfilter(b, a, acceleration, zi=at_rest * acceleration[0])
    return np.asarray(felt, dtype=np.float64)


@lru_cache(maxsize=64)
def _mounting(
    period_s: float, resonance_hz: float, damping: float
) -> tuple[Floats, Floats, Floats]:
    """Numerator and denominator of `mounted`, and its state under a constant 1."""
    from scipy.signal import cont2discrete, lfilter_zi

    omega = 2 * np.pi * resonance_hz
    top = np.array([2 * damping * omega, omega**2])
    bottom = np.array([1.0, 2 * damping * omega, omega**2])
    b, a, _ = cont2discrete((top, bottom), period_s, method="foh")
    b = np.atleast_1d(np.squeeze(b))
    return b, a, lfilter_zi(b, a)


_GAIN_EFFECT = {
    "force": "sensor.force_gain",
    "acceleration": "sensor.acceleration_gain",
    "pressure": "sensor.pressure_gain",
}


def gain(sensor: SensorBuild, effects: Mapping[str, float], day_fraction: float) -> float:
    """True sensitivity over the one in the lab's list: calibration, and drift since the morning
    (day_fraction 0)."""
    name = _GAIN_EFFECT.get(sensor.quantity)
    calibration = effects[name] * sensor.gain_fault if name else 0.0
    return (1 + calibration) * (1 + effects["bench.drift"] * sensor.gain_drift * day_fraction)


def offset_si(sensor: SensorBuild, effects: Mapping[str, float], day_fraction: float) -> float:
    """Zero error (SI): of the pressure transducer, and what every zero drifts by over the day."""
    fault = (
        effects["sensor.pressure_offset"] * sensor.offset_fault
        if sensor.quantity == "pressure"
        else 0.0
    )
    return (
        fault + effects["bench.drift"] * sensor.offset_drift * day_fraction
    ) * sensor.si_per_unit


def zero_shift(signal: Floats, period_s: float, share: float, decay_s: float) -> Floats:
    """Offset (n,) of a piezoelectric gauge that is shocked by `signal` (n,), in its unit.

    Domains of the ceramic switch under stress and leave a charge that the amplifier lets go of
    slowly (Chu, Shock and Vibration Bulletin 57, 1987): `share` of the largest load so far, each
    load forgotten as exp(-t / decay_s). A load below what is left of a larger one adds nothing.
    """
    return share * _held(
        np.ascontiguousarray(signal), np.exp(-period_s / decay_s * np.arange(signal.size))
    )


@njit(cache=True)
def _held(signal: Floats, forgotten: Floats) -> Floats:
    """The largest load so far (n,), each load forgotten as `forgotten` (n,) says."""
    out = np.empty(signal.size)
    peak, at = 0.0, 0
    for i in range(signal.size):
        hold, load = peak * forgotten[i - at], abs(signal[i])
        if load >= hold:
            peak, at, hold = load, i, load
        out[i] = hold
    return out
