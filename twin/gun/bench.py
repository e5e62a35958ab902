"""The gun's settings, and what follows from them alone."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

STANDARD_GRAVITY_M_S2 = 9.80665

#: Smallest value where it is not "positive": a frictionless barrel and an isothermal gas are
#: allowed limits.
_LEAST = {"friction_coefficient": 0.0, "heat_capacity_ratio": 1.0}


@dataclass(frozen=True)
class GunBench:
    """Settings of the gun. Raises `ValueError` naming the field and the value when one is
    unphysical."""

    tank_volume_m3: float
    bore_diameter_m: float
    projectile_diameter_m: float  # the gas pushes on this section (eq. 2.14)
    travel_m: float  # from rest to the vent holes, where the gas escapes
    friction_coefficient: float
    heat_capacity_ratio: float
    efficiency: float  # eq. 2.18: measured over ideal velocity, in (0, 1]

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            least = _LEAST.get(item.name)
            if not (math.isfinite(value) and (value > 0 if least is None else value >= least)):
                expected = "positive" if least is None else f"at least {least:g}"
                raise ValueError(f"{item.name} = {value!r}: expected {expected} and finite")
        if self.efficiency > 1:
            raise ValueError(f"efficiency = {self.efficiency!r}: expected in (0, 1]")
        if self.projectile_diameter_m > self.bore_diameter_m:
            raise ValueError(
                f"projectile_diameter_m = {self.projectile_diameter_m!r}: "
                f"expected at most bore_diameter_m = {self.bore_diameter_m!r}"
            )

    @property
    def projectile_area_m2(self) -> float:
        return math.pi * self.projectile_diameter_m**2 / 4

    @property
    def work_per_pascal_m3(self) -> float:
        """Work of the gas over the whole travel per pascal of initial pressure: A L for an endless
        tank."""
        from scipy.special import exprel

        growth = math.log1p(self.projectile_area_m2 * self.travel_m / self.tank_volume_m3)
        # exprel keeps the digits for large tanks, and is the isothermal law at a ratio of one.
        return float(self.tank_volume_m3 * growth * exprel((1 - self.heat_capacity_ratio) * growth))

    def friction_work_j(self, bullet_mass_kg: NDArray[np.float64]) -> NDArray[np.float64]:
        """Work of eq. 2.13 over the travel, shape of the masses.

        Parameters:
            bullet_mass_kg: Masses of bullets, an array of any shape.
        """
        return self.friction_coefficient * STANDARD_GRAVITY_M_S2 * self.travel_m * bullet_mass_kg


def checked(name: str, value: ArrayLike, *, zero_allowed: bool = False) -> NDArray[np.float64]:
    """A quantity as float64, of the shape given.

    Parameters:
        name: What the quantity is called in the message.
        value: A number or an array of any shape.
        zero_allowed: Whether 0 is accepted too; by default only positive values are.

    Raises:
        ValueError: For an entry that is out of range or not finite; the message names the first
            one.
    """
    import numpy as np

    values = np.asarray(value, dtype=np.float64)
    good = np.isfinite(values) & ((values >= 0) if zero_allowed else (values > 0))
    if not np.all(good):
        bad = float(values[~good].flat[0])
        raise ValueError(
            f"{name} = {bad!r}: expected "
            f"{'not negative' if zero_allowed else 'positive'} and finite"
        )
    return values
