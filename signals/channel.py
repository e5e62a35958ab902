"""One channel of one recording: the samples as recorded, and how they become SI."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from .calibration import Calibration
from .placeholders import Placeholders, without_placeholders
from .units import SI_UNITS, to_si

Result = TypeVar("Result")
#: Quantities whose records may be pulses of one sample: light barriers and triggers.
MAY_STAND_ALONE = ("voltage", "displacement")
#: Positions of sensors on what the operator's arm or the gun moves on purpose: its velocity changes
#: for good.
IMPACTOR_POSITIONS = ("hammer", "impactor", "projectile", "bullet", "tip")


def on_impactor(position: str | None) -> bool:
    """Whether a sensor rides on what strikes.

    Parameters:
        position: Where the sensor is mounted, as campaign.toml states it; None where it states
            nothing.
    """
    return (position or "").strip().lower() in IMPACTOR_POSITIONS


@dataclass(frozen=True)
class Sensor:
    """A row of `[channels.NAME]` in campaign.toml: what the channel measures and how it was
    calibrated.

    `sensitivity` is in volt per `unit` and `offset_v` in volt; where `sensitivity` is given the
    recorded numbers are volts: value = (volt - offset_v) / sensitivity, in `unit`. `range` is the
    full scale in `unit`. `calibration` is what both were measured by, where the campaign states its
    points.
    """

    name: str
    quantity: str
    unit: str
    sensitivity: float | None = None
    offset_v: float = 0.0
    position: str | None = None
    axis: str | None = None
    range: float | None = None
    calibration: Calibration | None = None

    @cached_property
    def conversion(self) -> tuple[float, float]:
        """(gain, offset): SI value = gain * recorded + offset. Raises `UnitError`."""
        gain, offset = to_si(self.unit, self.quantity)
        if self.sensitivity is None:
            return gain, offset
        return gain / self.sensitivity, offset - gain * self.offset_v / self.sensitivity

    def calibration_u_si(self, value_si: float) -> float:
        """Standard uncertainty of a value in SI that comes from the calibration; 0 where none is
        stated.

        Parameters:
            value_si: The value in the SI unit of the sensor's quantity.
        """
        if self.calibration is None:
            return 0.0
        gain, offset = to_si(self.unit, self.quantity)
        return abs(gain) * self.calibration.uncertainty((value_si - offset) / gain)

    @cached_property
    def range_si(self) -> float | None:
        """Full scale as a magnitude in the SI unit of the quantity."""
        return None if self.range is None else abs(to_si(self.unit, self.quantity)[0] * self.range)


@dataclass(frozen=True)
class Channel:
    """A sensor's record in one file.

    `recorded` (n,) holds the file's own numbers, dtype kept; `si` (n,) float64 the values in
    `si_unit`.
    """

    sensor: Sensor
    recorded: NDArray[Any]
    sampling_rate_hz: float
    start_s: float = 0.0
    header: dict[str, Any] = field(default_factory=dict)
    _reckoned: dict[Hashable, Any] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    @property
    def name(self) -> str:
        return self.sensor.name

    @property
    def quantity(self) -> str:
        return self.sensor.quantity

    @property
    def si_unit(self) -> str:
        return SI_UNITS[self.sensor.quantity]

    @cached_property
    def si(self) -> NDArray[np.float64]:
        gain, offset = self.sensor.conversion
        values = self.recorded.astype(np.float64)
        if gain != 1.0:
            values *= gain
        if offset != 0.0:
            values += offset
        return values

    @cached_property
    def placeholders(self) -> Placeholders:
        """Samples that are no readings of the sensor."""
        return self._without_placeholders[0]

    @property
    def readings(self) -> NDArray[np.float64]:
        """`si` with its placeholders mended (n,): what figures, spectra and contacts are taken
        from."""
        return self._without_placeholders[1]

    @cached_property
    def _without_placeholders(self) -> tuple[Placeholders, NDArray[np.float64]]:
        return without_placeholders(self.si, self.recorded, pulsed=self.quantity in MAY_STAND_ALONE)

    def once(self, key: Hashable, reckon: Callable[[], Result]) -> Result:
        """A result that is calculated once for this channel and kept: several checks need the same
        figures of the same samples.

        Parameters:
            key: The name under which the result is kept.
            reckon: A function that calculates the result; it is called only where nothing is kept
                under `key` yet.
        """
        if key not in self._reckoned:
            self._reckoned[key] = reckon()
        result: Result = self._reckoned[key]
        return result

    @property
    def period_s(self) -> float:
        return 1.0 / self.sampling_rate_hz
