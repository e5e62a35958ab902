"""How far a spectrum may lie from its target, and how far it does."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .target import Target

Floats = NDArray[np.float64]


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
#: the lines or more lie above the nominal: `Comparison.share_above`. A line at 3 kHz belongs to the lower band.
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


@dataclass(frozen=True, eq=False)
class Comparison:
    """Spectra held against a target at `frequency_hz` (f,), the lines that both have.

    `error_db` (..., f) is 20 log10(spectrum / level); `margin_db` (..., f) the way to the nearer edge of the band,
    positive inside. Per spectrum (...,): `share_within` and `share_above` (the level) of the lines, the smallest margin
    and its frequency.
    """

    frequency_hz: Floats
    target: Target
    error_db: Floats
    margin_db: Floats
    share_within: Floats
    share_above: Floats
    worst_margin_db: Floats
    worst_frequency_hz: Floats

    @property
    def within(self) -> NDArray[np.bool_]:
        """Whether every line lies within its tolerance, (...,)."""
        return np.asarray(self.worst_margin_db >= 0)


def compare(maximax_m_s2: Floats, frequency_hz: Floats, target: Target) -> Comparison:
    """Spectra (..., f) at `frequency_hz` (f,) against a target. Lines outside of the target's range are left out.

    An edge belongs to the band, to within rounding. Raises `ValueError` where no line lies in the target's range.
    """
    inside = target.covers(frequency_hz)
    if not np.any(inside):
        raise ValueError(
            f"no line of the spectrum ({frequency_hz.min():g} to {frequency_hz.max():g} Hz) lies in the target's range "
            f"({target.frequency_hz[0]:g} to {target.frequency_hz[-1]:g} Hz)"
        )
    lines = target.at(frequency_hz[inside])
    with np.errstate(divide="ignore"):  # no response at all is -inf dB
        error = 20 * np.log10(maximax_m_s2[..., inside] / lines.level_m_s2)
    error = np.where(np.abs(error) < 1e-9, 0.0, error)
    margin = np.minimum(lines.upper_db - error, lines.lower_db + error)
    margin = np.where(np.abs(margin) < 1e-9, 0.0, margin)
    worst = margin.argmin(axis=-1)
    return Comparison(
        frequency_hz=lines.frequency_hz,
        target=lines,
        error_db=error,
        margin_db=margin,
        share_within=np.asarray((margin >= 0).mean(axis=-1)),
        share_above=np.asarray((error >= 0).mean(axis=-1)),
        worst_margin_db=np.asarray(margin.min(axis=-1)),
        worst_frequency_hz=lines.frequency_hz[worst],
    )
