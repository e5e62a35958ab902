"""The whole chain: mounting, electronics, anti-alias filter, faults, noise, converter.

The converter: whole counts, no further than its range.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .build import SensorBuild
from .filters import decimated, gain, low_passed, mounted, offset_si, resonance_hz, zero_shift


def counts(written: NDArray[Any], sensor: SensorBuild) -> NDArray[np.int32]:
    """Nearest counts `(n,)` of a converter, in two's complement: -2^(bits-1) to one less than its
    opposite.

    Parameters:
        written: Values in volts or the sensor's unit, of shape `(n,)`.
        sensor: The measuring chain, with the converter.

    Raises:
        ValueError: For NaN: no converter has a code for it.
    """
    values = np.asarray(written, dtype=np.float64) / sensor.step
    if np.isnan(values).any():
        raise ValueError(
            f"sensor {sensor.name!r}: sample {int(np.argmax(np.isnan(values)))} is NaN"
        )
    top = 2.0 ** (sensor.bits - 1)
    np.rint(values, out=values)
    return np.clip(values, -top, top - 1, out=values).astype(np.int32)


def converted(written: NDArray[Any], sensor: SensorBuild) -> NDArray[np.float32]:
    """What the recorder writes `(n,)`: `counts` times the step. Zero has no sign, since counts have
    none.

    Parameters:
        written: Values in volts or the sensor's unit, of shape `(n,)`.
        sensor: The measuring chain, with the converter.

    Raises:
        ValueError: As `counts` raises it.
    """
    return (counts(written, sensor) * sensor.step).astype(np.float32)


def written(values_si: Floats, sensor: SensorBuild) -> Floats:
    """SI to what is written, by the nominal calibration.

    Parameters:
        values_si: Values in the SI unit of the sensor's quantity, of any shape.
        sensor: The measuring chain.

    Returns:
        Volts where the sensor has a sensitivity, else values in its unit; of the same shape.
    """
    in_unit = values_si / sensor.si_per_unit
    return in_unit if sensor.sensitivity is None else in_unit * sensor.sensitivity + sensor.offset_v


def calibrated(written_values: NDArray[Any], sensor: SensorBuild) -> Floats:
    """The inverse of `written`, as the lab applies it.

    Parameters:
        written_values: Values in volts or the sensor's unit, of any shape.
        sensor: The measuring chain.
    """
    values = np.asarray(written_values, dtype=np.float64)
    if sensor.sensitivity is not None:
        values = (values - sensor.offset_v) / sensor.sensitivity
    return values * sensor.si_per_unit


def record(
    signal_time_s: NDArray[Any],
    signal_si: NDArray[Any],
    sensor: SensorBuild,
    sampling_rate_hz: float,
    effects: Mapping[str, float],
    rng: np.random.Generator,
    *,
    day_fraction: float = 0.0,
) -> NDArray[np.float32]:
    """What the recorder writes of a signal: samples `(m,)` from the first time on, in volts where
    the sensor has a sensitivity, else in its unit.

    Between its samples the signal is linear, before and after them it stays at its ends.

    Parameters:
        signal_time_s: Even times, of shape `(n,)`.
        signal_si: The signal at these times in SI, of shape `(n,)`.
        sensor: The measuring chain.
        sampling_rate_hz: The rate of the recorder, at most that of the signal.
        effects: The strength of each effect, by its name.
        rng: Generator of random numbers, for the noise.
        day_fraction: When in its day the recording is made, for the drift: from 0 in the morning,
            which is the default, to 1 in the evening.

    Raises:
        ValueError: For uneven times, NaN, and a signal that is coarser than the recorder.
    """
    band_limited = analog(signal_time_s, signal_si, sensor, sampling_rate_hz, effects)
    return digitised(
        band_limited, sensor, sampling_rate_hz, effects, rng, day_fraction=day_fraction
    )


def analog(
    signal_time_s: NDArray[Any],
    signal_si: NDArray[Any],
    sensor: SensorBuild,
    sampling_rate_hz: float,
    effects: Mapping[str, float],
) -> Floats:
    """The linear half of `record`, SI `(m,)`: so windows of a long recording can be filtered alone
    and added up.

    Parameters:
        signal_time_s: Even times, of shape `(n,)`.
        signal_si: The signal at these times in SI, of shape `(n,)`.
        sensor: The measuring chain.
        sampling_rate_hz: The rate of the recorder, at most that of the signal.
        effects: The strength of each effect, by its name.

    Raises:
        ValueError: For uneven times, and a signal that is coarser than the recorder.
    """
    values, period, ratio = _on_multiple(signal_time_s, signal_si, sampling_rate_hz)
    resonance = resonance_hz(sensor, effects)
    if resonance is not None:
        values = mounted(values, period, resonance, sensor.mount_damping)
    corner = corner_hz(sensor, effects)
    if corner is not None:
        values = low_passed(values, period, corner)
    return decimated(values, ratio)


def digitised(
    band_limited_si: Floats,
    sensor: SensorBuild,
    sampling_rate_hz: float,
    effects: Mapping[str, float],
    rng: np.random.Generator,
    *,
    day_fraction: float = 0.0,
) -> NDArray[np.float32]:
    """The other half of `record`, on a whole recording: faults, noise, conversion.

    Parameters:
        band_limited_si: The recording in SI at the recorder's rate, of shape `(n,)`, as `analog`
            gives it.
        sensor: The measuring chain.
        sampling_rate_hz: The rate of the recorder.
        effects: The strength of each effect, by its name.
        rng: Generator of random numbers, for the noise.
        day_fraction: When in its day the recording is made, for the drift: from 0 in the morning,
            which is the default, to 1 in the evening.

    Returns:
        What the recorder writes, of shape `(n,)`, in volts where the sensor has a sensitivity, else
        in its unit.

    Raises:
        ValueError: For NaN.
    """
    values = np.asarray(band_limited_si, dtype=np.float64) * gain(sensor, effects, day_fraction)
    share = effects["sensor.zero_shift"] * sensor.zero_shift_fault
    if sensor.quantity == "acceleration" and share:
        values += zero_shift(values, 1 / sampling_rate_hz, share, sensor.zero_shift_decay_s)
    values += offset_si(sensor, effects, day_fraction)
    noise = effects["bench.noise"] * sensor.noise * sensor.si_per_unit
    if noise:
        values += noise * rng.standard_normal(values.size)
    return converted(written(values, sensor), sensor)


def corner_hz(sensor: SensorBuild, effects: Mapping[str, float]) -> float | None:
    """The corner (Hz) of the low-pass of the electronics, None without one; that of a force channel
    is an effect.

    Parameters:
        sensor: The measuring chain.
        effects: The strength of each effect, by its name.
    """
    if sensor.quantity != "force" or sensor.bandwidth_hz is None:
        return sensor.bandwidth_hz
    strength = effects["sensor.force_bandwidth"]
    return sensor.bandwidth_hz / strength if strength else None


def _on_multiple(
    time_s: NDArray[Any], signal: NDArray[Any], rate_hz: float
) -> tuple[Floats, float, int]:
    """The signal on a grid that is a whole multiple of the recorder's, the grid's period, and the
    multiple."""
    time, values = np.asarray(time_s, dtype=np.float64), np.asarray(signal, dtype=np.float64)
    if time.shape != values.shape or time.ndim != 1 or time.size < 2:
        raise ValueError(
            f"signal {values.shape} on times {time.shape}: expected two of one length, at least 2"
        )
    period = float(time[-1] - time[0]) / (time.size - 1)
    if not period > 0 or np.abs(np.diff(time) - period).max() > 1e-3 * period:
        raise ValueError(f"times from {time[0]:g} to {time[-1]:g} s: expected an even, rising grid")
    exact = 1 / (period * rate_hz)
    ratio = max(1, int(np.ceil(exact - 1e-9)))
    if exact < 1 - 1e-9:
        raise ValueError(
            f"signal at {1 / period:g} Hz: expected at least the recorder's {rate_hz:g} Hz"
        )
    if abs(exact - ratio) < 1e-9 * ratio:
        return values, period, ratio
    finer = 1 / (rate_hz * ratio)
    grid = time[0] + finer * np.arange(int((time[-1] - time[0]) / finer * (1 + 1e-12)) + 1)
    return np.interp(grid, time, values), finer, ratio
