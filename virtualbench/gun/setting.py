"""One shot's figures: the build as the effects and the scatter of this shot leave it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..effects import Effects
from .build import GunBuild, Projectile
from .gas import GAS_CONSTANT, Gas
from .valve import ValveWay

__all__ = ["GunSetting", "setting_of"]

#: Without an atmosphere a trace of air is left, so that every chamber has a temperature.
VACUUM_PA = 1e-2
#: Without dead volume this much is left behind a valve: no chamber of a finite inflow is empty.
SMALLEST_BREECH_M3 = 2e-6
#: Air that moves outside an open pipe's end, in diameters.
END_CORRECTION = 0.6
#: A weaker effect of the valve is none: it changes the velocity by 1e-4, and is a hundred times stiffer to integrate.
WEAKEST_VALVE = 0.01
#: Scatter from shot to shot (relative standard deviations) at strength 1 of `bench.hand_scatter`.
VALVE_SCATTER, LEAK_SCATTER, FRICTION_SCATTER = 0.03, 0.05, 0.15


@dataclass(frozen=True, slots=True)
class GunSetting:
    """Effective areas hold their discharge coefficients; `merged`: no valve between tank and barrel."""

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

    - `gun.back_pressure`: the surroundings have s times the atmosphere, and tank and force are absolute against it
      (0: vacuum, and the gauge pressure is all there is);
    - `gun.blow_by`: s times the clearance; `gun.dead_volume`: s times the volume;
    - `gun.valve_flow`: every moment of the valve's way s times as late, and 1/s of the area (below 0.01: tank and
      barrel are one volume);
    - `gun.barrel_loss`, `gun.heat_exchange`: s times the wall's friction, the heat transfer;
    - `gun.sliding_friction`: s times extra friction, breakaway and seal drag; the nominal Coulomb friction stays.

    Without a `valve_way` the valve opens within the gun's own time and stays open. Three numbers are drawn from `rng`
    whatever the strength of `bench.hand_scatter`.
    """
    scatter = np.exp(effects["bench.hand_scatter"] * rng.standard_normal(3) * SCATTERS).tolist()
    valve, friction = effects["gun.valve_flow"], scatter[2]
    valve = valve if valve >= WEAKEST_VALVE else 0.0
    ambient_pa = max(effects["gun.back_pressure"] * gun.atmosphere_pa, VACUUM_PA)
    extra = effects["gun.sliding_friction"] * friction
    heat = effects["gun.heat_exchange"]
    weight = projectile.mass_kg * 9.80665
    dead = effects["gun.dead_volume"] * gun.dead_volume_m3
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
        valve_area_m2=0.0 if valve == 0 else gun.valve_discharge * math.pi * gun.valve_bore_m**2 / 4 / valve,
        critical_ratio=gun.valve_critical_ratio,
        leak_area_m2=effects["gun.blow_by"] * scatter[1] * leak_area_m2(gun, projectile),
        vent_area_m2=gun.outlet_discharge * gun.vent_area_m2,
        vent_position_m=gun.vent_position_m,
        vent_radius_m=gun.vent_diameter_m / 2,
        muzzle_area_m2=gun.outlet_discharge * gun.muzzle_area_m2,
        coulomb_force_n=(gun.friction_coefficient * friction + gun.extra_friction_coefficient * extra) * weight,
        breakaway_force_n=extra * gun.breakaway_force_n,
        stribeck_velocity_m_s=gun.stribeck_velocity_m_s,
        seal_area_m2=extra * gun.seal_drag_share * projectile.area_m2,
        column_losses=effects["gun.barrel_loss"],
        entrance_loss=gun.entrance_loss,
        tank_heat_w_k=heat * gun.tank_heat_transfer_w_m2_k * gun.tank_wall_m2,
        barrel_heat_w_m_k=heat * gun.barrel_heat_transfer_w_m2_k * math.pi * gun.bore_diameter_m,
        valve_way=_way(valve_way or ValveWay((0.0, gun.valve_opening_time_s), (0.0, 1.0)), valve, scatter[0]),
    )


def _way(way: ValveWay, valve: float, scatter: float) -> ValveWay:
    """As slow as effect and scatter make it; without a valve it is open from the beginning."""
    return way.slowed(valve * scatter) if valve else ValveWay((0.0,), (1.0,))


SCATTERS = np.array([VALVE_SCATTER, LEAK_SCATTER, FRICTION_SCATTER])


def leak_area_m2(gun: GunBuild, projectile: Projectile) -> float:
    """Effective area of the ring between projectile and barrel: its area over sqrt(K + f l / D_h), D_h = D - d.

    A long narrow ring is a pipe whose wall friction adds to what inlet and outlet lose.
    """
    ring = math.pi / 4 * (gun.bore_diameter_m**2 - projectile.diameter_m**2)
    length = projectile.length_m / (gun.bore_diameter_m - projectile.diameter_m)
    return ring / math.sqrt(gun.leak_end_losses + gun.leak_friction_factor * length)
