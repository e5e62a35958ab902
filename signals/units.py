"""Units of what a laboratory writes, converted to SI once, on entry.

pint's registry, with one change: `g` is standard gravity here, not gram (a shock laboratory's `g`
is an acceleration), and the spellings that acquisition systems write are known.
"""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pint

#: Quantity of a channel -> its SI unit, as keys and listings print it.
SI_UNITS: dict[str, str] = {
    "force": "N",
    "acceleration": "m/s2",
    "velocity": "m/s",
    "displacement": "m",
    "pressure": "Pa",
    "strain": "1",
    "voltage": "V",
    "temperature": "K",
}

#: SI unit -> factors of the units in which nearly all is written. They are pint's, and spare its
#: import and its registry, which take 0.4 s. A `g` of a mass is a gram.
USUAL_FACTORS: dict[str, dict[str, float]] = {
    "N": {"N": 1.0, "Newtons": 1.0, "kN": 1e3},
    "m/s2": {"m/s2": 1.0, "m/s²": 1.0, "m/s^2": 1.0, "m/s**2": 1.0, "g": 9.80665},
    "m/s": {"m/s": 1.0},
    "m": {"m": 1.0, "mm": 1e-3},
    "Pa": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "mbar": 1e2, "bar": 1e5},
    "1": {"1": 1.0},
    "V": {"V": 1.0, "mV": 1e-3},
    "K": {"K": 1.0},
    "kg": {"kg": 1.0, "g": 1e-3},
    "s": {"s": 1.0, "ms": 1e-3},
    "Hz": {"Hz": 1.0, "kHz": 1e3},
}

_PINT_OF_SI = {"m/s2": "m/s**2", "1": "dimensionless"}

#: Spellings that pint does not know, or knows as something else.
_SPELLINGS = {
    "g": "standard_gravity",
    "gn": "standard_gravity",
    "g_n": "standard_gravity",
    "g_0": "standard_gravity",
    "G": "standard_gravity",
    "mg": "1e-3 standard_gravity",
    **dict.fromkeys(("g's", "gs", "g pk", "g-pk", "g peak", "gpk"), "standard_gravity"),
    **dict.fromkeys(("ug", "µg", "μg"), "1e-6 standard_gravity"),
    **dict.fromkeys(
        ("ms-2", "ms^-2", "ms⁻²", "m s-2", "m s^-2", "m s⁻²", "m·s-2", "m·s⁻²", "m.s-2"), "m/s**2"
    ),
    "m/s2": "m/s**2",
    "m/s^2": "m/s**2",
    "m/s²": "m/s**2",
    "mm/s2": "mm/s**2",
    "mm/s^2": "mm/s**2",
    "ips": "inch/s",
    "Newtons": "N",
    "Newton": "N",
    "um/m": "1e-6 dimensionless",
    "µm/m": "1e-6 dimensionless",
    "ustrain": "1e-6 dimensionless",
    "microstrain": "1e-6 dimensionless",
    "µε": "1e-6 dimensionless",
    "1": "dimensionless",
    "": "dimensionless",
    "degC": "degC",
    "°C": "degC",
}

_LONGEST = 60
_POWER = re.compile(r"\*\*|\^|[⁰¹²³⁴⁵⁶⁷⁸⁹]{2,}")
_POWER_OF_NAME = re.compile(
    r"[^\W\d_]\s*(?:\*\*|\^)\s*\(?\s*[-+]?\d{1,2}(?![\d.eE⁰¹²³⁴⁵⁶⁷⁸⁹]|\s*\)?\s*(?:\*\*|\^))"
)


class UnitError(ValueError):
    """A unit is unknown or measures something else; the message names it and what would do."""


@cache
def registry() -> pint.UnitRegistry[float]:
    """The one registry (pint is imported here: it costs 0.2 s that `--help` must not pay)."""
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


def unit_spelling(unit: str) -> str:
    """A unit as pint reads it: our own spellings, and `m3` or `mm2` as powers.

    Parameters:
        unit: The unit as a file or a person writes it; blanks around it do not count.

    Raises:
        UnitError: For what pint would take for ever to reckon, such as `10**10**10`: powers are of
            names, to one or two digits.
    """
    unit = unit.strip()
    if len(unit) > _LONGEST or len(_POWER.findall(unit)) != len(_POWER_OF_NAME.findall(unit)):
        raise UnitError(f"unit {unit!r:.100} is no product of units and their small powers")
    return _SPELLINGS.get(unit) or re.sub(r"(?<=[A-Za-z])([23])(?![0-9])", r"**\1", unit)


def unit_quantity(unit: str) -> Any:
    """One of a unit, as a quantity of pint.

    Parameters:
        unit: The unit as a file or a person writes it.

    Raises:
        UnitError: For any text that is no unit.
    """
    import pint

    try:
        return registry().Quantity(unit_spelling(unit))
    except UnitError:
        raise
    except (
        pint.UndefinedUnitError,
        pint.DefinitionSyntaxError,
        AttributeError,
        TypeError,
        ValueError,
    ) as error:
        raise UnitError(f"unknown unit {unit!r:.100}") from error
    except Exception as error:  # pint's parser leaks tokenizer errors of several kinds for odd text
        raise UnitError(f"unreadable unit {unit!r:.100}") from error


def usual_factor(unit: str, si_unit: str) -> float | None:
    """What takes a number in a unit to an SI unit, of those that `USUAL_FACTORS` lists; else None.

    Parameters:
        unit: The unit of the number, as a file or a person writes it.
        si_unit: The SI unit; its powers may be written as pint does.
    """
    return USUAL_FACTORS.get(si_unit.replace("**", ""), {}).get(unit.strip())


@cache
def to_si(unit: str, quantity: str) -> tuple[float, float]:
    """Gain and offset that take a number in a unit to the SI unit of its quantity: si = gain * x +
    offset.

    Parameters:
        unit: The unit of the number, as a file or a person writes it.
        quantity: What is measured, a key of `SI_UNITS`.

    Raises:
        UnitError: For an unknown quantity, an unknown unit, or a unit of another dimension.
    """
    if quantity not in SI_UNITS:
        raise UnitError(f"unknown quantity {quantity!r}; known: {', '.join(SI_UNITS)}")
    target = SI_UNITS[quantity]
    if (usual := usual_factor(unit, target)) is not None:
        return usual, 0.0
    refusal = f"unit {unit!r} does not measure {quantity}; expected something like {target!r}"
    if any(unit.strip() in factors for factors in USUAL_FACTORS.values()):
        raise UnitError(refusal)
    import pint

    ureg = registry()
    try:
        wanted = _PINT_OF_SI.get(target, target)
        source = unit_quantity(unit)
        if unit.strip() in ("degC", "°C", "degF", "°F"):
            zero = ureg.Quantity(0.0, source.units).to(wanted).magnitude
            factor = ureg.Quantity(1.0, source.units).to(wanted).magnitude
            return float(factor - zero), float(zero)
        return float(source.to(wanted).magnitude), 0.0
    except pint.DimensionalityError as error:
        raise UnitError(refusal) from error
    except (UnitError, AttributeError, TypeError, ValueError) as error:
        raise UnitError(
            f"unknown unit {unit!r:.100} for {quantity}; expected something like {target!r}"
        ) from error
