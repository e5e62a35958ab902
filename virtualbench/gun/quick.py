"""The muzzle velocity of a shot alone: the same integration as `fire`, which ends when the tail reaches the vents."""

from __future__ import annotations

import numpy as np

from ..effects import Effects
from .build import GunBuild, Projectile
from .integrate import CHUNK_S, advance, up_to
from .motion import Phase, V, X, initial_state
from .setting import setting_of

__all__ = ["muzzle_velocity"]


def muzzle_velocity(
    gun: GunBuild,
    effects: Effects,
    tank_pressure_pa: float,
    projectile: Projectile,
    rng: np.random.Generator,
    *,
    until_s: float = 1.2,
) -> float:
    """`fire(...).muzzle_velocity_m_s` (m/s); 0 for a projectile that does not reach the vents until `until_s`."""
    setting = setting_of(gun, effects, tank_pressure_pa, projectile, rng)
    stops = [*setting.valve_way.kinks_s, until_s]
    start, state, phase = 0.0, initial_state(setting), Phase(held=False, sealed=True)
    while start < until_s - 1e-9:
        stop = min([moment for moment in stops if moment > start + 1e-6] + [start + CHUNK_S])
        time, states = advance(setting, state, start, stop, phase, 1.0)
        if np.any(states[:, X] >= gun.vent_position_m):
            past = int(np.argmax(states[:, X] >= gun.vent_position_m))
            return float(up_to(setting, time, states, past, gun.vent_position_m, phase)[1][-1, V])
        if states[-1, X] < -1e-3:
            return 0.0
        start, state = stop, states[-1]
    return 0.0
