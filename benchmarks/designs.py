"""`python -m benchmarks.designs [TABLE]`: 105 runs of gun and hammer, from our peers and from us,
as Markdown.

TABLE is the thesis's Table A.1 as CSV, of the gun; by default where the tests look for it. The
command prints for each space, all measured in one run, one row per way of designing: the median
over seeds with the least and the largest where there is chance in it. The exit code is 1 where ours
is not at least as good as the plain exchange and as each criterion of pyDOE3 on every figure, to
the digits shown.
"""

from __future__ import annotations

import csv
import statistics
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from pathlib import Path
from typing import get_args

import numpy as np
from numpy.typing import NDArray
from pyroshock.doe.designs.lhs import balance_levels
from pyroshock.doe.designs.pydoe import LhsCriterion
from pyroshock.doe.designs.space_filling import latin_hypercube
from pyroshock.doe.merit import FIGURES, Quality, quality
from pyroshock.doe.merit.space_filling import cell_counts
from pyroshock.doe.space import Space, gun_space, hammer_space

from .harness import (
    ABSENT,
    ROOT,
    Figure,
    Spread,
    compared,
    has,
    missing,
    promised,
    table,
    table_row,
)

Levels = NDArray[np.int64]
Make = Callable[[Space, int, np.random.Generator], Levels]

THEME = (
    "Plans of 105 gun runs: Latin hypercubes rounded to levels beside the balanced design, {} seeds"
)
RUNS, ANNEAL_S, LIMIT_S = 105, 2.0, 10.0
TABLE = ROOT / "tests" / "data" / "thesis" / "table_a1_lhs_105_runs.csv"
SHOWN = {
    "distinct": "{:.0f}", "worst_level": "{:.2f}", "worst_pair": "{:.2f}", "worst_triple": "{:.2f}",
    "rms_triple": "{:.3f}", "uneven_triples": "{:.0f}", "centred_discrepancy": "{:.4f}",
    "wrap_around_discrepancy": "{:.3f}", "minimum_distance": "{:.3f}",
    "largest_correlation": "{:.3f}",
    "d_efficiency": "{:.3f}",
}  # fmt: skip
INFORMATION = "a plan's information: inverse of the D-efficiency"
#: Questions of quality, with figures of which less is better.
QUALITY: dict[str, Callable[[Quality], float]] = {
    "a plan's balance: triples of levels, rms": lambda plan: plan.rms_triple,
    "a plan's spread: centred discrepancy": lambda plan: plan.centred_discrepancy,
    INFORMATION: lambda plan: 1 / max(plan.d_efficiency, 1e-9),
}


@dataclass(frozen=True)
class Plans:
    """A way of designing: quality and seconds, a value for each seed."""

    name: str
    qualities: Sequence[Quality]
    seconds: Sequence[float]

    def values(self, figure: str) -> list[float]:
        return [float(getattr(design_quality, figure)) for design_quality in self.qualities]

    def row(self) -> str:
        cells = [_text(self.values(figure), shown) for figure, shown in SHOWN.items()]
        return table_row(self.name, *cells, _text(self.seconds, "{:.1f}") if self.seconds else "—")


def rounded(points: NDArray[np.float64], space: Space) -> Levels:
    """Points in the unit cube as levels, each axis cut into equal cells."""
    return np.floor(points * [axis.size for axis in space.axes]).astype(np.int64)


def by_pydoe(criterion: LhsCriterion) -> Make:
    return lambda space, n, rng: latin_hypercube(space, n, rng, criterion).treatments


def by_scipy(space: Space, n: int, rng: np.random.Generator) -> Levels:
    from scipy.stats import qmc

    return rounded(
        qmc.LatinHypercube(len(space.axes), optimization="random-cd", rng=rng).random(n), space
    )


def by_smt(space: Space, n: int, rng: np.random.Generator) -> Levels:
    """SMT's best: enhanced stochastic evolution (Jin, Chen and Sudjianto, J. Stat. Plan. Inference
    134, 2005)."""
    from smt.sampling_methods import LHS

    box = np.array([[0.0, 1.0]] * len(space.axes))
    return rounded(LHS(xlimits=box, criterion="ese", seed=int(rng.integers(2**31)))(n), space)


def by_plain_exchange(space: Space, n: int, rng: np.random.Generator) -> Levels:
    """What one would write first: swaps of one level of two runs, one at a time, judged by pairs
    and repeats."""
    sizes = [axis.size for axis in space.axes]
    rows = np.stack([rng.permutation(np.arange(n) % size) for size in sizes], axis=1)
    pairs = {
        (a, b): np.asarray(
            cell_counts(rows, sizes, (a, b)) - n / (sizes[a] * sizes[b]), dtype=np.float64
        )
        for a, b in combinations(range(len(sizes)), 2)
    }
    repeats: dict[tuple[int, ...], int] = {}
    for run in map(tuple, rows.tolist()):
        repeats[run] = repeats.get(run, 0) + 1

    def count(run: Levels, axis: int, sign: int) -> float:
        """Adds or takes away a run: the change of the squared deviations of pairs, and of repeats
        at 10 each."""
        key = tuple(run.tolist())
        before = repeats.get(key, 0)
        repeats[key] = before + sign
        change = 10.0 * (max(0, before + sign - 1) - max(0, before - 1))
        for (a, b), deviations in pairs.items():
            if axis in (a, b):
                change += 2 * sign * deviations[key[a], key[b]] + 1
                deviations[key[a], key[b]] += sign
        return float(change)

    def swap(first: int, second: int, axis: int) -> float:
        change = sum(count(rows[run], axis, -1) for run in (first, second))
        rows[[first, second], axis] = rows[[second, first], axis]
        return change + sum(count(rows[run], axis, 1) for run in (first, second))

    begin = time.perf_counter()
    while (spent := (time.perf_counter() - begin) / ANNEAL_S) < 1:
        (first, second), axis = rng.choice(n, 2, replace=False), int(rng.integers(len(sizes)))
        if rows[first, axis] != rows[second, axis]:
            change = swap(int(first), int(second), axis)
            if change > 0 and rng.random() >= np.exp(-change / (3.0 * (0.05 / 3.0) ** spent)):
                swap(int(first), int(second), axis)
    return rows


def by_us(space: Space, n: int, rng: np.random.Generator) -> Levels:
    return balance_levels(space, n, rng).treatments


PLAIN, OURS = f"plain exchange anneal, {ANNEAL_S:g} s", "pyroshock"
METHODS: dict[str, Make] = {
    **{
        f"pyDOE3 {criterion} LHS, rounded": by_pydoe(criterion)
        for criterion in get_args(LhsCriterion)
    },
    "scipy random-CD LHS, rounded": by_scipy,
    **({"SMT ESE LHS, rounded": by_smt} if has("smt") else {}),
    PLAIN: by_plain_exchange,
    OURS: by_us,
}


def plans_of(space: Space, seeds: Sequence[int], methods: Mapping[str, Make]) -> dict[str, Plans]:
    """Every way in turn, seed by seed."""
    for make in methods.values():
        make(space, 2, np.random.default_rng(0))  # imports
    qualities: Mapping[str, list[Quality]] = {name: [] for name in methods}
    seconds: Mapping[str, list[float]] = {name: [] for name in methods}
    for seed, (name, make) in product(seeds, methods.items()):
        begin = time.perf_counter()
        treatments = make(space, RUNS, np.random.default_rng(seed))
        seconds[name].append(time.perf_counter() - begin)
        qualities[name].append(quality(space, treatments))
    return {name: Plans(name, qualities[name], seconds[name]) for name in methods}


def lost(ours: Plans, peer: Plans) -> list[str]:
    """Figures on which our worst seed is not as good as the peer's median, to the digits shown."""
    figures = []
    for figure, shown in SHOWN.items():
        sign = 1 if FIGURES[figure][1] == "less" else -1
        worst = max(sign * value for value in ours.values(figure))
        if float(shown.format(worst)) > float(
            shown.format(sign * statistics.median(peer.values(figure)))
        ):
            figures.append(figure)
    return figures


def measure_designs(_folder: Path, seeds: int = 3) -> Iterator[Figure]:
    methods = {
        name: make
        for name, make in METHODS.items()
        if not name.startswith("pyDOE3") or " maximin" in name
    }
    theme, plans = THEME.format(seeds), plans_of(gun_space(), range(seeds), methods)
    ours, plain = plans.pop(OURS), plans[PLAIN]
    bounds = {
        INFORMATION: [1 / design_quality.d_efficiency_limit for design_quality in ours.qualities]
    }
    for peer in plans.values():
        yield compared(
            theme, f"time, {peer.name}", ours.seconds, peer.seconds, "s",
            question="a plan of 105 runs",
            bound="the exchanges that are tried, whose number is fixed", peer_name=peer.name,
        )  # fmt: skip
        for question, value in QUALITY.items():
            yield compared(
                theme, f"{question}, {peer.name}", [value(q) for q in ours.qualities],
                [value(q) for q in peer.qualities], "", kind="quality", question=question,
                peer_name=peer.name,
                bound="a balanced orthogonal design" if question in bounds else "no bound is known",
                bound_values=bounds.get(question),
            )  # fmt: skip
    if not has("smt"):
        yield missing(theme, "SMT", ABSENT, question=next(iter(QUALITY)), peer_name="SMT")
    behind = lost(ours, plain)
    yield Figure(
        theme, "figures on which our worst seed is behind the plain exchange's median",
        ", ".join(behind) or "none",
        "none, promised", Spread.of([float(len(behind))]), limit=0.0, kind="bound",
    )  # fmt: skip
    yield promised(theme, "time", ours.seconds, LIMIT_S, "s")


def _text(values: Sequence[float], shown: str) -> str:
    low, middle, high = (shown.format(f(values)) for f in (min, statistics.median, max))
    return middle if low == high else f"{middle} ({low} to {high})"


def _print_table(space: Space, published: list[Plans]) -> list[str]:
    """Prints a table of one space; returns what ours has lost."""
    *peers, ours = plans_of(space, range(5), METHODS).values()
    head = (f"design, {space.name}", *(FIGURES[figure][0] for figure in SHOWN), "seconds")
    held = [peer for peer in peers if peer.name == PLAIN or peer.name.startswith("pyDOE3")]
    failed = [f"{figure} to {peer.name}" for peer in held for figure in lost(ours, peer)]
    failed += ["seconds"] * (max(ours.seconds) > LIMIT_S)
    rows = table(head, (design.row() for design in (*published, *peers, ours)))
    print(rows, f"\n{space.name}: ours lost {', '.join(failed) or 'nothing'}\n", sep="\n")
    return failed


def main(arguments: list[str]) -> int:
    with Path(arguments[0] if arguments else TABLE).open(newline="") as handle:
        thesis = quality(gun_space(), gun_space().treatments(list(csv.DictReader(handle))))
    failed = _print_table(gun_space(), [Plans("Table A.1 of the thesis", [thesis], [])])
    return 1 if failed + _print_table(hammer_space(), []) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
