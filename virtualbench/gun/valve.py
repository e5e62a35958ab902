"""The ball valve: how far the ball is turned over time, and what its port leaves open."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

__all__ = ["DEAD_SHARE", "RANGEABILITY", "ValveWay", "open_share"]

#: The ball turns this share of its quarter before its bore meets the seat.
DEAD_SHARE = 0.15
#: Largest over smallest flow that the characteristic covers: ball valves are made with 30 to 300.
RANGEABILITY = 50.0


@dataclass(frozen=True)
class ValveWay:
    """The ball's position (0 shut, 1 a quarter turn further) at moments that rise, straight lines in between.

    Raises `ValueError` for moments that do not rise from 0 s on or after, and positions outside of 0 to 1.
    """

    moments_s: tuple[float, ...]
    positions: tuple[float, ...]

    def __post_init__(self) -> None:
        rising = all(first < second for first, second in pairwise(self.moments_s))
        inside = all(0 <= position <= 1 for position in self.positions)
        finite = all(0 <= moment < math.inf for moment in self.moments_s)
        if not (self.moments_s and len(self.moments_s) == len(self.positions) and rising and inside and finite):
            raise ValueError(
                f"valve at {self.moments_s} s in {self.positions}: expected rising moments from 0 s on, and as many "
                "positions of 0 to 1"
            )

    def slowed(self, factor: float) -> ValveWay:
        """Every moment `factor` times as late."""
        return ValveWay(tuple(factor * moment for moment in self.moments_s), self.positions)

    def position(self, time_s: float) -> float:
        if time_s >= self.moments_s[-1]:
            return self.positions[-1]
        if time_s < self.moments_s[0]:
            return self.positions[0]
        k = next(k for k in range(len(self.moments_s) - 1) if time_s < self.moments_s[k + 1])
        share = (time_s - self.moments_s[k]) / (self.moments_s[k + 1] - self.moments_s[k])
        return self.positions[k] + (self.positions[k + 1] - self.positions[k]) * share

    @property
    def port_opens_s(self) -> float:
        """The moment (s) from which on the port is open; infinite where it never is."""
        begins = (0.0, *self.kinks_s)
        ends = (*begins[1:], math.inf)
        middles = (begin + (min(end, begin + 1.0) - begin) / 2 for begin, end in zip(begins, ends, strict=True))
        opened = (begin for begin, middle in zip(begins, middles, strict=True) if open_share(self.position(middle)) > 0)
        return next(opened, math.inf)

    @property
    def kinks_s(self) -> tuple[float, ...]:
        """Moments (s) at which the flow has a kink: where the ball changes its speed, and where its bore meets or
        leaves the seat."""
        kinks = list(self.moments_s)
        points = list(zip(self.moments_s, self.positions, strict=True))
        for (begin, first), (end, second) in pairwise(points):
            if min(first, second) < DEAD_SHARE < max(first, second):
                kinks.append(begin + (DEAD_SHARE - first) / (second - first) * (end - begin))
        return tuple(sorted(kinks))


def open_share(position: float) -> float:
    """Open share of the port (0 to 1) at a position of the ball.

    The inherent flow characteristic of a ball valve is close to equal percentage (IEC 60534-2-4:2009): equal steps of
    the travel h multiply the flow by equal factors, R^(h - 1). That law leaves 1 / R at h = 0, where a ball valve is
    shut; with this share taken off, it is (R^h - 1) / (R - 1).
    """
    travel = (position - DEAD_SHARE) / (1 - DEAD_SHARE)
    if travel <= 0:
        return 0.0
    if travel >= 1:
        return 1.0
    return math.expm1(travel * math.log(RANGEABILITY)) / (RANGEABILITY - 1)
