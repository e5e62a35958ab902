"""Errors of gain and zero: of the calibration, after a shock, and over the day."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...array_types import Floats
from .build import SensorBuild

_GAIN_EFFECT = {
    "force": "sensor.force_gain",
    "acceleration": "sensor.acceleration_gain",
    "pressure": "sensor.pressure_gain",
}


def gain(sensor: SensorBuild, effects: Mapping[str, float], day_fraction: float) -> float:
    """True sensitivity over the one in the lab's list: calibration, and drift since the morning (day_fraction 0)."""
    name = _GAIN_EFFECT.get(sensor.quantity)
    calibration = effects[name] * sensor.gain_fault if name else 0.0
    return (1 + calibration) * (1 + effects["bench.drift"] * sensor.gain_drift * day_fraction)


def offset_si(sensor: SensorBuild, effects: Mapping[str, float], day_fraction: float) -> float:
    """Zero error (SI): of the pressure transducer, and what every zero drifts by over the day."""
    fault = effects["sensor.pressure_offset"] * sensor.offset_fault if sensor.quantity == "pressure" else 0.0
    return (fault + effects["bench.drift"] * sensor.offset_drift * day_fraction) * sensor.si_per_unit


def zero_shift(felt: Floats, period_s: float, share: float, decay_s: float) -> Floats:
    """Offset (n,) of a piezoelectric gauge that is shocked by `felt` (n,), in its unit.

    Domains of the ceramic switch under stress and leave a charge that the amplifier lets go of slowly (Chu,
    Shock and Vibration Bulletin 57, 1987): `share` of the largest load so far, each load forgotten as
    exp(-t / decay_s). A load below what is left of a larger one adds nothing.
    """
    # the logarithm of a decaying peak hold is a running maximum of ln|x| + t / decay
    time = np.arange(felt.size) * (period_s / decay_s)
    with np.errstate(divide="ignore"):
        load = np.log(np.abs(felt)) + time
    return np.asarray(share * np.exp(np.maximum.accumulate(load) - time), dtype=np.float64)
