"""Which cases are drawn for which tier. The same seed, the same cases, in whichever process."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from .cases.case import ALL_KINDS, GUN_AND_CONTACT, KINDS, Case
from .cases.draw import (
    FULL_SCALE,
    SMALL_GAP,
    base_case,
    draw_case,
    draw_foreign,
    draw_foreign_bench,
    draw_outside,
    draw_realistic,
    draw_visible_bench,
)


class Mix(NamedTuple):
    """What a tier is drawn from: gaps over floor by name, causes with their shares, roughness of
    the background."""

    gaps: tuple[str, ...]
    causes: Mapping[str, float]
    rough: bool = False


class ManyEffectTier(NamedTuple):
    """A tier in which kinds take turns, and the seeds of the splits are apart from each other.

    `draw` makes a case of a kind from random numbers, for a split, with its number within the kind
    (from 0). A tier with `seeds_of` another one has its cases.
    """

    kinds: tuple[str, ...]
    draw: Callable[[str, np.random.Generator, str, int], Case]
    seeds_of: str = ""


_USUAL = {"catalogue": 0.6, "none": 0.2, "unknown": 0.2}
#: Cases whose own effect is taken out of the catalogue.
LEFT_OUT = "left out"
#: Gaps over floor below 1.5, to 3, to 6, to 20; two effects; a rougher background than assumed; an
#: effect left out.
MIXES: Mapping[str, Mix] = {
    "weak": Mix(("weak",), _USUAL),
    "middle": Mix(("middle",), _USUAL),
    "strong": Mix(("strong",), _USUAL),
    "very strong": Mix(("very strong",), _USUAL),
    "two": Mix(("any",), {"two": 1.0}),
    "rough": Mix(("middle", "strong", "very strong"), _USUAL, rough=True),
    LEFT_OUT: Mix(("strong", "very strong"), {"catalogue": 1.0}),
}


def laws_of(split: str) -> str:
    """The second laws of a split: each has laws of its own. Raises `ValueError` for a split that
    there is not."""
    if split not in SPLITS:
        raise ValueError(f"split {split!r}: expected one of {', '.join(SPLITS)}")
    return split


def _gun_at_full_scale(kind: str, rng: np.random.Generator, split: str) -> Case:
    return draw_visible_bench(kind, rng, laws_of(split), effects=(5, 7), limits=FULL_SCALE[kind])


def _recorded(case: Case, recorded: bool = True) -> Case:
    """With tank pressure and laser, where the kind has a gun."""
    return replace(case, traces=recorded and case.kind in ("gun", GUN_AND_CONTACT))


def _null(kind: str, rng: np.random.Generator, split: str, number: int) -> Case:
    """Without an effect; every other background is rough, and of guns every other pair has
    traces."""
    case = replace(base_case(kind, "any", rng, rough=bool(number % 2)), laws=laws_of(split))
    return _recorded(case, number // 2 % 2 == 0)


_SINGLE = ("gun", "hammer", "plate")
#: The virtual bench as it is, all effects at once, at full scale with gaps of 10 to 60 tolerances;
#: and one effect, two, and five to seven at full scale by second laws. Then what a reader acts on,
#: by second laws: guns at full scale with tank pressure and laser, and the same shots without; one
#: and two effects of a gun with them; a gun and what its bullet strikes at full scale; causes
#: outside of the catalogue; five effects that are small together; no effect, with a smooth
#: background and with a rough one.
BENCHES: Mapping[str, ManyEffectTier] = {
    "realistic": ManyEffectTier(KINDS, lambda kind, rng, *_: draw_realistic(kind, rng)),
    "realistic full scale": ManyEffectTier(
        KINDS, lambda kind, rng, *_: draw_realistic(kind, rng, full_scale=True)
    ),
    "foreign one": ManyEffectTier(
        KINDS, lambda kind, rng, split, _: draw_foreign(kind, rng, laws_of(split), effects=1)
    ),
    "foreign two": ManyEffectTier(
        KINDS, lambda kind, rng, split, _: draw_foreign(kind, rng, laws_of(split), effects=2)
    ),
    "foreign full scale": ManyEffectTier(
        KINDS, lambda kind, rng, split, _: draw_foreign_bench(kind, rng, laws_of(split))
    ),
    "gun with traces": ManyEffectTier(
        ("gun",), lambda kind, rng, split, _: _recorded(_gun_at_full_scale(kind, rng, split))
    ),
    "gun without traces": ManyEffectTier(
        ("gun",),
        lambda kind, rng, split, _: _gun_at_full_scale(kind, rng, split),
        seeds_of="gun with traces",
    ),
    "one with traces": ManyEffectTier(
        ("gun",),
        lambda kind, rng, split, _: _recorded(draw_foreign(kind, rng, laws_of(split), effects=1)),
    ),
    "two with traces": ManyEffectTier(
        ("gun",),
        lambda kind, rng, split, _: _recorded(draw_foreign(kind, rng, laws_of(split), effects=2)),
    ),
    "full scale chain": ManyEffectTier(
        (GUN_AND_CONTACT,),
        lambda kind, rng, split, _: _recorded(_gun_at_full_scale(kind, rng, split)),
    ),
    "outside": ManyEffectTier(
        _SINGLE,
        lambda kind, rng, split, number: _recorded(draw_outside(kind, rng, split), number % 2 == 0),
    ),
    "five at 2 to 5": ManyEffectTier(
        _SINGLE,
        lambda kind, rng, split, _: _recorded(
            draw_visible_bench(kind, rng, laws_of(split), effects=(5, 5), limits=SMALL_GAP)
        ),
    ),
    "null rough": ManyEffectTier(_SINGLE, _null),
}
#: Several tiers by one name.
GROUPS: Mapping[str, tuple[str, ...]] = {
    "foreign": ("foreign one", "foreign two", "foreign full scale"),
    "causes": tuple(BENCHES)[5:],
}
#: Every tier. The place of a tier is part of its seeds: new ones come last.
TIERS: Mapping[str, Mix | ManyEffectTier] = {**MIXES, **BENCHES}
#: Splits of causes, laws and seeds; what is tuned may look at all but the sealed one. Each has
#: second laws of its own.
SPLITS = ("development", "calibration", "sealed")
#: Seeds of the tables in the documentation, by split: the same cases, for whoever runs the check.
SEEDS: Mapping[str, int] = {"development": 26_110, "calibration": 26_111, "sealed": 26_112}
_REDRAWS = 8


@dataclass(frozen=True)
class CaseTask:
    """One case to come, by its name; `split` says which effects outside the catalogue, and which
    laws, may be drawn.

    `kind` is empty where it is drawn with the case.
    """

    name: str
    tier: str
    seed: tuple[int, ...]
    split: str = "sealed"
    kind: str = ""


def tasks(
    cases: int, seed: int, tiers: Sequence[str], split: str = "sealed", kinds: Sequence[str] = ()
) -> list[CaseTask]:
    """So many cases of each tier, tier by tier; of `kinds` alone where some are named, in the tiers
    that take turns.

    Raises `ValueError` for a tier or kind that there is not.
    """
    if cases < 1:
        raise ValueError(f"{cases} cases: expected at least 1 of each tier")
    for tier in tiers:
        if tier not in TIERS:
            raise ValueError(f"tier {tier!r}: expected one of {', '.join(TIERS)}")
    for kind in kinds:
        if kind not in ALL_KINDS:
            raise ValueError(f"kind {kind!r}: expected one of {', '.join(ALL_KINDS)}")
    work: list[CaseTask] = []
    for tier in dict.fromkeys(tiers):
        work += (
            _in_turn(cases, seed, tier, split, kinds)
            if tier in BENCHES
            else _of_mix(cases, seed, tier, split)
        )
    return work


def _of_mix(cases: int, seed: int, tier: str, split: str) -> list[CaseTask]:
    place = list(TIERS).index(tier)
    return [
        CaseTask(f"{tier.replace(' ', '-')}-{i:04d}", tier, (seed, place, i), split)
        for i in range(cases)
    ]


def _in_turn(cases: int, seed: int, tier: str, split: str, kinds: Sequence[str]) -> list[CaseTask]:
    """The same cases of a kind, whichever kinds are asked for beside it."""
    place = list(TIERS).index(BENCHES[tier].seeds_of or tier)
    able = [kind for kind in BENCHES[tier].kinds if kind in (kinds or ALL_KINDS)]
    rows = []
    for i in range(cases if able else 0):
        kind, number = able[i % len(able)], i // len(able)
        seeds = (seed, place, SPLITS.index(split), ALL_KINDS.index(kind), number)
        rows.append(
            CaseTask(f"{tier.replace(' ', '-')}-{kind}-{number:04d}", tier, seeds, split, kind)
        )
    return rows


@lru_cache(maxsize=64)
def case_of_task(task: CaseTask) -> tuple[Case, int]:
    """The case of a task and the seed of its recording. Raises `ValueError` where no case comes of
    it."""
    rng = np.random.default_rng(task.seed)
    if task.tier in BENCHES:
        case = BENCHES[task.tier].draw(task.kind, rng, task.split, task.seed[-1])
        return case, int(rng.integers(2**31))
    mix = MIXES[task.tier]
    cause = str(rng.choice(list(mix.causes), p=list(mix.causes.values())))
    gaps = str(rng.choice(mix.gaps))
    attempt = 1
    while True:
        kind = str(rng.choice(KINDS))
        try:
            case = draw_case(kind, gaps, rng, cause=cause, split=task.split, rough=mix.rough)
        except ValueError:  # this kind of campaign cannot show such a gap, or hardly
            if attempt == _REDRAWS:
                raise
            attempt += 1
        else:
            return case, int(rng.integers(2**31))
