"""The second laws of the sensors: what they read of what is there.

`table.LAWS` names each law's source; here it stands as an equation. Strengths have the unit of the first laws: bar, a
share of the reading, or the electronics' 25 kHz and the mounting's 45 kHz over the corner.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...array_types import Floats
from .owners import bullet_share, tip_value

#: The transducer's range; where its foot ends; between its two ranges, and how softly it changes.
SPAN_BAR, FOOT_BAR, RANGE_BAR, RANGE_WIDTH = 4.0, 0.6, 1.0, 0.15
LOW_RANGE = 0.2
#: Readings at which the inverse of its law is worked out.
_READINGS_BAR = np.concatenate([np.arange(-1.5, 6.0, 2e-3), np.arange(6.0, 30.0, 0.02)])
#: A timer's error is the stated one at this velocity; by tip, where there is no bullet.
FULL_SPEED_M_S = {"gun": 20.0, "hand": 1.5}
TIP_BASE = {"aluminum": 1.4, "steel": 0.5, "delrin": 1.0, "polyurethane": 1.6, "PLA": 0.8}
#: The load cell: full scale of its linearity, and the change between ranges.
FULL_FORCE_N, RANGE_N = 8000.0, 2000.0
BESSEL_POLES, EQUAL_POLES = 4, 3
#: An accelerometer's sensitivity is right here, and off by the stated share a decade above and below.
REFERENCE_HZ = 1000.0
FULL_ACCELERATION_M_S2, SECOND_CHANNEL = 2000.0, 0.3
SOFT_MOUNT_DAMPING = 0.15
BLOCK_DAMPING, BLOCK_RATIO = 0.05, 2.2
FAST_SHARE, FAST_S, SLOW_S = 0.6, 0.015, 0.4
HIGH_PASS_S = 0.02


def pressure_bar(read_bar: float, strengths: Mapping[str, float], split: str) -> float:
    """The pressure that is there when the transducer reads this (bar gauge), 0 or more.

    Development: r - s (1 - r / 4) and r / (1 + s r / 4); sealed: r - s exp(-r / 0.6) and r / (1 + s g), g from 0.2
    to 1 about 1 bar.
    """
    return max(0.0, float(_true_pressure_bar(np.array([read_bar]), strengths, split)[0]))


def pressure_read_bar(true_bar: Floats, strengths: Mapping[str, float], split: str) -> Floats:
    """What the transducer reads (n,) of pressures from -1 to 16 bar gauge: the inverse of `pressure_bar`, or offset and
    gain, r = p (1 + g) + s, where `split` is empty."""
    if not split:
        gain, offset = strengths.get("sensor.pressure_gain", 0.0), strengths.get("sensor.pressure_offset", 0.0)
        return np.asarray(true_bar * (1 + gain) + offset)
    table = _true_pressure_bar(_READINGS_BAR, strengths, split)
    # A law of a small reading turns back at a large one, which no transducer gives.
    falls = np.flatnonzero(np.diff(table) <= 0)
    rising = slice(0, int(falls[0]) + 1 if falls.size else table.size)
    return np.asarray(np.interp(true_bar, table[rising], _READINGS_BAR[rising]))


def _true_pressure_bar(read_bar: Floats, strengths: Mapping[str, float], split: str) -> Floats:
    offset, gain = strengths.get("sensor.pressure_offset", 0.0), strengths.get("sensor.pressure_gain", 0.0)
    if split == "development":
        true = read_bar - offset * (1 - read_bar / SPAN_BAR)
        return np.asarray(true / (1 + gain * read_bar / SPAN_BAR))
    true = read_bar - offset * np.exp(-np.maximum(read_bar, 0.0) / FOOT_BAR)
    upper = 1 / (1 + np.exp(-(read_bar - RANGE_BAR) / RANGE_WIDTH))
    return np.asarray(true / (1 + gain * (LOW_RANGE + (1 - LOW_RANGE) * upper)))


def velocity_factor(
    velocities_m_s: Floats, masses_kg: Floats, tips: list[str], strength: float, split: str, *, hand: bool
) -> Floats:
    """Reading over true velocity (n,) at true velocities (n,).

    Development: 1 + s v / v_full; sealed: 1 + s k, k of the bullet, or of the tip in a hand.
    """
    if split == "development":
        return np.asarray(1 + strength * velocities_m_s / FULL_SPEED_M_S["hand" if hand else "gun"])
    own = [tip_value(TIP_BASE, tip) for tip in tips] if hand else [bullet_share(float(m)) for m in masses_kg]
    return np.asarray(1 + strength * np.array(own))


def force_read(force_n: Floats, step_s: float, strengths: Mapping[str, float], split: str, corner_hz: float) -> Floats:
    """What the cell shows (n,) of a force on even steps, with the corner that strength 1 means.

    Development: F (1 + s F / 8 kN), then Bessel's four poles; sealed: F (1 + s g), g from 0.2 to 1 by the pulse's range
    of 2 kN, then three equal poles.
    """
    gain, low = strengths.get("sensor.force_gain", 0.0), strengths.get("sensor.force_bandwidth", 0.0)
    if split == "development":
        force = force_n * (1 + gain * force_n / FULL_FORCE_N)
    else:
        upper = 1 / (1 + np.exp(-(float(np.max(force_n)) / RANGE_N - 1) / RANGE_WIDTH))
        force = force_n * (1 + gain * (LOW_RANGE + (1 - LOW_RANGE) * float(upper)))
    if not low:
        return np.asarray(force)
    corner = corner_hz / low
    if corner * step_s > 0.45:
        return np.asarray(force)
    room = np.zeros(int(2.0 / corner / step_s) + 1)
    padded = np.concatenate([[0.0], force, room])
    return _bessel(padded, step_s, corner) if split == "development" else _equal_poles(padded, step_s, corner)


def _bessel(values: Floats, step_s: float, corner_hz: float) -> Floats:
    from scipy.signal import bessel, sosfilt

    sections = bessel(BESSEL_POLES, 2 * corner_hz * step_s, norm="mag", output="sos")
    return np.asarray(sosfilt(sections, values))


def _equal_poles(values: Floats, step_s: float, corner_hz: float) -> Floats:
    """Three times tau y' + y = x with -3 dB together at the corner."""
    from scipy.signal import lfilter

    tau = np.sqrt(2 ** (1 / EQUAL_POLES) - 1) / (2 * np.pi * corner_hz)
    decay = np.exp(-step_s / tau)
    for _ in range(EQUAL_POLES):
        values = lfilter([1 - decay], [1.0, -decay], values)
    return np.asarray(values)


def accelerations_read(
    acceleration: Floats, rate_hz: float, strengths: Mapping[str, float], split: str, mount_hz: float
) -> Floats:
    """What the accelerometers show (S, n) of true accelerations, m/s^2; `mount_hz` is what strength 1 means.

    Development: a mounting of 0.15 damping, a sensitivity 1 - s lg(f / 1 kHz), an offset of two decays from the peak
    on; sealed: two resonances in a row, 1 + s |a| / 2000 (0.3 s on the second channel), an offset behind a high pass.
    """
    mount, gain = strengths.get("sensor.mount_resonance", 0.0), strengths.get("sensor.acceleration_gain", 0.0)
    share = strengths.get("sensor.zero_shift", 0.0)
    first = split == "development"
    shown = acceleration
    if mount and first:
        shown = _mounted(shown, rate_hz, mount_hz / mount, SOFT_MOUNT_DAMPING)
    elif mount:
        shown = _mounted(shown, rate_hz, mount_hz / mount, BLOCK_DAMPING)
        shown = _mounted(shown, rate_hz, BLOCK_RATIO * mount_hz / mount, BLOCK_DAMPING)
    if gain and first:
        shown = _tilted(shown, rate_hz, gain)
    elif gain:
        channels = np.array([1.0, SECOND_CHANNEL])[: shown.shape[0], None]
        shown = shown * (1 + gain * channels * np.abs(shown) / FULL_ACCELERATION_M_S2)
    return shown + share * _zero_shift(shown, rate_hz, split) if share else shown


def _mounted(acceleration: Floats, rate_hz: float, resonance_hz: float, damping: float) -> Floats:
    from ..sensors.filters import mounted

    return np.array([mounted(row, 1 / rate_hz, resonance_hz, damping) for row in acceleration])


def _tilted(acceleration: Floats, rate_hz: float, per_decade: float) -> Floats:
    """In the frequency domain, without change of phase; flat below 10 Hz."""
    count = acceleration.shape[1]
    frequency = np.maximum(np.fft.rfftfreq(count, 1 / rate_hz), 10.0)
    response = np.maximum(1 - per_decade * np.log10(frequency / REFERENCE_HZ), 0.1)
    return np.asarray(np.fft.irfft(np.fft.rfft(acceleration, axis=1) * response, count, axis=1))


def _zero_shift(shown: Floats, rate_hz: float, split: str) -> Floats:
    """Offset (S, n) over the share: the peak's size from the peak on, and how it decays."""
    at = np.argmax(np.abs(shown), axis=1)[:, None]
    since = (np.arange(shown.shape[1]) - at) / rate_hz
    late = np.maximum(since, 0.0)
    if split == "development":
        decay = FAST_SHARE * np.exp(-late / FAST_S) + (1 - FAST_SHARE) * np.exp(-late / SLOW_S)
    else:
        decay = (1 - late / HIGH_PASS_S) * np.exp(-late / HIGH_PASS_S)
    return np.asarray(np.abs(shown).max(axis=1, keepdims=True) * decay * (since >= 0))
