"""What every effect of the plate does: modes in, modes out."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ...array_types import Floats
from ..effects import Effect, checked_effects
from .modal import ModalPlate

#: Owners of which a plate has several.
_PARTS = ("mode band", "channel")


@dataclass(frozen=True)
class PlateEffect(Effect):
    """What the nominal modes of a plate leave out.

    A plate is one, not a batch: a parameter is a number, or what belongs to modes or sensors an array of a value for
    each. Raises `ValueError` for another array. With every parameter at its `off` the plate stays exactly as it is.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        for item in self.parameters():
            if np.ndim(getattr(self, item.name)) and item.owner not in _PARTS:
                raise ValueError(f"{self.id}: {item.name} is an array; expected one number, a plate is no batch")

    def values(self, name: str, parts: str, count: int) -> Floats:
        """(count,): a parameter for each of the plate's `parts` ("modes").

        Raises `ValueError` for an array of another length.
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
        """The modes of the plate under this effect, in rising order."""
        return plate if self.is_off else self.changed(plate).sorted()

    @abstractmethod
    def changed(self, plate: ModalPlate) -> ModalPlate:
        """The modes where the effect does something, in any order."""


def with_effects(plate: ModalPlate, effects: Iterable[Effect]) -> ModalPlate:
    """The plate under effects, in the order given. Raises `TypeError` for another stage's, `ValueError` for doubles."""
    for effect in checked_effects(effects, PlateEffect):  # type: ignore[type-abstract]
        plate = effect.apply(plate)
    return plate
