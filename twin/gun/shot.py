"""What a shot of the gun is made of: the quantities through which effects meet.

What an effect of the gun may do.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, Self, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...array_types import Floats
from ...signals.valve_profile import ValveProfile
from ..effects import Effect
from .bench import STANDARD_GRAVITY_M_S2, GunBench, checked

#: Of dry air, J/(kg K).
GAS_CONSTANT = 287.05
#: Standard atmosphere, ISO 2533, and a room.
ATMOSPHERE_PA = 101_325.0
#: What surrounds a gun whose law knows gauge pressure only: a thousandth of an atmosphere, so that
#: gas which has leaked away keeps a temperature.
VACUUM_PA = 100.0
ROOM_K = 293.15


@dataclass(frozen=True, eq=False)
class ShotInputs:
    """n shots, SI; every array but the valve's profile is (n,). Effects replace fields before the
    shots are fired.

    The gas law is that of eq. 2.15 for gauge pressure plus `opposing_pressure_pa`: with 0 it is the
    nominal law of gauge pressure, a gun in a vacuum whose tank holds the gauge pressure; with the
    atmosphere it is the law of absolute pressure. Flows past the projectile and through the valve
    see the same surroundings.
    """

    tank_pressure_pa: Floats  # gauge
    bullet_mass_kg: Floats
    tank_volume_m3: Floats
    dead_volume_m3: (
        Floats  # between tank and projectile, at the atmosphere's pressure until the shot
    )
    area_m2: Floats  # that the gas pushes on
    travel_m: Floats
    bore_diameter_m: Floats
    projectile_diameter_m: Floats
    friction_n: Floats
    heat_capacity_ratio: float
    polytropic_index: Floats  # takes the heat capacity ratio's place in eq. 2.15
    opposing_pressure_pa: Floats  # ahead of the projectile, as far as the law knows it
    temperature_k: Floats  # of the tank, and outside
    valve_area_m2: Floats  # of flow, wide open; infinite: no valve
    opening_time_s: Floats
    # (n, 2, k): moments and positions, in place of the opening time; NaN where none is stated
    valve_profile: Floats
    leak_area_m2: Floats  # of flow past the projectile
    gauge_leak_area_m2: Floats  # of flow that is choked at gauge pressure
    friction_factor: Floats  # Darcy's, of the gas along the bore
    air_heads: Floats  # dynamic heads of outside air, lost at the projectile's speed
    valve_air_heads: Floats  # those of `air_heads` that are lost in the valve
    gas_heads: Floats  # dynamic heads of the driving gas, likewise

    def __len__(self) -> int:
        return len(self.tank_pressure_pa)

    @property
    def atmosphere_pa(self) -> Floats:
        """Absolute pressure of the surroundings: what opposes the projectile, and a trace of air
        without it."""
        return np.maximum(self.opposing_pressure_pa, VACUUM_PA)

    @property
    def pressure_zero_pa(self) -> Floats:
        """The absolute pressure at which the law's pressure is 0."""
        return np.asarray(self.atmosphere_pa - self.opposing_pressure_pa)

    @property
    def driving_pressure_pa(self) -> Floats:
        """The law's pressure of the tank."""
        return np.asarray(self.tank_pressure_pa + self.opposing_pressure_pa)

    @property
    def volume_m3(self) -> Floats:
        """Of tank and dead volume."""
        return np.asarray(self.tank_volume_m3 + self.dead_volume_m3)

    @property
    def filled_pressure_pa(self) -> Floats:
        """The law's pressure once tank and dead volume are one: the sum of p V is kept, as no work
        is done."""
        energy = (
            self.driving_pressure_pa * self.tank_volume_m3
            + self.opposing_pressure_pa * self.dead_volume_m3
        )
        return np.asarray(energy / self.volume_m3)

    def take(self, rows: NDArray[np.intp]) -> Self:
        """Some of the shots.

        Parameters:
            rows: Their row numbers.
        """
        values: dict[str, Any] = {item.name: getattr(self, item.name) for item in fields(self)}
        some = {
            name: value[rows] for name, value in values.items() if isinstance(value, np.ndarray)
        }
        return replace(self, **cast(dict[str, Any], some))

    def but(self, **changed: ArrayLike) -> Self:
        """The same shots with other values.

        Parameters:
            changed: The new value of a field by its name, SI: one for all shots, or one for each
                (n,).

        Raises:
            ValueError: For the wrong number of values.
        """
        arrays: dict[str, Any] = {
            name: self._for_each(name, value) for name, value in changed.items()
        }
        return replace(self, **arrays)

    def _for_each(self, name: str, value: ArrayLike) -> Floats:
        values = np.asarray(value, dtype=np.float64)
        if values.shape not in ((), (len(self),)):
            raise ValueError(
                f"{name} has shape {values.shape}: expected one value, or one "
                f"for each of {len(self)} shots"
            )
        return np.broadcast_to(values, (len(self),))


def nominal_shot(
    bench: GunBench, tank_pressure_pa: ArrayLike, bullet_mass_kg: ArrayLike
) -> ShotInputs:
    """Shots of the nominal gun: pressures and masses broadcast to (n,).

    Parameters:
        bench: The gun.
        tank_pressure_pa: Gauge pressure of the tank, a number or an array (n,).
        bullet_mass_kg: Mass of the bullet, a number or an array (n,).

    Raises:
        ValueError: As `muzzle_velocity`, and for more than one dimension.
    """
    pressure, mass = np.broadcast_arrays(
        checked("tank_pressure_pa", tank_pressure_pa, zero_allowed=True),
        checked("bullet_mass_kg", bullet_mass_kg),
    )
    pressure, mass = np.atleast_1d(pressure), np.atleast_1d(mass)
    if pressure.ndim != 1:
        raise ValueError(
            f"tank pressures and bullet masses have shape {pressure.shape}: expected (n,)"
        )

    def each(value: float) -> Floats:
        return np.broadcast_to(np.float64(value), pressure.shape)

    return ShotInputs(
        tank_pressure_pa=pressure,
        bullet_mass_kg=mass,
        tank_volume_m3=each(bench.tank_volume_m3),
        dead_volume_m3=each(0.0),
        area_m2=each(bench.projectile_area_m2),
        travel_m=each(bench.travel_m),
        bore_diameter_m=each(bench.bore_diameter_m),
        projectile_diameter_m=each(bench.projectile_diameter_m),
        friction_n=np.asarray(bench.friction_coefficient * STANDARD_GRAVITY_M_S2 * mass),
        heat_capacity_ratio=bench.heat_capacity_ratio,
        polytropic_index=each(bench.heat_capacity_ratio),
        opposing_pressure_pa=each(0.0),
        temperature_k=each(ROOM_K),
        valve_area_m2=each(math.inf),
        opening_time_s=each(0.0),
        valve_profile=np.empty((len(pressure), 2, 0)),
        leak_area_m2=each(0.0),
        gauge_leak_area_m2=each(0.0),
        friction_factor=each(0.0),
        air_heads=each(0.0),
        valve_air_heads=each(0.0),
        gas_heads=each(0.0),
    )


def profile_table(profiles: Sequence[ValveProfile | None]) -> Floats:
    """Moments and positions of n profiles, (n, 2, k) for the longest of k points; shorter ones
    repeat their last point.

    Parameters:
        profiles: How the valve is opened and closed, for each shot; None for a shot without a
            profile, which has NaN.

    Returns:
        For each shot a row of moments in s and a row of positions, 0 (shut) to 1 (open).
    """
    longest = max((len(profile.time_s) for profile in profiles if profile is not None), default=0)
    table = np.full((len(profiles), 2, longest), np.nan)
    for row, profile in zip(table, profiles, strict=True):
        if profile is not None:
            spare = longest - len(profile.time_s)
            row[0] = np.pad(profile.time_s, (0, spare), mode="edge")
            row[1] = np.pad(profile.position, (0, spare), mode="edge")
    return table


@dataclass(frozen=True, eq=False)
class Instant:
    """n shots at one instant of each, as hooks see them; pressures absolute, gas behind the
    projectile.

    All (n,), or (m, n) for m instants of each: hooks reckon element by element.
    """

    time_s: Floats
    position_m: Floats
    velocity_m_s: Floats  # not negative
    gas_pressure_pa: Floats
    gas_temperature_k: Floats
    gas_density_kg_m3: Floats


@dataclass(frozen=True)
class GunEffect(Effect):
    """An effect of the gun. It overrides one of the hooks; each does nothing by default.

    `prepare` fills the fields of `ShotInputs`; most effects need no more. A law that no field can
    express overrides `resistance_n` or `leak_kg_s`; shots with such an effect take longer, as a
    hook is no part of the compiled motion.
    """

    #: Whether the motion must be integrated, as the closed form does not know what the effect
    #: changes. True for every effect with `resistance_n` or `leak_kg_s`.
    moves: ClassVar[bool] = False

    def prepare(self, shot: ShotInputs) -> ShotInputs:
        """The shot with other quantities. The result must not depend on the order of effects.

        Parameters:
            shot: n shots, as effects before this one have changed them.
        """
        return shot

    def resistance_n(self, shot: ShotInputs, instant: Instant) -> Floats | float:  # noqa: ARG002
        """A force against the motion, not negative; 0 at rest.

        Parameters:
            shot: n shots.
            instant: Where each shot is now, arrays (n,) or (m, n).

        Returns:
            One force for all, or an array of the shape of the instant.
        """
        return 0.0

    def leak_kg_s(self, shot: ShotInputs, instant: Instant) -> Floats | float:  # noqa: ARG002
        """Gas that escapes from behind the projectile; negative where it comes in.

        Parameters:
            shot: n shots.
            instant: Where each shot is now, arrays (n,) or (m, n).

        Returns:
            One flow for all, or an array of the shape of the instant.
        """
        return 0.0

    @classmethod
    def has_hooks(cls) -> bool:
        """Whether `resistance_n` or `leak_kg_s` is there."""
        return (
            cls.resistance_n is not GunEffect.resistance_n
            or cls.leak_kg_s is not GunEffect.leak_kg_s
        )

    def off(self, shots: int) -> NDArray[np.bool_]:
        """Where every parameter has the value at which the effect does nothing, (n,).

        Parameters:
            shots: n, the number of shots.
        """
        result = np.ones(shots, dtype=bool)
        for item in self.parameters():
            result &= np.asarray(getattr(self, item.name)) == item.off
        return result

    def take(self, rows: NDArray[np.intp]) -> Self:
        """The effect on some of the shots.

        Parameters:
            rows: Their row numbers.
        """
        values = {item.name: np.asarray(getattr(self, item.name)) for item in self.parameters()}
        return replace(self, **{name: value[rows] for name, value in values.items() if value.ndim})
