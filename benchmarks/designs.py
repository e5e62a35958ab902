"""`python -m benchmarks.designs [TABLE]`: 105 runs of gun and hammer, from our peers and from us, as Markdown.

TABLE is the thesis's Table A.1 as CSV, of the gun; by default where the tests look for it. Prints for each space, all
measured in one run, one row per way of designing: the median over seeds with the least and the largest where there is
chance in it. The exit code is 1 where ours is not at least as good as the plain anneal and as each criterion of pyDOE3
on every figure, to the digits shown.
"""

from __future__ import annotations

import csv
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
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

from .measuring import ROOT
from .peers import has

Levels = NDArray[np.int64]
Make = Callable[[Space, int, np.random.Generator], Levels]

RUNS, SEEDS, ANNEAL_S, LIMIT_S = 105, range(5), 2.0, 10.0
TABLE = ROOT.parent / "shared" / "reference" / "table_a1_lhs_105_runs.csv"
SHOWN = {
    "distinct": "{:.0f}",
    "worst_level": "{:.2f}",
    "worst_pair": "{:.2f}",
    "worst_triple": "{:.2f}",
    "rms_triple": "{:.3f}",
    "uneven_triples": "{:.0f}",
    "centred_discrepancy": "{:.4f}",
    "wrap_around_discrepancy": "{:.3f}",
    "minimum_distance": "{:.3f}",
    "largest_correlation": "{:.3f}",
    "d_efficiency": "{:.3f}",
}


@dataclass(frozen=True)
class Measured:
    """A way of designing: quality and seconds, a value for each seed."""

    name: str
    found: Sequence[Quality]
    seconds: Sequence[float]

    def values(self, figure: str) -> list[float]:
        return [float(getattr(one, figure)) for one in self.found]

    def row(self) -> str:
        cells = [_text(self.values(figure), shown) for figure, shown in SHOWN.items()]
        return "| " + " | ".join([self.name, *cells, _text(self.seconds, "{:.1f}") if self.seconds else "—"]) + " |"


def rounded(points: NDArray[np.float64], space: Space) -> Levels:
    """Points in the unit cube as levels, each axis cut into equal cells."""
    return np.floor(points * [axis.size for axis in space.axes]).astype(np.int64)


def by_pydoe(criterion: LhsCriterion) -> Make:
    return lambda space, n, rng: latin_hypercube(space, n, rng, criterion).treatments


def by_scipy(space: Space, n: int, rng: np.random.Generator) -> Levels:
    from scipy.stats import qmc

    return rounded(qmc.LatinHypercube(len(space.axes), optimization="random-cd", rng=rng).random(n), space)


def by_smt(space: Space, n: int, rng: np.random.Generator) -> Levels:
    """SMT's best: enhanced stochastic evolution (Jin, Chen and Sudjianto, J. Stat. Plan. Inference 134, 2005)."""
    from smt.sampling_methods import LHS

    box = np.array([[0.0, 1.0]] * len(space.axes))
    return rounded(LHS(xlimits=box, criterion="ese", seed=int(rng.integers(2**31)))(n), space)


def by_plain_anneal(space: Space, n: int, rng: np.random.Generator) -> Levels:
    """What one would write first: swaps of one level of two runs, one at a time, judged by pairs and repeats."""
    sizes = [axis.size for axis in space.axes]
    rows = np.stack([rng.permutation(np.arange(n) % size) for size in sizes], axis=1)
    pairs = {
        (a, b): np.asarray(cell_counts(rows, sizes, (a, b)) - n / (sizes[a] * sizes[b]), dtype=np.float64)
        for a in range(len(sizes))
        for b in range(a + 1, len(sizes))
    }
    seen: dict[tuple[int, ...], int] = {}
    for run in map(tuple, rows.tolist()):
        seen[run] = seen.get(run, 0) + 1
    begin = time.perf_counter()
    while (spent := (time.perf_counter() - begin) / ANNEAL_S) < 1:
        _try_swap(rows, pairs, seen, 3.0 * (0.05 / 3.0) ** spent, rng)
    return rows


def _try_swap(
    rows: Levels,
    pairs: dict[tuple[int, int], NDArray[np.float64]],
    seen: dict[tuple[int, ...], int],
    temperature: float,
    rng: np.random.Generator,
) -> None:
    (first, second), axis = rng.choice(len(rows), 2, replace=False), int(rng.integers(rows.shape[1]))
    if rows[first, axis] == rows[second, axis]:
        return
    change = _swap(rows, pairs, seen, (int(first), int(second), axis))
    if change > 0 and rng.random() >= np.exp(-change / temperature):
        _swap(rows, pairs, seen, (int(first), int(second), axis))


def _swap(
    rows: Levels,
    pairs: dict[tuple[int, int], NDArray[np.float64]],
    seen: dict[tuple[int, ...], int],
    swap: tuple[int, int, int],
) -> float:
    """Make the swap; the change of the squared deviations of pairs, and of repeats at 10 each."""
    first, second, axis = swap
    change = 0.0
    for run in (first, second):
        change += _count(rows[run], axis, pairs, seen, -1)
    rows[[first, second], axis] = rows[[second, first], axis]
    for run in (first, second):
        change += _count(rows[run], axis, pairs, seen, 1)
    return change


def _count(
    run: Levels,
    axis: int,
    pairs: dict[tuple[int, int], NDArray[np.float64]],
    seen: dict[tuple[int, ...], int],
    sign: int,
) -> float:
    key = tuple(run.tolist())
    before = seen.get(key, 0)
    seen[key] = before + sign
    change = 10.0 * (max(0, before + sign - 1) - max(0, before - 1))
    for (a, b), table in pairs.items():
        if axis in (a, b):
            change += 2 * sign * table[key[a], key[b]] + 1
            table[key[a], key[b]] += sign
    return float(change)


def by_us(space: Space, n: int, rng: np.random.Generator) -> Levels:
    return balance_levels(space, n, rng).treatments


PLAIN, OURS = f"plain exchange anneal, {ANNEAL_S:g} s", "pyroshock"
WAYS: dict[str, Make] = {
    **{f"pyDOE3 {criterion} LHS, rounded": by_pydoe(criterion) for criterion in get_args(LhsCriterion)},
    "scipy random-CD LHS, rounded": by_scipy,
    **({"SMT ESE LHS, rounded": by_smt} if has("smt") else {}),
    PLAIN: by_plain_anneal,
    OURS: by_us,
}


def measured(name: str, make: Make, space: Space) -> Measured:
    make(space, 2, np.random.default_rng(0))  # imports
    found, seconds = [], []
    for seed in SEEDS:
        begin = time.perf_counter()
        treatments = make(space, RUNS, np.random.default_rng(seed))
        seconds.append(time.perf_counter() - begin)
        found.append(quality(space, treatments))
    return Measured(name, found, seconds)


def lost(ours: Measured, peer: Measured) -> list[str]:
    """Figures on which our worst seed is not as good as the peer's median, to the digits shown."""
    result = []
    for figure, shown in SHOWN.items():
        sign = 1 if FIGURES[figure][1] == "less" else -1
        worst = max(sign * value for value in ours.values(figure))
        if float(shown.format(worst)) > float(shown.format(sign * statistics.median(peer.values(figure)))):
            result.append(figure)
    return result


def _text(values: Sequence[float], shown: str) -> str:
    low, middle, high = (shown.format(f(values)) for f in (min, statistics.median, max))
    return middle if low == high else f"{middle} ({low} to {high})"


def main(arguments: list[str]) -> int:
    with Path(arguments[0] if arguments else TABLE).open(newline="") as handle:
        thesis = quality(gun_space(), gun_space().treatments(list(csv.DictReader(handle))))
    failed = _compared(gun_space(), [Measured("Table A.1 of the thesis", [thesis], [])])
    failed += _compared(hammer_space(), [])
    return 1 if failed else 0


def _compared(space: Space, published: list[Measured]) -> list[str]:
    """Prints a table of one space; returns what ours has lost."""
    words = [FIGURES[figure][0] for figure in SHOWN]
    *peers, ours = (measured(name, make, space) for name, make in WAYS.items())
    lines = ["| " + " | ".join([f"design, {space.name}", *words, "seconds"]) + " |"]
    lines += ["| --- " * (len(words) + 2) + "|", *(row.row() for row in (*published, *peers, ours))]
    sys.stdout.write("\n".join(lines) + "\n\n")
    held = [peer for peer in peers if peer.name == PLAIN or peer.name.startswith("pyDOE3")]
    failed = [f"{figure} to {peer.name}" for peer in held for figure in lost(ours, peer)]
    failed += ["seconds"] * (max(ours.seconds) > LIMIT_S)
    sys.stdout.write(f"{space.name}: ours lost {', '.join(failed) or 'nothing'}\n\n")
    return failed


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
