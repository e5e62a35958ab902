"""The second laws of the sensors: what they read of what is there.

`table.LAWS` names each law's source; here it stands as an equation. Strengths have the unit of the
first laws: bar, a share of the reading, or the electronics' 25 kHz and the mounting's 45 kHz over
the corner.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...array_types import Floats
from .owners import bullet_share, tip_value
from .table import checked_split

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
#: An accelerometer's sensitivity is right here, and off by the stated share a decade above and
#: below.
REFERENCE_HZ = 1000.0
FULL_ACCELERATION_M_S2, SECOND_CHANNEL = 2000.0, 0.3
SOFT_MOUNT_DAMPING = 0.15
BLOCK_DAMPING, BLOCK_RATIO = 0.05, 2.2
FAST_SHARE, FAST_S, SLOW_S = 0.6, 0.015, 0.4
HIGH_PASS_S = 0.02
#: The gas behind a diaphragm has this volume over what the diaphragm takes of it in each bar, up to
#: its stop.
SHUT_IN_BAR, STOP_BAR = 5.0, 4.0
#: Linear drag takes this share of the full speed, times the strength, at all velocities but the
#: lowest.
DRAG_SHARE, SLOWEST_SHARE = 0.5, 0.1
#: A force channel is off by the stated share at this duration of the pulse, and by so much of it
#: more in each decade.
REFERENCE_PULSE_S, PER_DECADE, LEAST_GAIN_SHARE = 1e-3, 0.6, 0.1
RUNNING_MEANS = 3
#: Length of each of three running means over the period of their common corner: (sin x / x)^3 =
#: sqrt(1/2), x = pi f T.
MEAN_OVER_PERIOD = 0.2618
#: Below it the relaxed sensitivity.
RELAXATION_HZ = 2000.0
#: A dry joint: at this peak its resonance has lost half of what it can lose.
JOINT_DAMPING, JOINT_SOFTENING, JOINT_LEVEL_M_S2 = 0.05, 0.4, 1000.0
CREEP_S, CREEP_EXPONENT = 5e-3, 0.5


def pressure_bar(read_bar: float, strengths: Mapping[str, float], split: str) -> float:
    """The pressure that is there when the transducer reads this (bar gauge), 0 or more.

    Development: r - s (1 - r / 4) and r / (1 + s r / 4); sealed: r - s exp(-r / 0.6) and r / (1 + s
    g), g from 0.2 to 1 about 1 bar; calibration: r - s / (1 - r / 5) and r / (1 + s (r / 4)^2).

    Raises `ValueError` for a split without laws.
    """
    return max(0.0, float(_true_pressure_bar(np.array([read_bar]), strengths, split)[0]))


def pressure_read_bar(true_bar: Floats, strengths: Mapping[str, float], split: str) -> Floats:
    """What the transducer reads (n,) of pressures from -1 to 16 bar gauge: the inverse of
    `pressure_bar`, or offset and gain, r = p (1 + g) + s, where `split` is empty."""
    if not split:
        gain, offset = (
            strengths.get("sensor.pressure_gain", 0.0),
            strengths.get("sensor.pressure_offset", 0.0),
        )
        return np.asarray(true_bar * (1 + gain) + offset)
    table = _true_pressure_bar(_READINGS_BAR, strengths, split)
    # A law of a small reading turns back at a large one, which no transducer gives.
    falls = np.flatnonzero(np.diff(table) <= 0)
    rising = slice(0, int(falls[0]) + 1 if falls.size else table.size)
    return np.asarray(np.interp(true_bar, table[rising], _READINGS_BAR[rising]))


def _true_pressure_bar(read_bar: Floats, strengths: Mapping[str, float], split: str) -> Floats:
    offset, gain = (
        strengths.get("sensor.pressure_offset", 0.0),
        strengths.get("sensor.pressure_gain", 0.0),
    )
    if checked_split(split) == "calibration":
        true = read_bar - offset / (1 - np.minimum(read_bar, STOP_BAR) / SHUT_IN_BAR)
        return np.asarray(true / (1 + gain * (read_bar / SPAN_BAR) ** 2))
    if split == "development":
        true = read_bar - offset * (1 - read_bar / SPAN_BAR)
        return np.asarray(true / (1 + gain * read_bar / SPAN_BAR))
    true = read_bar - offset * np.exp(-np.maximum(read_bar, 0.0) / FOOT_BAR)
    upper = 1 / (1 + np.exp(-(read_bar - RANGE_BAR) / RANGE_WIDTH))
    return np.asarray(true / (1 + gain * (LOW_RANGE + (1 - LOW_RANGE) * upper)))


def velocity_factor(
    velocities_m_s: Floats,
    masses_kg: Floats,
    tips: list[str],
    strength: float,
    split: str,
    *,
    hand: bool,
) -> Floats:
    """Reading over true velocity (n,) at true velocities (n,).

    Development: 1 + s v / v_full; sealed: 1 + s k, k of the bullet, or of the tip in a hand;
    calibration: 1 + s v_full / 2 v. Raises `ValueError` for a split without laws.
    """
    full = FULL_SPEED_M_S["hand" if hand else "gun"]
    if checked_split(split) == "development":
        return np.asarray(1 + strength * velocities_m_s / full)
    if split == "calibration":
        return np.asarray(
            1 + strength * DRAG_SHARE * full / np.maximum(velocities_m_s, SLOWEST_SHARE * full)
        )
    own = (
        [tip_value(TIP_BASE, tip) for tip in tips]
        if hand
        else [bullet_share(float(m)) for m in masses_kg]
    )
    return np.asarray(1 + strength * np.array(own))


def force_read(
    force_n: Floats, step_s: float, strengths: Mapping[str, float], split: str, corner_hz: float
) -> Floats:
    """What the cell shows (n,) of a force on even steps, with the corner that strength 1 means.

    Development: F (1 + s F / 8 kN), then Bessel's four poles; sealed: F (1 + s g), g from 0.2 to 1
    by the pulse's range of 2 kN, then three equal poles; calibration: F (1 + s (1 + 0.6 lg(T / 1
    ms))), T the impulse over the peak, then three running means. Raises `ValueError` for a split
    without laws.
    """
    gain, low = (
        strengths.get("sensor.force_gain", 0.0),
        strengths.get("sensor.force_bandwidth", 0.0),
    )
    if checked_split(split) == "development":
        force = force_n * (1 + gain * force_n / FULL_FORCE_N)
    elif split == "calibration":
        force = force_n * (1 + gain * _duration_share(force_n, step_s)) if gain else force_n
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
    if split == "calibration":
        return _running_means(padded, step_s, corner)
    return (
        _bessel(padded, step_s, corner)
        if split == "development"
        else _equal_poles(padded, step_s, corner)
    )


def _duration_share(force_n: Floats, step_s: float) -> float:
    """The gain's error at a pulse's duration over that at 1 ms."""
    peak = float(np.max(force_n))
    if peak <= 0:
        return 1.0
    duration = max(float(np.sum(force_n)) * step_s / peak, step_s)
    return max(1 + PER_DECADE * float(np.log10(duration / REFERENCE_PULSE_S)), LEAST_GAIN_SHARE)


def _running_means(values: Floats, step_s: float, corner_hz: float) -> Floats:
    """Three running means in a row with -3 dB together at the corner, of values that are straight
    between samples."""
    span = MEAN_OVER_PERIOD / corner_hz / step_s
    place = np.arange(values.size, dtype=np.float64)
    for _ in range(RUNNING_MEANS):
        area = np.concatenate([[0.0], np.cumsum((values[1:] + values[:-1]) / 2)])
        values = (area - np.interp(place - span, place, area, left=0.0)) / span
    return np.asarray(values)


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
    acceleration: Floats,
    rate_hz: float,
    strengths: Mapping[str, float],
    split: str,
    mount_hz: float,
) -> Floats:
    """What the accelerometers show (S, n) of true accelerations, m/s^2; `mount_hz` is what strength
    1 means.

    Development: a mounting of 0.15 damping, a sensitivity 1 - s lg(f / 1 kHz), an offset of two
    decays from the peak on; sealed: two resonances in a row, 1 + s |a| / 2000 (0.3 s on the second
    channel), an offset behind a high pass; calibration: a mounting that softens with the peak, a +
    s times a low-passed a, an offset (1 + t / 5 ms)^(-1/2). Raises `ValueError` for a split without
    laws.
    """
    checked_split(split)
    mount, gain = (
        strengths.get("sensor.mount_resonance", 0.0),
        strengths.get("sensor.acceleration_gain", 0.0),
    )
    share = strengths.get("sensor.zero_shift", 0.0)
    first, middle = split == "development", split == "calibration"
    shown = acceleration
    if mount and middle:
        shown = _softened(shown, rate_hz, mount_hz / mount)
    elif mount and first:
        shown = _mounted(shown, rate_hz, mount_hz / mount, SOFT_MOUNT_DAMPING)
    elif mount:
        shown = _mounted(shown, rate_hz, mount_hz / mount, BLOCK_DAMPING)
        shown = _mounted(shown, rate_hz, BLOCK_RATIO * mount_hz / mount, BLOCK_DAMPING)
    if gain and middle:
        shown = _relaxed(shown, rate_hz, gain)
    elif gain and first:
        shown = _tilted(shown, rate_hz, gain)
    elif gain:
        channels = np.array([1.0, SECOND_CHANNEL])[: shown.shape[0], None]
        shown = shown * (1 + gain * channels * np.abs(shown) / FULL_ACCELERATION_M_S2)
    return shown + share * _zero_shift(shown, rate_hz, split) if share else shown


def _mounted(acceleration: Floats, rate_hz: float, resonance_hz: float, damping: float) -> Floats:
    from ..sensors.filters import mounted

    return np.array([mounted(row, 1 / rate_hz, resonance_hz, damping) for row in acceleration])


def _softened(acceleration: Floats, rate_hz: float, resonance_hz: float) -> Floats:
    """Each channel's mounting by its own peak: f (1 - 0.4 a / (a + 1000 m/s2))."""
    peaks = np.abs(acceleration).max(axis=1)
    resonances = resonance_hz * (1 - JOINT_SOFTENING * peaks / (peaks + JOINT_LEVEL_M_S2))
    rows = [
        _mounted(row[None], rate_hz, float(resonance), JOINT_DAMPING)[0]
        for row, resonance in zip(acceleration, resonances, strict=True)
    ]
    return np.array(rows)


def _relaxed(acceleration: Floats, rate_hz: float, share: float) -> Floats:
    """a + s a / (1 + i f / f_r), Debye's relaxation, in the time domain."""
    from scipy.signal import lfilter

    decay = np.exp(-2 * np.pi * RELAXATION_HZ / rate_hz)
    return np.asarray(
        acceleration + share * lfilter([1 - decay], [1.0, -decay], acceleration, axis=1)
    )


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
    elif split == "calibration":
        decay = (1 + late / CREEP_S) ** -CREEP_EXPONENT
    else:
        decay = (1 - late / HIGH_PASS_S) * np.exp(-late / HIGH_PASS_S)
    return np.asarray(np.abs(shown).max(axis=1, keepdims=True) * decay * (since >= 0))
