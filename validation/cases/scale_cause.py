"""A case with a cause of a given gap over floor."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from .case import TIERS, Case
from .cause import ActingCause
from .effect_ranges import RANGES, cause_of, largest, shown_by, signs, strength_for
from .effect_size import gap
from .order import places
from .unknowns import FAMILIES

#: Standard error of a configuration's mean, in tolerances.
FLOORS = (0.6, 1.3)


def inside(case: Case, tier: tuple[float, float]) -> bool:
    """Whether gap over floor lies in a range."""
    return tier[0] <= ratio_of(case) < tier[1]


def ratio_of(case: Case) -> float:
    """Gap over floor."""
    return gap(case.kind, case.design, whole_cause(case)) / case.floor


def whole_cause(case: Case) -> ActingCause:
    """What acts in a case."""
    drifting = case.unknown is not None and FAMILIES[case.unknown].drift
    order = places(case) if drifting else ()
    return ActingCause(tuple(sorted(case.strengths.items())), case.unknown or "", case.amount, order, case.laws)


def with_cause(case: Case, name: str, rng: np.random.Generator) -> Case | None:
    """The case with an effect or family in its tier, or near it; None where the plan cannot show it."""
    if name not in FAMILIES and name not in shown_by(case.kind, case.design):
        return None
    low, high = TIERS[case.tier]
    ratio = math.exp(rng.uniform(math.log(low * 1.05), math.log(high * 0.95)))
    return sized(case, name, int(rng.choice(signs(name, case.laws))), ratio, rng)


def sized(case: Case, name: str, sign: int, ratio: float, rng: np.random.Generator) -> Case:
    """The case with a cause of a given gap over floor; where the strongest is too weak, with less noise."""
    if name in FAMILIES and FAMILIES[name].drift:
        case = replace(case, blocked=True)
    order = places(case) if name in FAMILIES else ()
    noise_is_free = name in RANGES and RANGES[name].low > 0  # what is known of it leaves only the noise free
    fitted_strength = (
        None
        if noise_is_free
        else strength_for(case.kind, case.design, name, sign, ratio * case.floor, order, case.laws)
    )
    strength = (
        float(rng.uniform(RANGES[name].low, RANGES[name].high))
        if noise_is_free
        else fitted_strength or largest(name, sign, case.laws)
    )
    if fitted_strength is None:
        reached = gap(case.kind, case.design, cause_of(name, strength, order, case.laws))
        case = replace(case, floor=min(max(reached / ratio, FLOORS[0]), FLOORS[1]))
    if name in FAMILIES:
        return replace(case, unknown=name, amount=strength)
    return replace(case, strengths={name: strength})
