"""The two impactors of the thesis: the hammer in the hand, and the projectile of the gun."""

from __future__ import annotations

import math

import numpy as np

from ..effects import Effects
from .build import Impactor
from .materials import contact_material

__all__ = ["HAND_SPEEDS_M_S", "HAND_SPREAD", "hammer", "hand_speed", "projectile"]

#: Nominal speeds of the two levels of Table 4.1, which gives none: a tap and a blow.
HAND_SPEEDS_M_S = {"low": 0.8, "high": 1.8}
#: Standard deviation of the logarithm of a hand's speed at one level.
HAND_SPREAD = 0.10


def hammer(tip_material: str, tip_radius_m: float, *, mass_kg: float = 0.32) -> Impactor:
    """The instrumented hammer of the thesis: load cell at the front, accelerometer at the rear of the head.

    The rear fifth rings on the neck of the head at 7 kHz. The wave along the head takes 12.4 us (thesis, section 4.1);
    with the phase of the charge amplifier the lag is put at 25 us, between one and two samples of 51.2 kHz.
    """
    tip = contact_material(tip_material)
    height = 0.015 if tip.polymer else math.inf
    return Impactor(
        tip,
        tip_radius_m,
        mass_kg,
        tip_height_m=height,
        tip_mass_kg=0.04 * mass_kg,
        rear_fraction=0.2,
        rear_resonance_hz=7000.0,
        rear_damping=0.03,
        wave_delay_s=25e-6,
        mass_spread=0.03,
        radius_spread=0.08,
    )


def projectile(mass_kg: float, tip_material: str, tip_radius_m: float) -> Impactor:
    """The bullet: one rigid body whose tip meets the target a little off its axis."""
    tip = contact_material(tip_material)
    height = 0.030 if tip.polymer else math.inf
    return Impactor(
        tip, tip_radius_m, mass_kg, tip_height_m=height, mass_error=0.01, mass_spread=0.001, radius_spread=0.03
    )


def hand_speed(level: str, effects: Effects, rng: np.random.Generator) -> float:
    """The speed (m/s) of one blow at a level, with the operator's scatter. Raises `ValueError` for another level."""
    if level not in HAND_SPEEDS_M_S:
        raise ValueError(f"hammer speed {level!r}: expected one of {', '.join(HAND_SPEEDS_M_S)}")
    scatter = HAND_SPREAD * effects["bench.hand_scatter"] * float(rng.standard_normal())
    return HAND_SPEEDS_M_S[level] * math.exp(scatter)
