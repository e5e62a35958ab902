"""How far measured pulses lie from those of a law."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Spread:
    """Mean absolute errors of a law's peak force and contact time, relative to what was measured; 0 knows no spread.

    Raises `ValueError` for an error that is negative or not finite.
    """

    force: float
    time: float
    source: str

    def __post_init__(self) -> None:
        for name in ("force", "time"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0):
                raise ValueError(f"spread of {name} = {getattr(self, name)!r}: expected 0 or more")

    @property
    def stretch(self) -> float:
        """Standard deviation of the logarithm of a stretch of time that divides the force: the quadratic mean of those
        of force and time, which cannot differ where the impulse is kept."""
        return math.hypot(_log_deviation(self.force), _log_deviation(self.time)) / math.sqrt(2)


def _log_deviation(error: float) -> float:
    """s of a log-normal factor X of median 1 whose mean of |X - 1| is the error: exp(s^2 / 2) erf(s / sqrt 2).

    About sqrt(pi / 2) times the error where that is small.
    """
    if error == 0:
        return 0.0
    low, high = 0.0, 1 + math.sqrt(2 * math.log1p(error))
    while high - low > 1e-12:
        middle = (low + high) / 2
        if math.exp(middle**2 / 2) * math.erf(middle / math.sqrt(2)) < error:
            low = middle
        else:
            high = middle
    return (low + high) / 2


NO_SPREAD = Spread(0.0, 0.0, "none")

_TABLES = "thesis, Tables 5.2 (time) and 5.3 (force): 180 hammer blows"
_ASSUMED = "assumed as the von Hann pulse's, of which it shares mass and stiffness"

#: By the law's name. A table's mean error counts a law's bias as spread: most of Hunter's and Reed's is bias.
SPREADS: Mapping[str, Spread] = {
    "hann": Spread(0.2578, 0.25, _TABLES),
    "hunter": Spread(0.5224, 0.27, _TABLES),
    "reed": Spread(0.8153, 0.27, _TABLES),
    "hertz": Spread(0.2578, 0.25, _ASSUMED),
    "hunt-crossley": Spread(0.2578, 0.25, _ASSUMED),
}
