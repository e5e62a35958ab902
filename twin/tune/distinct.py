"""Proposals that differ: what the bench cannot set apart, or a sensor cannot tell apart, is one proposal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..setting import Setting
from .probability import Proposal

#: What the regulator is set to, what a bullet is weighed to, and what a tip is turned to.
PRESSURE_STEP_PA, MASS_STEP_KG, RADIUS_STEP_M = 5e3, 0.01, 5e-4
#: Expected spectra that lie nearer than this at every line are the same: a third of the scatter from shot to shot.
SAME_SPECTRUM_DB = 0.25


def distinct(ranked: Sequence[Proposal]) -> list[Proposal]:
    """Ranked proposals, in their order; of those that are alike the first, with the others as its `alternatives`."""
    kept: list[Proposal] = []
    for proposal in ranked:
        for place, better in enumerate(kept):
            if alike(better, proposal):
                kept[place] = replace(better, alternatives=(*better.alternatives, proposal.setting))
                break
        else:
            kept.append(proposal)
    return kept


def alike(first: Proposal, second: Proposal) -> bool:
    """Whether two proposals are set alike, or promise the same spectrum; both inside or both outside of the domain."""
    if bool(first.outside) != bool(second.outside):
        return False
    nearest_db = float(np.abs(first.level_db - second.level_db).max())
    return nearest_db < SAME_SPECTRUM_DB or set_alike(first.setting, second.setting)


def set_alike(first: Setting, second: Setting) -> bool:
    """Whether the same parts are mounted, and pressure, mass and radius differ by a step of the bench at most."""
    parts = [(s.tip, s.anvil, s.plate, s.insulator, s.impact_position, s.boundary_conditions) for s in (first, second)]
    numbers = np.array([(s.tank_pressure_pa or 0.0, s.impactor_mass_kg, s.tip_radius_m) for s in (first, second)])
    steps = np.array([PRESSURE_STEP_PA, MASS_STEP_KG, RADIUS_STEP_M])
    # Rounding must not set apart what lies one step apart.
    return parts[0] == parts[1] and bool(np.all(np.abs(numbers[0] - numbers[1]) <= steps * (1 + 1e-9)))
