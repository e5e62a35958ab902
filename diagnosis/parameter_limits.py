"""Fitted parameters that are no values of a part: beyond what the part can be, or at the end of
where they were looked for. The law then stands for something else, and nobody should adopt it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..twin.effects import Effect, Parameter, catalogue

#: A value within this share of the end of a range lies at the end.
_AT_END = 0.01


@dataclass(frozen=True)
class ExceededLimit:
    """A parameter of an effect, its fitted value, and the limit at which or beyond which that lies,
    in SI."""

    effect: str
    parameter: Parameter
    value: float
    limit: float

    @property
    def is_beyond(self) -> bool:
        """Whether the value lies beyond the limit, and not only at it."""
        return abs(self.value - self.limit) > _AT_END * abs(self.limit)


def exceeded_limit(effect: str, name: str, value: float) -> ExceededLimit | None:
    """Of one parameter by its name in the catalogue; None where its value lies inside of its range,
    and at what switches the effect off. What the part can be goes before where the parameter is
    looked for."""
    kind = catalogue().get(effect)
    item = next((item for item in kind.parameters() if item.name == name), None) if kind else None
    if item is None or value == item.off:
        return None
    # A sensor with a data sheet may be wrong by more than that says.
    looked_for = item.likely if item.typical is None else None
    for low, high in filter(None, (item.plausible, looked_for, (item.low, item.high))):
        # An effect that grows from nothing may be as small as it likes.
        for end, side in ((low, -1.0), (high, 1.0)):
            if side * (end - item.off) > 0 and side * (value - end) >= -_AT_END * abs(end):
                return ExceededLimit(effect, item, value, end)
    return None


def exceeded_limits(effects: Sequence[Effect]) -> list[ExceededLimit]:
    """Of all parameters of fitted effects; of one with several values that which lies furthest."""
    limits = []
    for effect in effects:
        for item in effect.parameters():
            values = np.ravel(np.asarray(getattr(effect, item.name), dtype=np.float64))
            furthest = float(values[np.argmax(np.abs(values - item.off))])
            if (limit := exceeded_limit(effect.id, item.name, furthest)) is not None:
                limits.append(limit)
    return limits
