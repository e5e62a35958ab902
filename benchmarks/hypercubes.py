"""The theme of designs: 105 gun runs from our peers and from us, as `python -m benchmarks.designs` has them.

The figures of quality are such that less is better: a deviation, a discrepancy, the inverse of an efficiency.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from itertools import product
from pathlib import Path

import numpy as np
from pyroshock.doe.merit import Quality, quality
from pyroshock.doe.space import Space, gun_space

from . import designs
from .designs import OURS, PLAIN, RUNS, WAYS, Measured
from .figures import Figure, missing
from .measuring import Spread, ratio
from .peers import ABSENT, has
from .pulse_scores import share

THEME = "Plans of 105 gun runs: Latin hypercubes rounded to levels beside the balanced design, {} seeds"
SEEDS = range(3)
TRIPLES, DISCREPANCY = "a plan's balance: triples of levels, rms", "a plan's spread: centred discrepancy"
INFORMATION = "a plan's information: inverse of the D-efficiency"
#: What is compared, less of which is better.
QUALITY: dict[str, Callable[[Quality], float]] = {
    "runs that repeat another": lambda one: float(one.runs - one.distinct),
    "worst pair of levels from its share": lambda one: one.worst_pair,
    TRIPLES: lambda one: one.rms_triple,
    DISCREPANCY: lambda one: one.centred_discrepancy,
    INFORMATION: lambda one: 1 / max(one.d_efficiency, 1e-9),
}


def measure_hypercubes(_folder: Path) -> Iterator[Figure]:
    space, theme = gun_space(), THEME.format(len(SEEDS))
    found = _measured(space)
    ours = found.pop(OURS)
    for peer in found.values():
        yield from _beside(theme, ours, peer)
    if not has("smt"):
        yield missing(theme, "SMT", ABSENT, question=TRIPLES, rival="SMT")
    behind = designs.lost(ours, found[PLAIN])
    told = ", ".join(behind) or "none"
    yield Figure(
        theme, "figures on which our worst seed is behind the plain exchange's median", told, "none, promised",
        Spread.of([float(len(behind))]), limit=0.0, of="bound",
    )  # fmt: skip
    seconds = [one / designs.LIMIT_S for one in ours.seconds]
    text = Spread.of(ours.seconds).text(" s")
    yield Figure(theme, "time", text, f"{designs.LIMIT_S:g} s, promised", Spread.of(seconds), limit=1.0, of="bound")


def _measured(space: Space) -> dict[str, Measured]:
    """Every way in turn, seed by seed."""
    for make in WAYS.values():
        make(space, 2, np.random.default_rng(0))  # imports
    found: dict[str, list[tuple[Quality, float]]] = {name: [] for name in WAYS}
    for seed, (name, make) in product(SEEDS, WAYS.items()):
        begin = time.perf_counter()
        treatments = make(space, RUNS, np.random.default_rng(seed))
        seconds = time.perf_counter() - begin
        found[name].append((quality(space, treatments), seconds))
    return {name: Measured(name, *map(list, zip(*each, strict=True))) for name, each in found.items()}


def _beside(theme: str, ours: Measured, peer: Measured) -> Iterator[Figure]:
    own, other = (Spread.of(one.seconds).text(" s") for one in (ours, peer))
    yield Figure(
        theme, f"time, {peer.name}", own, other, ratio(ours.seconds, peer.seconds), question="a plan of 105 runs",
        nature="the exchanges that are tried, whose number is fixed", rival=peer.name,
    )  # fmt: skip
    for what, value in QUALITY.items():
        mine, theirs = ([value(one) for one in each.found] for each in (ours, peer))
        bound = [1 / one.d_efficiency_limit for one in ours.found] if what == INFORMATION else None
        yield Figure(
            theme, f"{what}, {peer.name}", Spread.of(mine).text(), Spread.of(theirs).text(),
            Spread.of([share(*pair) for pair in zip(mine, theirs, strict=True)]),
            of="quality", question=what if what in (TRIPLES, DISCREPANCY, INFORMATION) else "", rival=peer.name,
            nature=f"a balanced orthogonal design: {bound[0]:.4g}" if bound else "no bound is known",
            near=ratio(mine, bound) if bound else None,
        )  # fmt: skip
