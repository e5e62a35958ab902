"""What is bolted together: the gun, its surroundings and the projectile. Lengths from the valve,
along the barrel.

One shot's figures: the build as the effects and the scatter of this shot leave it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from ..effects import Effects
from .gas import GAS_CONSTANT, Gas, ValveWay


def _check_positive(part: object, zero_allowed: frozenset[str] = frozenset()) -> None:
    for field in fields(part):  # type: ignore[arg-type]
        value = getattr(part, field.name)
        low = value >= 0 if field.name in zero_allowed else value > 0
        if not (math.isfinite(value) and low):
            expected = "0 or more" if field.name in zero_allowed else "a positive number"
            raise ValueError(f"{field.name} = {value!r}: expected {expected}")


@dataclass(frozen=True)
class Projectile:
    """A cylinder that slides in the barrel; the standard is the PLA bullet of thesis section
    3.1."""

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
    """The gun of thesis section 2.1.2; where the text gives no figure, the comment says where it
    comes from.

    Raises `ValueError` for figures that are not positive, and for an order along the barrel other
    than vents, laser, muzzle.
    """

    tank_volume_m3: float = 9.5e-3
    tank_wall_m2: float = 0.27  # a cylinder of 9.5 l, twice as long as wide
    bore_diameter_m: float = 0.049
    barrel_length_m: float = 1.56
    vent_position_m: float = 0.885  # section 2.3
    vent_count: int = 6
    vent_diameter_m: float = 0.012  # of the safety pins that fit them
    laser_position_m: float = (
        0.93  # assumed: the aperture next to the vents, where muzzle velocity is defined
    )
    plate_gap_m: float = 0.010  # assumed: the tail of the shortest bullet stays in the barrel
    valve_bore_m: float = 0.050
    valve_opening_time_s: float = (
        0.25  # the controller allows 0.1 s and more; tuned on the five shots of Table 3.1
    )
    valve_discharge: float = 0.70  # a port of sharp edges while the ball turns: 0.6 to 0.8
    valve_critical_ratio: float = 0.35  # ISO 6358 b of ball valves: 0.2 to 0.5
    dead_volume_m3: float = 0.25e-3  # assumed: valve body and nipple, 50 mm wide and 130 mm long
    outlet_discharge: float = 0.65  # vents and the gap at the plate: sharp-edged holes, 0.6 to 0.7
    leak_friction_factor: float = 0.030  # Darcy, smooth walls at Re = 1e4 (Blasius)
    leak_end_losses: float = (
        3.0  # assumed: inlet 0.5 and outlet 1, twice, for body and tip; tuned with the valve
    )
    friction_coefficient: float = 0.30  # PLA on steel, dry
    extra_friction_coefficient: float = 0.30  # a printed bullet that rubs askew
    breakaway_force_n: float = 1.5  # assumed, as much as its weight
    stribeck_velocity_m_s: float = 0.10
    seal_drag_share: float = (
        0.02  # assumed: friction 0.3 on a land 0.8 mm wide that the gas presses on the wall
    )
    tank_heat_transfer_w_m2_k: float = 50.0  # vessels that discharge in a second: 10 to 100
    barrel_heat_transfer_w_m2_k: float = 60.0  # turbulent pipe flow at 15 m/s
    entrance_loss: float = 0.5
    atmosphere_pa: float = 101_325.0
    temperature_k: float = 293.15

    def __post_init__(self) -> None:
        losses = {
            "breakaway_force_n",
            "seal_drag_share",
            "entrance_loss",
            "leak_friction_factor",
            "dead_volume_m3",
        }
        _check_positive(
            self, frozenset(losses | {"friction_coefficient", "extra_friction_coefficient"})
        )
        stations = (self.vent_position_m, self.laser_position_m, self.barrel_length_m)
        if not stations[0] < stations[1] < stations[2]:
            raise ValueError(
                f"vents, laser, muzzle at {stations} m from the valve: expected this order"
            )
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
        """Way of the projectile's tail from the start to the plate, in m.

        Parameters:
            projectile: What is shot.

        Raises:
            ValueError: For a projectile that the barrel cannot shoot.
        """
        if not projectile.diameter_m < self.bore_diameter_m:
            raise ValueError(
                f"diameter_m = {projectile.diameter_m!r}: "
                f"expected less than {self.bore_diameter_m} m"
            )
        travel = self.barrel_length_m + self.plate_gap_m - projectile.length_m
        if not max(self.vent_position_m, self.laser_position_m) < travel:
            raise ValueError(
                f"length_m = {projectile.length_m!r}: it would strike before "
                f"its tail is past the laser"
            )
        return travel


#: Without an atmosphere a trace of air is left, so that every chamber has a temperature.
VACUUM_PA = 1e-2
#: Without dead volume this much is left behind a valve: no chamber of a finite inflow is empty.
SMALLEST_BREECH_M3 = 2e-6
#: Air that moves outside an open pipe's end, in diameters.
END_CORRECTION = 0.6
#: A weaker effect of the valve is none: it changes the velocity by 1e-4, and is a hundred times
#: stiffer to integrate.
WEAKEST_VALVE = 0.01
#: Scatter of valve, leak and friction from shot to shot (relative standard deviations) at strength
#: 1 of `bench.hand_scatter`.
SCATTERS = np.array([0.03, 0.05, 0.15])


@dataclass(frozen=True, slots=True)
class GunSetting:
    """Effective areas hold their discharge coefficients; `merged`: no valve between tank and
    barrel."""

    tank_volume_m3: float
    breech_volume_m3: float
    muzzle_m: float
    travel_m: float
    end_m: float
    area_m2: float
    mass_kg: float
    length_m: float
    bore_m: float
    ambient: Gas
    tank_pressure_pa: float
    merged: bool
    valve_area_m2: float
    critical_ratio: float
    leak_area_m2: float
    vent_area_m2: float
    vent_position_m: float
    vent_radius_m: float
    muzzle_area_m2: float
    coulomb_force_n: float
    breakaway_force_n: float
    stribeck_velocity_m_s: float
    seal_area_m2: float
    column_losses: float
    entrance_loss: float
    tank_heat_w_k: float
    barrel_heat_w_m_k: float
    valve_way: ValveWay


def setting_of(
    gun: GunBuild,
    effects: Effects,
    tank_pressure_pa: float,
    projectile: Projectile,
    rng: np.random.Generator,
    valve_way: ValveWay | None = None,
) -> GunSetting:
    """What each strength means, at strength s:

    - `gun.back_pressure`: the surroundings have s times the atmosphere, and tank and force are
      absolute against it (0: vacuum, and the gauge pressure is all there is);
    - `gun.blow_by`: s times the clearance; `gun.dead_volume`: s times the volume;
    - `gun.valve_flow`: every moment of the valve's way s times as late, and 1/s of the area (below
      0.01: tank and barrel are one volume);
    - `gun.barrel_loss`, `gun.heat_exchange`: s times the wall's friction, the heat transfer;
    - `gun.sliding_friction`: s times extra friction, breakaway and seal drag; the nominal Coulomb
      friction stays.

    Parameters:
        gun: The gun as it is built.
        effects: Which effects act, and how strongly.
        tank_pressure_pa: The gauge pressure of the tank before the shot.
        projectile: What is shot.
        rng: Generator of random numbers, of which three are drawn whatever the strength of
            `bench.hand_scatter`.
        valve_way: How the valve's ball turns; by default the valve opens within the gun's own time
            and stays open.

    Raises:
        ValueError: For a projectile that the barrel cannot shoot.
    """
    scatter = np.exp(effects["bench.hand_scatter"] * rng.standard_normal(3) * SCATTERS).tolist()
    valve, friction = effects["gun.valve_flow"], scatter[2]
    valve = valve if valve >= WEAKEST_VALVE else 0.0
    ambient_pa = max(effects["gun.back_pressure"] * gun.atmosphere_pa, VACUUM_PA)
    extra = effects["gun.sliding_friction"] * friction
    heat = effects["gun.heat_exchange"]
    weight = projectile.mass_kg * 9.80665
    dead = effects["gun.dead_volume"] * gun.dead_volume_m3
    valve_way = valve_way or ValveWay((0.0, gun.valve_opening_time_s), (0.0, 1.0))
    return GunSetting(
        tank_volume_m3=gun.tank_volume_m3,
        breech_volume_m3=max(dead, SMALLEST_BREECH_M3 if valve else 0.0),
        muzzle_m=gun.barrel_length_m,
        travel_m=gun.travel_m(projectile),
        end_m=gun.plate_gap_m + END_CORRECTION * gun.bore_diameter_m,
        area_m2=projectile.area_m2,
        mass_kg=projectile.mass_kg,
        length_m=projectile.length_m,
        bore_m=gun.bore_diameter_m,
        ambient=Gas(ambient_pa, gun.temperature_k, ambient_pa / (GAS_CONSTANT * gun.temperature_k)),
        tank_pressure_pa=tank_pressure_pa + ambient_pa,
        merged=valve == 0,
        valve_area_m2=0.0
        if valve == 0
        else gun.valve_discharge * math.pi * gun.valve_bore_m**2 / 4 / valve,
        critical_ratio=gun.valve_critical_ratio,
        leak_area_m2=effects["gun.blow_by"] * scatter[1] * leak_area_m2(gun, projectile),
        vent_area_m2=gun.outlet_discharge * gun.vent_area_m2,
        vent_position_m=gun.vent_position_m,
        vent_radius_m=gun.vent_diameter_m / 2,
        muzzle_area_m2=gun.outlet_discharge * gun.muzzle_area_m2,
        coulomb_force_n=(
            gun.friction_coefficient * friction + gun.extra_friction_coefficient * extra
        )
        * weight,
        breakaway_force_n=extra * gun.breakaway_force_n,
        stribeck_velocity_m_s=gun.stribeck_velocity_m_s,
        seal_area_m2=extra * gun.seal_drag_share * projectile.area_m2,
        column_losses=effects["gun.barrel_loss"],
        entrance_loss=gun.entrance_loss,
        tank_heat_w_k=heat * gun.tank_heat_transfer_w_m2_k * gun.tank_wall_m2,
        barrel_heat_w_m_k=heat * gun.barrel_heat_transfer_w_m2_k * math.pi * gun.bore_diameter_m,
        valve_way=valve_way.slowed(valve * scatter[0]) if valve else ValveWay((0.0,), (1.0,)),
    )


def leak_area_m2(gun: GunBuild, projectile: Projectile) -> float:
    """Effective area of the ring between projectile and barrel: its area over sqrt(K + f l / D_h),
    D_h = D - d.

    A long narrow ring is a pipe whose wall friction adds to what inlet and outlet lose.

    Parameters:
        gun: The gun, with the bore D, the friction factor f and the losses K of inlet and outlet.
        projectile: The projectile, with the diameter d and the length l.
    """
    ring = math.pi / 4 * (gun.bore_diameter_m**2 - projectile.diameter_m**2)
    length = projectile.length_m / (gun.bore_diameter_m - projectile.diameter_m)
    return ring / math.sqrt(gun.leak_end_losses + gun.leak_friction_factor * length)
