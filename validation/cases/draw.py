"""Draws what a withheld campaign hides: design, cause, strength, background, noise."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from .background import draw_background
from .case import KINDS, STAGES, TIERS, Case
from .designs import DESIGNS, design
from .effect_ranges import RANGES, shown_by, signs
from .scale_cause import FLOORS, inside, ratio_of, sized, with_cause
from .unknowns import FAMILIES, families

#: Share of cases with a nominal figure that is a little off, and by how much at most.
_DECOYS = 0.33
_DECOY_SPREAD = {"gun": 0.006, "contact": 0.01, "plate": 0.03}
_TRIES = 60
#: Two effects: each of them alone, and both together, in floors.
_EACH, _BOTH = 1.5, (3.0, 20.0)


def draw_case(
    kind: str,
    tier: str,
    rng: np.random.Generator,
    *,
    cause: str = "catalogue",
    split: str = "sealed",
    rough: bool = False,
    decoy: bool | None = None,
    number: int | None = None,
) -> Case:
    """A case of a kind ("gun", "hammer", "plate", "chain") whose gap over floor lies in a tier.

    `cause`: "catalogue" (one effect, drawn), "none", "unknown" (a family of `split`), "two" effects, or the name of an
    effect or family. "none" and "two" take no notice of the tier. With a named cause whose physical range does not
    reach the tier the case has what is nearest: `Label.tier` says where it is. `decoy`: whether a nominal figure
    is mis-stated within tolerance (None: in a third of the cases); `number`: the design (None: drawn).
    Raises `ValueError` for unknown words, and for a cause that the kind cannot show.
    """
    _check(kind, tier, cause)
    for _ in range(_TRIES):
        case = base_case(kind, tier, rng, rough=rough, number=number)
        case = replace(case, decoys=_decoys(kind, rng, decoy))
        drawn_case = _CAUSES[cause](case, rng, split) if cause in _CAUSES else with_cause(case, cause, rng)
        if drawn_case:
            return drawn_case
    raise ValueError(f"no {kind} case found in {_TRIES} draws: cause {cause!r}, tier {tier!r}")


def _check(kind: str, tier: str, cause: str) -> None:
    if kind not in KINDS:
        raise ValueError(f"kind {kind!r}: expected one of {', '.join(KINDS)}")
    if tier not in TIERS:
        raise ValueError(f"tier {tier!r}: expected one of {', '.join(TIERS)}")
    cause_names = [*_CAUSES, *RANGES, *FAMILIES]
    if cause not in cause_names:
        raise ValueError(f"cause {cause!r}: expected one of {', '.join(cause_names)}")
    shown = {name for number in range(DESIGNS) for name in shown_by(kind, number)}
    shown |= {name for name, family in FAMILIES.items() if family.stage in STAGES[kind]}
    if cause not in _CAUSES and cause not in shown:
        raise ValueError(f"cause {cause!r}: a {kind} campaign cannot show it")


def base_case(
    kind: str, tier: str, rng: np.random.Generator, *, rough: bool = False, number: int | None = None
) -> Case:
    """A case without a cause: its plan, background, noise and the order of its runs."""
    return Case(
        kind=kind,
        tier=tier,
        design=int(rng.integers(DESIGNS)) if number is None else number,
        repetitions=int(rng.integers(3, 5)),
        floor=float(rng.uniform(*FLOORS)),
        background=draw_background(rng, rough=rough),
        blocked=bool(rng.random() < 0.5),
        sampling_rate_hz=float(rng.choice([51_200.0, 102_400.0])) if kind == "hammer" else 102_400.0,
    )


def _decoys(kind: str, rng: np.random.Generator, wanted: bool | None) -> dict[str, float]:
    drawn, stage = bool(rng.random() < _DECOYS), str(rng.choice(STAGES[kind]))
    name = {"gun": str(rng.choice(["tank_volume_m3", "travel_m"])), "contact": "mass_kg", "plate": "damping_ratio"}
    factor = 1 + float(rng.uniform(-1, 1)) * _DECOY_SPREAD[stage]
    if kind == "chain" and stage == "contact":
        return {}  # a shot's mass stands in its row
    return {name[stage]: factor} if (drawn if wanted is None else wanted) else {}


Draw = Callable[[Case, np.random.Generator, str], Case | None]


def _none(case: Case, rng: np.random.Generator, split: str) -> Case | None:  # noqa: ARG001 - one signature for all
    return case


def _catalogue(case: Case, rng: np.random.Generator, split: str) -> Case | None:  # noqa: ARG001 - as above
    return _fitting(case, str(rng.choice(shown_by(case.kind, case.design))), rng)


def _unknown(case: Case, rng: np.random.Generator, split: str) -> Case | None:
    name = str(rng.choice(families(case.kind, split)))
    setting = FAMILIES[name].varies
    if setting and len({getattr(configuration, setting) for configuration in design(case.kind, case.design)}) < 2:
        return None
    return _fitting(case, name, rng)


def _fitting(case: Case, name: str, rng: np.random.Generator) -> Case | None:
    """None where the cause does not reach the tier."""
    fitting_case = with_cause(case, name, rng)
    return fitting_case if fitting_case is not None and inside(fitting_case, TIERS[case.tier]) else None


def _two(case: Case, rng: np.random.Generator, split: str) -> Case | None:  # noqa: ARG001 - as above
    names = rng.choice(shown_by(case.kind, case.design), 2, replace=False).tolist()
    strengths: dict[str, float] = {}
    for name in names:
        ratio = math.exp(rng.uniform(math.log(1.7), math.log(12.0)))
        single_case = sized(case, name, int(rng.choice(signs(name))), ratio, rng)
        if ratio_of(replace(single_case, floor=case.floor)) < _EACH:
            return None
        strengths |= single_case.strengths
    both = replace(case, strengths=strengths)
    return both if inside(both, _BOTH) else None


_CAUSES: dict[str, Draw] = {"catalogue": _catalogue, "none": _none, "unknown": _unknown, "two": _two}
