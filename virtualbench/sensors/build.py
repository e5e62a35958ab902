"""A sensor with its conditioner and its channel of the recorder, as the lab would write it in a
list of instruments."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Quantity = Literal["force", "acceleration", "pressure", "displacement"]

#: Largest word of a converter whose counts times a step a float32 still tells apart.
_LARGEST_BITS = 24


@dataclass(frozen=True)
class SensorBuild:
    """One measuring chain. What is "in the unit" is in `unit`, of which one is `si_per_unit` in SI.

    With a `sensitivity` (volt per unit) the recorder writes volts, volt = sensitivity * value +
    `offset_v`, converted over ±`converter_range_v`; without one it writes values in the unit,
    converted over ±`full_scale`.

    The faults are what strength 1 of the effect means for this chain, 0 or None where it has none:
    `gain_fault` (relative, sensor.*_gain), `offset_fault` (unit, sensor.pressure_offset),
    `zero_shift_fault` (share of the shock's peak, sensor.zero_shift), `gain_drift` and
    `offset_drift` (relative, and in the unit, over one day, bench.drift). `mount_resonance_hz` and,
    for a force, `bandwidth_hz` are divided by the strength of their effects; other sensors keep
    their bandwidth. Raises `ValueError` for numbers that no instrument has.
    """

    name: str
    quantity: Quantity
    unit: str
    full_scale: float
    si_per_unit: float = 1.0
    bits: int = 24
    sensitivity: float | None = None
    offset_v: float = 0.0
    converter_range_v: float = 10.0
    noise: float = 0.0
    bandwidth_hz: float | None = None
    mount_resonance_hz: float | None = None
    mount_damping: float = 0.02
    gain_fault: float = 0.0
    offset_fault: float = 0.0
    zero_shift_fault: float = 0.0
    zero_shift_decay_s: float = 0.25
    gain_drift: float = 0.0
    offset_drift: float = 0.0
    position: str | None = None
    axis: str | None = None

    def __post_init__(self) -> None:
        for name in (
            "full_scale",
            "si_per_unit",
            "converter_range_v",
            "mount_damping",
            "zero_shift_decay_s",
        ):
            if not getattr(self, name) > 0:
                raise ValueError(
                    f"sensor {self.name!r}: {name} is {getattr(self, name)!r}; expected above zero"
                )
        if not self.noise >= 0:
            raise ValueError(
                f"sensor {self.name!r}: noise is {self.noise!r}; expected zero or more"
            )
        if not (isinstance(self.bits, int) and 2 <= self.bits <= _LARGEST_BITS):
            raise ValueError(
                f"sensor {self.name!r}: bits is {self.bits!r}; expected 2 to {_LARGEST_BITS}"
            )
        if self.sensitivity == 0:
            raise ValueError(
                f"sensor {self.name!r}: sensitivity is 0; expected volt per {self.unit}"
            )

    @property
    def converter_range(self) -> float:
        """Full scale of the converter, in what is written (volts or the unit)."""
        return self.full_scale if self.sensitivity is None else self.converter_range_v

    @property
    def step(self) -> float:
        """One count, in what is written."""
        return self.converter_range / 2.0 ** (self.bits - 1)
