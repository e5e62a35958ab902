"""A shot of the virtual gun as a campaign takes it, for what looks at one shot alone."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from pyroshock.virtualbench.campaigns import gun
from pyroshock.virtualbench.campaigns.base import Taken
from pyroshock.virtualbench.effects import Effects

#: A row of a gun's plan.
GUN_ROW = {
    "run": "3", "plate_material": "aluminum", "anvil_material": "none", "insulator": "none",
    "tip_material": "PLA",
    "tip_radius_mm": "30", "bullet_mass_kg": "0.2", "tank_pressure_bar": "1.5",
}  # fmt: skip


def shot(effects: Effects, seed: int = 1, **other: str) -> Taken:
    """`GUN_ROW` with some cells other, fired once. Ask for `coarse_plates` beside it, or wait for
    the plate."""
    row: Mapping[str, str] = {**GUN_ROW, **other}
    bench = gun.set_up([row], effects, np.random.default_rng(0))
    (task,) = bench.tasks([row], 1)
    return bench.take(task, np.random.default_rng(seed))
