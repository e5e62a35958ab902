"""One way to set the bench, in the words of its user."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from ..signals.valve_profile import ValveProfile
from .materials import ElasticMaterial

INSULATORS = ("none", "polymeric")
BOUNDARY_CONDITIONS = ("free", "fixed")


@dataclass(frozen=True)
class Setting:
    """What an operator sets for one shot, SI. Raises `ValueError` naming the field, the value and what is expected.

    Exactly one of `tank_pressure_pa` (gauge) and `impact_velocity_m_s` is given: with the velocity, the gun has no
    part. The insulator lies on an anvil, so it needs one. `factors` are a lab's own, by name, for models that ask for
    them; physics knows none of them. `valve_profile` is how the controller opens and closes the gun's valve, None where
    it is not stated; it needs a tank pressure.
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
            raise ValueError("tank_pressure_pa and impact_velocity_m_s: expected exactly one of them")
        if self.tank_pressure_pa is not None and not (0 <= self.tank_pressure_pa < math.inf):
            raise ValueError(f"tank_pressure_pa = {self.tank_pressure_pa!r}: expected 0 or more, gauge")
        if self.impact_velocity_m_s is not None:
            _positive("impact_velocity_m_s", self.impact_velocity_m_s)
        if self.valve_profile is not None and self.tank_pressure_pa is None:
            raise ValueError("valve_profile without tank_pressure_pa: a given velocity of impact passes no valve")
        if self.insulator not in INSULATORS:
            raise ValueError(f"insulator = {self.insulator!r}: expected one of {', '.join(INSULATORS)}")
        if self.boundary_conditions not in BOUNDARY_CONDITIONS:
            raise ValueError(
                f"boundary_conditions = {self.boundary_conditions!r}: expected one of {', '.join(BOUNDARY_CONDITIONS)}"
            )
        if self.insulator != "none" and self.anvil is None:
            raise ValueError(f"insulator = {self.insulator!r} without an anvil: expected an anvil, on which it lies")

    @property
    def target(self) -> ElasticMaterial:
        """The first layer hit: the anvil where there is one, else the plate."""
        return self.anvil or self.plate


def _positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f"{name} = {value!r}: expected a positive number")
