"""Where a diagnosis looks for the parameters of an effect: from "hardly there" (0) to the end of what is likely (1)."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...twin.effects import Effect, Parameter

Floats = NDArray[np.float64]

#: Beyond this ratio of its ends a range that does not hold "off" is gone through by ratios.
_WIDE = 1.5


@dataclass(frozen=True)
class Axis:
    """One searched parameter: `value(u)` for u in [0, 1]."""

    name: str
    unit: str
    start: float
    end: float
    power: float  # start + (end - start) u^power; 0: by ratios

    def value(self, u: Floats) -> Floats:
        if self.power == 0:
            return np.asarray(self.start * (self.end / self.start) ** u)
        return np.asarray(self.start + (self.end - self.start) * u**self.power)

    def up_to(self, u: float) -> Axis:
        """The same axis, ended at u."""
        return replace(self, end=float(self.value(np.array(u))))


@dataclass(frozen=True)
class Sheet:
    """One part of the space in which an effect is looked for: one sign of each signed parameter, one of its regimes.

    `fixed` are the parameters that are off meanwhile.
    """

    kind: type[Effect]
    axes: tuple[Axis, ...]
    fixed: tuple[tuple[str, float], ...] = ()

    def effects(self, u: Floats) -> list[Effect]:
        """One for each row of u (k, p)."""
        columns = [axis.value(u[:, i]) for i, axis in enumerate(self.axes)]
        names, fixed = [axis.name for axis in self.axes], dict(self.fixed)
        return [
            self.kind(**fixed, **{n: float(c[row]) for n, c in zip(names, columns, strict=True)})
            for row in range(len(u))
        ]


def sheets(kind: type[Effect]) -> tuple[Sheet, ...]:
    """All parts for one effect. Raises `ValueError` for an effect none of whose parameters has a `likely` range."""
    likely = [item for item in kind.parameters() if item.likely is not None]
    if not likely:
        raise ValueError(f"{kind.id}: no parameter has a likely range, so that there is nothing to look for")
    found: list[Sheet] = []
    for regime in kind.regimes or (tuple(item.name for item in likely),):
        ways = [_ways(item) for item in likely if item.name in regime]
        fixed = tuple((item.name, item.off) for item in likely if item.name not in regime)
        found += [Sheet(kind, axes, fixed) for axes in itertools.product(*ways)]
    return tuple(found)


def _ways(item: Parameter) -> Sequence[Axis]:
    assert item.likely is not None
    low, high = item.likely
    shapes = item.default == item.off  # it changes how an effect acts, but switches nothing off
    make: Callable[[float, float, float], Axis] = lambda a, b, p: Axis(item.name, item.unit, a, b, p)  # noqa: E731
    if shapes or not low <= item.off <= high:
        by_ratio = low > 0 and high / low > _WIDE
        start, end = (high, low) if not shapes and item.off > high else (low, high)
        return (make(start, end, 0.0 if by_ratio else 1.0),)
    if low < item.off < high:
        return make(item.off, high, 1.0), make(item.off, low, 1.0)
    # From "off" on: finer where it is small, since ranges span orders of magnitude.
    return (make(item.off, high if item.off == low else low, 2.0),)
