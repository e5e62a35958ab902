"""One way to set the bench, in the words of its user.

Materials as the twin's stages take them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from ..signals.valve_profile import ValveProfile


@dataclass(frozen=True)
class ElasticMaterial:
    """An isotropic elastic material. Raises `ValueError` naming the material, the field and the
    value."""

    name: str
    youngs_modulus_pa: float
    poisson_ratio: float
    density_kg_m3: float
    yield_strength_pa: float | None = None

    def __post_init__(self) -> None:
        for name in ("youngs_modulus_pa", "density_kg_m3", "yield_strength_pa"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise ValueError(f"{self.name}: {name} = {value!r}; expected positive and finite")
        if not -1 < self.poisson_ratio < 0.5:
            raise ValueError(
                f"{self.name}: poisson_ratio = "
                f"{self.poisson_ratio!r}; expected above -1 and below 0.5"
            )


#: Thesis, Table 4.2; PLA: Farah, Anderson and Langer, Adv. Drug Deliv. Rev. 107 (2016) 367, solid,
#: mid-range.
THESIS: dict[str, ElasticMaterial] = {
    m.name: m
    for m in (
        ElasticMaterial("aluminum", 69.9e9, 0.33, 2700.0, 276e6),
        ElasticMaterial("steel", 200e9, 0.30, 7800.0, 400e6),
        ElasticMaterial("delrin", 3.20e9, 0.35, 1410.0, 71.7e6),
        ElasticMaterial("polyurethane", 0.03e9, 0.39, 1210.0, 51.0e6),
        ElasticMaterial("PLA", 3.5e9, 0.36, 1240.0, 50e6),
    )
}


INSULATORS = ("none", "polymeric")
BOUNDARY_CONDITIONS = ("free", "fixed")


@dataclass(frozen=True)
class Setting:
    """What an operator sets for one shot, SI. Raises `ValueError` naming the field, the value and
    what is expected.

    Exactly one of `tank_pressure_pa` (gauge) and `impact_velocity_m_s` is given: with the velocity,
    the gun has no part. The insulator lies on an anvil, so it needs one. `factors` are a lab's own,
    by name, for models that ask for them; physics knows none of them. `valve_profile` is how the
    controller opens and closes the gun's valve, None where it is not stated; it needs a tank
    pressure.
    """

    impactor_mass_kg: float
    tip: ElasticMaterial
    tip_radius_m: float
    plate: ElasticMaterial
    plate_thickness_m: float
    plate_mass_kg: float
    tank_pressure_pa: float | None = None
    impact_velocity_m_s: float | None = None
    anvil: ElasticMaterial | None = None
    insulator: str = "none"
    impact_position: str = "#1"
    boundary_conditions: str = "free"
    factors: Mapping[str, str | float] = field(default_factory=dict, hash=False)
    valve_profile: ValveProfile | None = None

    def __post_init__(self) -> None:
        for name in ("impactor_mass_kg", "tip_radius_m", "plate_thickness_m", "plate_mass_kg"):
            _positive(name, getattr(self, name))
        if (self.tank_pressure_pa is None) == (self.impact_velocity_m_s is None):
            raise ValueError(
                "tank_pressure_pa and impact_velocity_m_s: expected exactly one of them"
            )
        if self.tank_pressure_pa is not None and not (0 <= self.tank_pressure_pa < math.inf):
            raise ValueError(
                f"tank_pressure_pa = {self.tank_pressure_pa!r}: expected 0 or more, gauge"
            )
        if self.impact_velocity_m_s is not None:
            _positive("impact_velocity_m_s", self.impact_velocity_m_s)
        if self.valve_profile is not None and self.tank_pressure_pa is None:
            raise ValueError(
                "valve_profile without tank_pressure_pa: a given velocity of impact passes no valve"
            )
        if self.insulator not in INSULATORS:
            raise ValueError(
                f"insulator = {self.insulator!r}: expected one of {', '.join(INSULATORS)}"
            )
        if self.boundary_conditions not in BOUNDARY_CONDITIONS:
            raise ValueError(
                f"boundary_conditions = {self.boundary_conditions!r}: "
                f"expected one of {', '.join(BOUNDARY_CONDITIONS)}"
            )
        if self.insulator != "none" and self.anvil is None:
            raise ValueError(
                f"insulator = {self.insulator!r} without an "
                f"anvil: expected an anvil, on which it lies"
            )

    @property
    def target(self) -> ElasticMaterial:
        """The first layer hit: the anvil where there is one, else the plate."""
        return self.anvil or self.plate


def _positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f"{name} = {value!r}: expected a positive number")
