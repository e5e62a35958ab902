"""What is bolted together: the gun, its surroundings and the projectile. Lengths from the valve, along the barrel."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

__all__ = ["GunBuild", "Projectile"]


def _check_positive(thing: object, zero_allowed: frozenset[str] = frozenset()) -> None:
    for field in fields(thing):  # type: ignore[arg-type]
        value = getattr(thing, field.name)
        low = value >= 0 if field.name in zero_allowed else value > 0
        if not (math.isfinite(value) and low):
            expected = "0 or more" if field.name in zero_allowed else "a positive number"
            raise ValueError(f"{field.name} = {value!r}: expected {expected}")


@dataclass(frozen=True)
class Projectile:
    """A cylinder that slides in the barrel; the standard is the PLA bullet of thesis section 3.1."""

    mass_kg: float = 0.1428
    length_m: float = 0.085
    diameter_m: float = 0.048

    def __post_init__(self) -> None:
        _check_positive(self)

    @property
    def area_m2(self) -> float:
        return math.pi * self.diameter_m**2 / 4


@dataclass(frozen=True)
class GunBuild:
    """The gun of thesis section 2.1.2; where the text gives no figure, the comment says where it comes from.

    Raises `ValueError` for figures that are not positive, and for an order along the barrel other than
    vents, laser, muzzle.
    """

    tank_volume_m3: float = 9.5e-3
    tank_wall_m2: float = 0.27  # a cylinder of 9.5 l, twice as long as wide
    bore_diameter_m: float = 0.049
    barrel_length_m: float = 1.56
    vent_position_m: float = 0.885  # section 2.3
    vent_count: int = 6
    vent_diameter_m: float = 0.012  # of the safety pins that fit them
    laser_position_m: float = 0.93  # assumed: the aperture next to the vents, where muzzle velocity is defined
    plate_gap_m: float = 0.010  # assumed: the tail of the shortest bullet stays in the barrel
    valve_bore_m: float = 0.050
    valve_opening_time_s: float = 0.25  # the controller allows 0.1 s and more; tuned on the five shots of Table 3.1
    valve_discharge: float = 0.70  # a port of sharp edges while the ball turns: 0.6 to 0.8
    valve_critical_ratio: float = 0.35  # ISO 6358 b of ball valves: 0.2 to 0.5
    dead_volume_m3: float = 0.25e-3  # assumed: valve body and nipple, 50 mm wide and 130 mm long
    outlet_discharge: float = 0.65  # vents and the gap at the plate: sharp-edged holes, 0.6 to 0.7
    leak_friction_factor: float = 0.030  # Darcy, smooth walls at Re = 1e4 (Blasius)
    leak_end_losses: float = 3.0  # assumed: inlet 0.5 and outlet 1, twice, for body and tip; tuned with the valve
    friction_coefficient: float = 0.30  # PLA on steel, dry
    extra_friction_coefficient: float = 0.30  # a printed bullet that rubs askew
    breakaway_force_n: float = 1.5  # assumed, as much as its weight
    stribeck_velocity_m_s: float = 0.10
    seal_drag_share: float = 0.02  # assumed: friction 0.3 on a land 0.8 mm wide that the gas presses on the wall
    tank_heat_transfer_w_m2_k: float = 50.0  # vessels that discharge in a second: 10 to 100
    barrel_heat_transfer_w_m2_k: float = 60.0  # turbulent pipe flow at 15 m/s
    entrance_loss: float = 0.5
    atmosphere_pa: float = 101_325.0
    temperature_k: float = 293.15

    def __post_init__(self) -> None:
        losses = {"breakaway_force_n", "seal_drag_share", "entrance_loss", "leak_friction_factor", "dead_volume_m3"}
        _check_positive(self, frozenset(losses | {"friction_coefficient", "extra_friction_coefficient"}))
        stations = (self.vent_position_m, self.laser_position_m, self.barrel_length_m)
        if not stations[0] < stations[1] < stations[2]:
            raise ValueError(f"vents, laser, muzzle at {stations} m from the valve: expected this order")
        for name in ("valve_discharge", "valve_critical_ratio", "outlet_discharge"):
            if not getattr(self, name) <= 1:
                raise ValueError(f"{name} = {getattr(self, name)!r}: expected at most 1")

    @property
    def vent_area_m2(self) -> float:
        return self.vent_count * math.pi * self.vent_diameter_m**2 / 4

    @property
    def muzzle_area_m2(self) -> float:
        """What the gap at the plate leaves open, at most the bore."""
        return math.pi * self.bore_diameter_m * min(self.plate_gap_m, self.bore_diameter_m / 4)

    def travel_m(self, projectile: Projectile) -> float:
        """From the start to the plate. Raises `ValueError` for a projectile that the barrel cannot shoot."""
        if not projectile.diameter_m < self.bore_diameter_m:
            raise ValueError(f"diameter_m = {projectile.diameter_m!r}: expected less than {self.bore_diameter_m} m")
        travel = self.barrel_length_m + self.plate_gap_m - projectile.length_m
        if not max(self.vent_position_m, self.laser_position_m) < travel:
            raise ValueError(f"length_m = {projectile.length_m!r}: it would strike before its tail is past the laser")
        return travel
