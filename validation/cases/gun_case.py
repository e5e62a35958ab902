"""What a withheld campaign's gun does: the muzzle velocity of each configuration, from the bench's
gas dynamics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from ...array_types import Floats
from ...virtualbench.effects import Effects, EffectSwitch
from ...virtualbench.gun.build import GunBuild, Projectile
from ...virtualbench.gun.integrate import muzzle_velocity
from ...virtualbench.recorder import Value
from ...virtualbench.second_laws.gun import muzzle_velocity_m_s
from ...virtualbench.second_laws.sensors import pressure_bar, velocity_factor
from .designs import CaseSetting, design

_FIXED_POINT_STEPS = 30


@lru_cache(maxsize=64)
def gun_of(kind: str, number: int) -> GunBuild:
    """The gun of a plan: each has its own tank and friction, and its own losses, where an effect
    lets them act."""
    rng = np.random.default_rng([number, *kind.encode(), 1])
    build = GunBuild()
    size = float(rng.choice([1.0, 0.6, 0.35, 0.25]))  # a small tank expands more
    return replace(
        build,
        tank_volume_m3=size * build.tank_volume_m3,
        tank_wall_m2=size ** (2 / 3) * build.tank_wall_m2,
        friction_coefficient=float(rng.choice([0.1, 0.2, 0.3])),
        valve_opening_time_s=build.valve_opening_time_s * float(rng.uniform(0.2, 1.0)),
        valve_critical_ratio=float(rng.uniform(0.25, 0.5)),
        leak_friction_factor=float(rng.uniform(0.02, 0.05)),
        leak_end_losses=float(rng.uniform(2.0, 4.0)),
        stribeck_velocity_m_s=float(rng.uniform(0.05, 0.3)),
        seal_drag_share=float(rng.choice([0.0, 0.002, 0.005, 0.01, 0.03])),
    )


def gun_stage(kind: str, number: int) -> dict[str, Value]:
    """`[bench.gun]`: what the lab believes."""
    gun = gun_of(kind, number)
    return {
        "tank_volume_m3": gun.tank_volume_m3,
        "bore_diameter_m": gun.bore_diameter_m,
        "projectile_diameter_m": Projectile().diameter_m,
        "travel_m": gun.vent_position_m,
        "friction_coefficient": gun.friction_coefficient,
        "heat_capacity_ratio": 1.4,
        "efficiency": 1.0,
    }


def ln_velocity(kind: str, number: int, strengths: Mapping[str, float], laws: str = "") -> Floats:
    """ln of the recorded velocity (C,) of a plan's configurations; -inf where a shot does not leave
    the barrel."""
    acting = {
        name: value
        for name, value in strengths.items()
        if name.startswith(("gun.", "sensor.pressure"))
    }
    with np.errstate(divide="ignore"):
        true = np.log(np.array(_velocities(kind, number, tuple(sorted(acting.items())), laws)))
    return np.asarray(true + ln_reading(design(kind, number), true, strengths, laws))


def ln_reading(
    settings: Sequence[CaseSetting], ln_true: Floats, strengths: Mapping[str, float], laws: str = ""
) -> Floats:
    """ln of recorded over true velocity (n,) at true ones."""
    gain = strengths.get("sensor.velocity_gain", 0.0)
    if not laws or not gain:
        return np.full(len(settings), np.log1p(gain))
    masses, tips = np.array([s.mass_kg for s in settings]), [s.tip_material for s in settings]
    hand = not settings[0].tank_pressure_bar
    return np.asarray(np.log(velocity_factor(np.exp(ln_true), masses, tips, gain, laws, hand=hand)))


def ln_truth(
    settings: Sequence[CaseSetting], ln_read: Floats, strengths: Mapping[str, float], laws: str = ""
) -> Floats:
    """ln of the true velocities (n,) of recorded ones: the inverse of `ln_reading`, by a fixed
    point."""
    ln_true = ln_read
    for _ in range(_FIXED_POINT_STEPS if laws else 1):
        ln_true = ln_read - ln_reading(settings, ln_true, strengths, laws)
    return np.asarray(ln_true)


@lru_cache(maxsize=4096)
def _velocities(
    kind: str, number: int, strengths: tuple[tuple[str, float], ...], laws: str
) -> tuple[float, ...]:
    given, gun = dict(strengths), gun_of(kind, number)
    if laws:
        return tuple(
            muzzle_velocity_m_s(
                gun, given, laws, true_pressure_pa(s, given, laws), Projectile(s.mass_kg)
            )
            for s in design(kind, number)
        )
    effects = Effects(
        tuple(
            EffectSwitch(name, strength=value)
            for name, value in strengths
            if name.startswith("gun.")
        )
    )
    rng = np.random.default_rng(0)
    return tuple(
        muzzle_velocity(
            gun, effects, true_pressure_pa(setting, given), Projectile(setting.mass_kg), rng
        )
        for setting in design(kind, number)
    )


def true_pressure_pa(setting: CaseSetting, strengths: Mapping[str, float], laws: str = "") -> float:
    """The pressure (Pa, gauge) that the transducer reads as the plan's."""
    if laws:
        return 1e5 * pressure_bar(setting.tank_pressure_bar, strengths, laws)
    read = setting.tank_pressure_bar - strengths.get("sensor.pressure_offset", 0.0)
    return max(0.0, read / (1 + strengths.get("sensor.pressure_gain", 0.0))) * 1e5
