"""What uncertain settings of the gun do to the velocity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace

import numpy as np

from ....twin.gun.bench import GunBench
from ....twin.gun.shots import gun_velocity
from ..base import Floats

#: What each shot is read off with.
READINGS = ("tank_pressure_pa", "bullet_mass_kg")
#: Of a standard deviation: small enough for a derivative, large enough for its digits.
_STEP = 1e-3


def gun_nuisances(
    bench: GunBench, pressure_pa: Floats, mass_kg: Floats, travel_m: Floats, uncertain: Mapping[str, float]
) -> dict[str, Floats]:
    """(C, 1) by name: ln velocity's derivative times one standard deviation, at pressures, masses and travels (C,).

    Central differences; one-sided where the other side is no gun, as above an efficiency of one. NaN where the nominal
    shot stays in the barrel. Raises `ValueError` for another name than a setting's, and a deviation that is negative.
    """
    known = (*(item.name for item in fields(GunBench)), *READINGS)
    for name, sd in uncertain.items():
        if name not in known:
            raise ValueError(f"no uncertain setting {name!r} of the gun; there are: {', '.join(known)}")
        if not (np.isfinite(sd) and sd >= 0):
            raise ValueError(f"uncertain {name} = {sd!r}: expected a standard deviation, not negative")
    shots = (pressure_pa, mass_kg, travel_m)
    return {name: _column(bench, shots, name, sd)[:, None] for name, sd in uncertain.items() if sd > 0}


def _column(bench: GunBench, shots: tuple[Floats, Floats, Floats], name: str, sd: float) -> Floats:
    sides = [(sign, _moved(bench, shots, name, sign * _STEP * sd)) for sign in (1.0, -1.0, 0.0)]
    (a, high), (b, low), *_ = [(sign, found) for sign, found in sides if found is not None]
    return np.asarray((high - low) / ((a - b) * _STEP))


def _moved(bench: GunBench, shots: tuple[Floats, Floats, Floats], name: str, step: float) -> Floats | None:
    """ln velocity (C,) with one setting moved; None where that is no gun."""
    names = ("tank_pressure_pa", "bullet_mass_kg", "travel_m")
    pressure, mass, travel = (values + step * (name == own) for values, own in zip(shots, names, strict=True))
    if name not in READINGS:
        try:
            bench = replace(bench, **{name: getattr(bench, name) + step})
        except ValueError:
            return None
    found = np.full(pressure.shape, np.nan)
    good = (pressure >= 0) & (mass > 0) & (travel > 0)
    velocity = gun_velocity(bench, pressure[good], mass[good], travel_m=travel[good]).velocity_m_s
    found[good] = np.log(np.where(velocity > 0, velocity, np.nan))
    return found
