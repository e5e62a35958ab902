"""What a law of restitution gives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ....array_types import Floats
from ..bodies import Bodies

#: Least restitution that pulses are made of: no law here describes an impactor that stays where it struck.
LEAST = 0.01


@dataclass(frozen=True, eq=False)
class Restitution:
    """Coefficient of restitution of n impacts, in [0.01, 1]; `clipped` where the law gave a value outside of it."""

    value: Floats
    clipped: NDArray[np.bool_]

    @classmethod
    def bounded(cls, raw: Floats) -> Restitution:
        """What the law gave (n,), brought into the interval that the pulses allow."""
        return cls(np.clip(raw, LEAST, 1.0), (raw < LEAST) | (raw > 1.0))


RestitutionLaw = Callable[[Bodies], Restitution]


def constant(value: float) -> RestitutionLaw:
    """The same restitution for every impact: a measured one, say. Raises `ValueError` outside of [0.01, 1]."""
    if not LEAST <= value <= 1:
        raise ValueError(f"restitution = {value!r}: expected in [{LEAST}, 1]")
    return lambda bodies: Restitution.bounded(np.full(len(bodies), value))


#: Nothing is lost.
elastic = constant(1.0)
