"""Mistakes of unit that laboratories make, by the quantity that they befall: factors of NIST SP 811."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

POUND_FORCE_N, GRAVITY_M_S2, FOOT_M, PSI_PER_BAR = 4.4482216, 9.80665, 0.3048, 14.503774
ATMOSPHERE_PA = 101_325.0


@dataclass(frozen=True)
class Mistake:
    """A reading that is `reads` times the truth, because of what `what` says."""

    reads: float
    what: str


#: (unit that values are in, unit that is declared, values per truth) where the one is taken for the other.
_UNITS: dict[str, tuple[tuple[str, str, float], ...]] = {
    "force": (("kN", "N", 1e-3), ("lbf", "N", 1 / POUND_FORCE_N), ("kgf", "N", 1 / GRAVITY_M_S2)),
    "acceleration": (
        ("g", "m/s2", 1 / GRAVITY_M_S2),
        ("mm/s2", "m/s2", 1e3),
        ("cm/s2", "m/s2", 1e2),
        ("ft/s2", "m/s2", 1 / FOOT_M),
    ),
    "velocity": (
        ("km/h", "m/s", 3.6),
        ("ft/s", "m/s", 1 / FOOT_M),
        ("mph", "m/s", 3.6 / 1.609344),
        ("cm/s", "m/s", 1e2),
        ("mm/s", "m/s", 1e3),
    ),
    "pressure": (
        ("psi", "bar", PSI_PER_BAR),
        ("kPa", "bar", 1e2),
        ("mbar", "bar", 1e3),
        ("Pa", "bar", 1e5),
        ("MPa", "bar", 1e-1),
    ),
    "clock": (("kHz", "Hz", 1e-3),),
}
#: A conditioner's switch that nobody wrote down.
_AMPLIFIED = {"force": (10.0, 100.0), "acceleration": (10.0, 100.0)}


def mistakes(quantity: str) -> Iterator[Mistake]:
    """Those of a quantity, each in both directions."""
    for values, declared, reads in _UNITS.get(quantity, ()):
        yield Mistake(reads, f"values in {values} where {declared} is declared")
        yield Mistake(1 / reads, f"values in {declared} where {values} is declared")
    for gain in _AMPLIFIED.get(quantity, ()):
        yield Mistake(gain, f"an amplifier's gain of {gain:g} that is not divided out")
        yield Mistake(1 / gain, f"a gain of {gain:g} divided out that the amplifier does not have")
