"""How far a spectrum may lie from its target."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from ...array_types import Floats


@dataclass(frozen=True)
class Tolerance:
    """Bands: from `from_hz` on (the first is 0), a line may lie `upper_db` above and `lower_db` below its level."""

    from_hz: tuple[float, ...]
    upper_db: tuple[float, ...]
    lower_db: tuple[float, ...]

    def __post_init__(self) -> None:
        if not all(value >= 0 for value in (*self.upper_db, *self.lower_db)):
            raise ValueError(f"tolerance +{self.upper_db} / -{self.lower_db} dB: expected 0 dB or more, either way")

    def at(self, frequency_hz: Floats) -> tuple[Floats, Floats]:
        """Upper and lower tolerance at the lines, (f,) each."""
        band = np.searchsorted(self.from_hz, frequency_hz, side="right") - 1
        return np.asarray(self.upper_db)[band], np.asarray(self.lower_db)[band]


def within_db(upper: float, lower: float | None = None) -> Tolerance:
    """The same at every frequency; `lower` None for as much below as above."""
    return Tolerance((0.0,), (upper,), (upper if lower is None else lower,))


#: NASA-STD-7003A (2011), control tolerances: 6 dB either way to 3 kHz, +9 / -6 dB above. It asks, too, that half of
#: the lines or more lie above the nominal: `share_above` of `comparison.py`. A line at 3 kHz belongs to the lower band.
NASA_STD_7003 = Tolerance((0.0, 3000.01), (6.0, 9.0), (6.0, 6.0))

_NAMED = {"nasa-std-7003": NASA_STD_7003}
_ONE = re.compile(r"(?:±|\+-|\+/-)?\s*(\d+(?:\.\d+)?)\s*dB", re.IGNORECASE)
_TWO = re.compile(r"\+\s*(\d+(?:\.\d+)?)\s*(?:dB)?\s*/\s*-\s*(\d+(?:\.\d+)?)\s*dB", re.IGNORECASE)


def parse_tolerance(text: str) -> Tolerance:
    """`6dB`, `+9/-6dB` or `nasa-std-7003`. Raises `ValueError` for anything else, a number without its unit, too."""
    text = text.strip()
    if text.lower() in _NAMED:
        return _NAMED[text.lower()]
    match = _ONE.fullmatch(text) or _TWO.fullmatch(text)
    if match is None:
        raise ValueError(f"tolerance is {text!r}; expected one such as 6dB, +9/-6dB or {', '.join(_NAMED)}")
    return within_db(*(float(number) for number in match.groups()))
