"""Band limits: a conditioner's low-pass, and the recorder's anti-alias filter with its decimation.

The recorder is taken for one with sigma-delta converters, whose decimation filter is a long
symmetric FIR: no distortion of phase, so a pulse keeps its shape and its time. Before a sharp edge
it rings, as the real ones do.

An accelerometer on its mounting: a mass on a spring that the structure shakes.

Errors of gain and zero: of the calibration, after a shock, and over the day.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np
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
    from scipy.signal import upfirdn

    taps = anti_alias_taps(ratio)
    reach = taps.size // 2
    padded = np.pad(values, reach, mode="edge")
    kept = -(-values.size // ratio)
    first = 2 * (reach // ratio)
    return np.asarray(upfirdn(taps, padded, down=ratio)[first : first + kept], dtype=np.float64)


def low_passed(values: Floats, period_s: float, corner_hz: float) -> Floats:
    """Butterworth's low pass of four poles, as the filters of signal conditioners have, from rest
    at the first value.

    S. Butterworth, Experimental Wireless 7 (1930) 536; -3 dB at the corner, 24 dB per octave
    beyond. By the bilinear transform with the corner in place. A corner beyond 0.45 of the grid's
    rate leaves the values alone.
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
    from scipy.signal import cont2discrete, lfilter, lfilter_zi

    omega = 2 * np.pi * resonance_hz
    top = np.array([2 * damping * omega, omega**2])
    bottom = np.array([1.0, 2 * damping * omega, omega**2])
    b, a, _ = cont2discrete((top, bottom), period_s, method="foh")
    b = np.atleast_1d(np.squeeze(b))
    felt, _ = lfilter(b, a, acceleration, zi=lfilter_zi(b, a) * acceleration[0])
    return np.asarray(felt, dtype=np.float64)


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
    # the logarithm of a decaying peak hold is a running maximum of ln|x| + t / decay
    time = np.arange(signal.size) * (period_s / decay_s)
    with np.errstate(divide="ignore"):
        load = np.log(np.abs(signal)) + time
    return np.asarray(share * np.exp(np.maximum.accumulate(load) - time), dtype=np.float64)
