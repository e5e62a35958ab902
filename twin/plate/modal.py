"""A plate as its modes: what a finite element model or a measured table gives, and what effects
change.

What every effect of the plate does: modes in, modes out.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from ...array_types import Floats
from ..effects import Effect, checked_effects


def get_impact_point(names: tuple[str, ...], name: str) -> int:
    """The place of an impact point among those of a plate.

    Parameters:
        names: Names of the points that can be struck.
        name: Name of the impact point, such as "#1".

    Raises:
        LookupError: For a point there is none of; the message names those there are.
    """
    if name not in names:
        raise LookupError(
            f"no impact position {name!r} on this plate; there are: {', '.join(names)}"
        )
    return names.index(name)


@dataclass(frozen=True, eq=False)
class ModalPlate:
    """m modes in rising order of frequency, rigid ones at 0 Hz. Shapes are mass-normalised,
    1/sqrt(kg).

    `shape_impact` is (points, m) with a row for each name of `impact_points` ("#1"), `shapes`
    (sensors, m) with a row for each of `sensors`. Raises `ValueError` naming what does not fit.
    """

    frequency_hz: Floats
    damping_ratio: Floats
    shape_impact: Floats
    shapes: Floats
    impact_points: tuple[str, ...]
    sensors: tuple[str, ...]

    def __post_init__(self) -> None:
        m = self.frequency_hz.size
        for name, expected in (
            ("frequency_hz", (m,)),
            ("damping_ratio", (m,)),
            ("shape_impact", (len(self.impact_points), m)),
            ("shapes", (len(self.sensors), m)),
        ):
            values = getattr(self, name)
            if values.shape != expected or not np.all(np.isfinite(values)):
                raise ValueError(
                    f"{name} has shape {values.shape}: expected {expected}, all finite"
                )
        if np.any(self.frequency_hz < 0) or np.any(np.diff(self.frequency_hz) < 0):
            raise ValueError("frequency_hz: expected 0 or more, in rising order")
        if np.any((self.damping_ratio < 0) | (self.damping_ratio >= 1)):
            raise ValueError(
                f"damping_ratio up to {self.damping_ratio.max():g}: expected 0 to below 1"
            )

    def point(self, name: str) -> int:
        """The row of an impact point.

        Parameters:
            name: Name of the impact point, such as "#1".

        Raises:
            LookupError: As `get_impact_point` raises it.
        """
        return get_impact_point(self.impact_points, name)

    def sensor(self, name: str) -> int:
        """The row of a sensor.

        Parameters:
            name: Name of the sensor.

        Raises:
            LookupError: For a sensor there is none of; the message names those there are.
        """
        if name not in self.sensors:
            raise LookupError(
                f"no sensor {name!r} on this plate; there are: {', '.join(self.sensors)}"
            )
        return self.sensors.index(name)

    def sorted(self) -> Self:
        """The same with its modes in rising order."""
        order = np.argsort(self.frequency_hz, kind="stable")
        return replace(
            self,
            frequency_hz=self.frequency_hz[order],
            damping_ratio=self.damping_ratio[order],
            shape_impact=self.shape_impact[:, order],
            shapes=self.shapes[:, order],
        )


#: Owners of which a plate has several.
_PARTS = ("mode band", "channel")


@dataclass(frozen=True)
class PlateEffect(Effect):
    """What the nominal modes of a plate leave out.

    A plate is one, not a batch: a parameter is a number, or what belongs to modes or sensors an
    array of a value for each. Raises `ValueError` for another array. With every parameter at its
    `off` the plate stays exactly as it is.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        for item in self.parameters():
            if np.ndim(getattr(self, item.name)) and item.owner not in _PARTS:
                raise ValueError(
                    f"{self.id}: {item.name} is an array; expected one number, a plate is no batch"
                )

    def values(self, name: str, parts: str, count: int) -> Floats:
        """A parameter for each of the plate's modes or sensors, (count,).

        Parameters:
            name: Name of the parameter.
            parts: What the message calls the things that it belongs to: "modes", say.
            count: How many of them the plate has.

        Raises:
            ValueError: For an array of another length.
        """
        given = np.atleast_1d(np.asarray(getattr(self, name), dtype=np.float64))
        if given.size not in (1, count):
            expected = f"expected one, or one for each of the {count} {parts}"
            raise ValueError(f"{self.id}: {name} has {given.size} values; {expected}")
        return np.broadcast_to(given, count)

    @property
    def is_off(self) -> bool:
        return all(np.all(getattr(self, item.name) == item.off) for item in self.parameters())

    def apply(self, plate: ModalPlate) -> ModalPlate:
        """The modes of the plate under this effect, in rising order.

        Parameters:
            plate: The plate without this effect.
        """
        return plate if self.is_off else self.changed(plate).sorted()

    @abstractmethod
    def changed(self, plate: ModalPlate) -> ModalPlate:
        """The modes where the effect does something, in any order.

        Parameters:
            plate: The plate without this effect.
        """


def with_effects(plate: ModalPlate, effects: Iterable[Effect]) -> ModalPlate:
    """The plate under effects, in the order given.

    Parameters:
        plate: The plate without effects.
        effects: Effects of the plate, each at most once.

    Raises:
        TypeError: For an effect of another stage.
        ValueError: For an effect given twice.
    """
    for effect in checked_effects(effects, PlateEffect):  # type: ignore[type-abstract]
        plate = effect.apply(plate)
    return plate
