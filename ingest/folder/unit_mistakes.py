"""Mistakes of declared units: factors between units that are taken for each other (NIST SP 811),
and gains of amplifiers that nobody wrote down."""

from __future__ import annotations

from collections.abc import Iterator

_POUND_FORCE_N, _GRAVITY_M_S2, _FOOT_M, _MILE_KM = 4.4482216, 9.80665, 0.3048, 1.609344
#: By quantity the unit of its columns, and others with what they read per truth: one may be taken
#: for the other.
_UNITS: dict[str, tuple[str, dict[str, float]]] = {
    "force": ("N", {"kN": 1e-3, "lbf": 1 / _POUND_FORCE_N, "kgf": 1 / _GRAVITY_M_S2}),
    "acceleration": (
        "m/s2",
        {"g": 1 / _GRAVITY_M_S2, "mm/s2": 1e3, "cm/s2": 1e2, "ft/s2": 1 / _FOOT_M},
    ),
    "velocity": (
        "m/s",
        {"km/h": 3.6, "ft/s": 1 / _FOOT_M, "mph": 3.6 / _MILE_KM, "cm/s": 1e2, "mm/s": 1e3},
    ),
    "pressure": ("bar", {"psi": 14.503774, "kPa": 1e2, "mbar": 1e3, "Pa": 1e5, "MPa": 1e-1}),
    "clock": ("Hz", {"kHz": 1e-3}),
}
#: A conditioner's switch that nobody wrote down.
_AMPLIFIED = {"force": (10.0, 100.0), "acceleration": (10.0, 100.0)}


def unit_mistakes(quantity: str) -> Iterator[tuple[float, str]]:
    """Readings over the truth, each with the mistake that makes them; those of a quantity, in both
    directions."""
    unit, factors = _UNITS[quantity]
    for name, factor in factors.items():
        yield factor, f"values in {name} where {unit} is declared"
        yield 1 / factor, f"values in {unit} where {name} is declared"
    for gain in _AMPLIFIED.get(quantity, ()):
        yield gain, f"an amplifier's gain of {gain:g} that is not divided out"
        yield 1 / gain, f"a gain of {gain:g} divided out that the amplifier does not have"
