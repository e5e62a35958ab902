"""Which cases are drawn for which tier. The same seed, the same cases, in whichever process."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...virtualbench.withheld.case import KINDS, Case
from ...virtualbench.withheld.draw import draw_case


class Mix(NamedTuple):
    """What a tier is drawn from: gaps over floor by name, causes with their shares, roughness of the background."""

    gaps: tuple[str, ...]
    causes: Mapping[str, float]
    rough: bool = False


_USUAL = {"catalogue": 0.6, "none": 0.2, "unknown": 0.2}
#: Cases whose own effect is taken out of the catalogue.
LEFT_OUT = "left out"
#: Gaps over floor below 1.5, to 3, to 6, to 20; two effects; a rougher background than assumed; an effect left out.
TIERS: Mapping[str, Mix] = {
    "weak": Mix(("weak",), _USUAL),
    "middle": Mix(("middle",), _USUAL),
    "strong": Mix(("strong",), _USUAL),
    "very strong": Mix(("very strong",), _USUAL),
    "two": Mix(("any",), {"two": 1.0}),
    "rough": Mix(("middle", "strong", "very strong"), _USUAL, rough=True),
    LEFT_OUT: Mix(("strong", "very strong"), {"catalogue": 1.0}),
}
_REDRAWS = 8


@dataclass(frozen=True)
class Task:
    """One case to come, by its name; `split` says which effects outside the catalogue may be drawn."""

    name: str
    tier: str
    seed: tuple[int, ...]
    split: str = "sealed"


def tasks(cases: int, seed: int, tiers: Sequence[str], split: str = "sealed") -> list[Task]:
    """So many cases of each tier, tier by tier. Raises `ValueError` for a tier that there is not."""
    if cases < 1:
        raise ValueError(f"{cases} cases: expected at least 1 of each tier")
    for tier in tiers:
        if tier not in TIERS:
            raise ValueError(f"tier {tier!r}: expected one of {', '.join(TIERS)}")
    found = list(TIERS)
    return [
        Task(f"{tier.replace(' ', '-')}-{i:04d}", tier, (seed, found.index(tier), i), split)
        for tier in dict.fromkeys(tiers)
        for i in range(cases)
    ]


@lru_cache(maxsize=64)
def drawn(task: Task) -> tuple[Case, int]:
    """The case of a task and the seed of its recording. Raises `ValueError` where no case comes of it."""
    rng = np.random.default_rng(task.seed)
    mix = TIERS[task.tier]
    cause = str(rng.choice(list(mix.causes), p=list(mix.causes.values())))
    gaps = str(rng.choice(mix.gaps))
    for attempt in range(_REDRAWS):
        kind = str(rng.choice(KINDS))
        try:
            case = draw_case(kind, gaps, rng, cause=cause, split=task.split, rough=mix.rough)
        except ValueError:  # this kind of campaign cannot show such a gap, or hardly
            if attempt == _REDRAWS - 1:
                raise
            continue
        return case, int(rng.integers(2**31))
    raise AssertionError("unreachable")
