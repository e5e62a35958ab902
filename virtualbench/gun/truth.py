"""What really happened in one shot."""

from __future__ import annotations

from dataclasses import dataclass

from ...array_types import Floats

__all__ = ["Ledger", "ShotTruth"]


@dataclass(frozen=True)
class Ledger:
    """The books of a shot (n,): what the chambers hold, and what has left them since the start."""

    gas_mass_kg: Floats
    gas_energy_j: Floats
    mass_out_kg: Floats
    energy_out_j: Floats
    heat_in_j: Floats
    resisted_j: Floats


@dataclass(frozen=True)
class ShotTruth:
    """Arrays are (n,) over `time_s`, which increases from 0, the moment at which the valve begins to turn.

    Pressures are gauge against the surroundings. A projectile that does not reach the vents has muzzle velocity 0 and
    exit time NaN; one that does not reach the plate has impact velocity 0 and impact time NaN.
    """

    time_s: Floats
    tank_pressure_pa: Floats
    breech_pressure_pa: Floats
    ahead_pressure_pa: Floats
    position_m: Floats  # of the projectile's tail, from where it starts
    velocity_m_s: Floats
    muzzle_velocity_m_s: float  # when the tail reaches the vents (thesis, section 2.3)
    exit_time_s: float
    impact_velocity_m_s: float  # when the nose first meets the plate
    impact_time_s: float
    laser_blocked: tuple[tuple[float, float], ...]  # (start_s, stop_s) of each whole passage, there and back
    laser_position_m: float
    ledger: Ledger
    port_opens_s: float = 0.0  # the ball turns before its port opens; infinite where it never does
