"""The converter: whole counts, no further than its range."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .build import SensorBuild


def counts(written: NDArray[Any], sensor: SensorBuild) -> NDArray[np.int32]:
    """Nearest counts of `written` (n,) in volts or the sensor's unit, in two's complement: -2^(bits-1) to one less
    than its opposite. Raises `ValueError` for NaN: no converter has a code for it."""
    values = np.asarray(written, dtype=np.float64) / sensor.step
    if np.isnan(values).any():
        raise ValueError(f"sensor {sensor.name!r}: sample {int(np.argmax(np.isnan(values)))} is NaN")
    top = 2.0 ** (sensor.bits - 1)
    return np.clip(np.rint(values), -top, top - 1).astype(np.int32)


def converted(written: NDArray[Any], sensor: SensorBuild) -> NDArray[np.float32]:
    """What the recorder writes (n,): `counts` times the step. Zero has no sign, since counts have none."""
    return (counts(written, sensor) * sensor.step).astype(np.float32)


def written(values_si: Floats, sensor: SensorBuild) -> Floats:
    """SI to what is written: the unit, and the volts of the nominal calibration."""
    in_unit = values_si / sensor.si_per_unit
    return in_unit if sensor.sensitivity is None else in_unit * sensor.sensitivity + sensor.offset_v


def calibrated(written_values: NDArray[Any], sensor: SensorBuild) -> Floats:
    """The inverse of `written`, as the lab applies it."""
    values = np.asarray(written_values, dtype=np.float64)
    if sensor.sensitivity is not None:
        values = (values - sensor.offset_v) / sensor.sensitivity
    return values * sensor.si_per_unit
