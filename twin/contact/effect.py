"""Effects of the contact: each changes the quantities of an impact before it is solved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...array_types import Floats
from ..effects import Effect, Value
from .impacts import Impacts


@dataclass(frozen=True)
class ContactEffect(Effect):
    """What Hertz' impact leaves out. Several effects act in the order in which they are given.

    Parameters are numbers for all impacts, or arrays (n,).
    """

    def prepare(self, impacts: Impacts) -> Impacts:
        """The same impacts with the quantities that this effect changes. Raises `MissingQuantityError` for what these
        bodies do not tell, `ValueError` for parameters of another number of impacts."""
        return impacts

    def _each(self, parameter: Value, impacts: Impacts) -> Floats:
        """A parameter as (n,)."""
        values, n = np.asarray(parameter, dtype=np.float64), len(impacts.bodies)
        if values.shape not in ((), (n,)):
            raise ValueError(f"{self.id}: parameter of shape {values.shape} for {n} impacts; expected () or ({n},)")
        return np.broadcast_to(values, (n,))
