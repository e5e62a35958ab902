"""`python -m benchmarks.growth [--full] [PICTURE.png]`: how time and room grow with impacts, configurations and pulses.

Each curve is a list of points, a size with the seconds or bytes of some repeats; what is told is the exponent p of n^p
through them. The points go to growth.json in the folder, from where `growth_plot` draws them. A size that would take a
training longer than `BUDGET_S` is left out, and the figure says so.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

import numpy as np

from .apart import seconds_of
from .figures import Figure, missing
from .growth_plot import draw
from .measuring import Spread
from .themes import work_folder

THEME = "Growth"
FILE = "growth.json"
BUDGET_S = 12.0

#: A size, and the seconds of some repeats.
Cost = tuple[int, tuple[float, ...]]


@dataclass(frozen=True)
class Point:
    """`values` of some repeats at a size: seconds, or bytes where `unit` says so. `axis` names what the size counts."""

    axis: str
    curve: str
    size: int
    values: tuple[float, ...]
    unit: str = "s"


def exponents(points: Sequence[Point]) -> Spread:
    """p of value = c size^p by least squares of logarithms, one for each repeat; fewer of them go round."""
    sizes = np.log([point.size for point in points])
    turns = max(len(point.values) for point in points)
    rows = [np.log([point.values[turn % len(point.values)] for point in points]) for turn in range(turns)]
    return Spread.of([float(np.polyfit(sizes, row, 1)[0]) for row in rows])


def curves(points: Iterable[Point]) -> dict[tuple[str, str], list[Point]]:
    """By axis and curve, in rising order of size."""
    found: dict[tuple[str, str], list[Point]] = {}
    for point in sorted(points, key=lambda point: point.size):
        found.setdefault((point.axis, point.curve), []).append(point)
    return found


def fitting(cost: Callable[[int], tuple[float, ...]], sizes: Sequence[int], budget_s: float = BUDGET_S) -> list[Cost]:
    """Sizes with what they cost, as long as the next one, growing as the last ones did, stays within the budget."""
    found: list[Cost] = []
    for size in sizes:
        if found and _expected(found, size) > budget_s:
            break
        found.append((size, cost(size)))
    return found


def _expected(found: Sequence[Cost], size: int) -> float:
    """Seconds by the last two sizes; as the square from one alone."""
    (last, now), power = found[-1], 2.0
    if len(found) > 1:
        before, then = found[-2]
        power = max(1.0, math.log(min(now) / min(then)) / math.log(last / before))
    return float(min(now) * (size / last) ** power)


def repeated(function: Callable[[], object], most: int = 7, enough_s: float = 2.0) -> tuple[float, ...]:
    """Seconds of some repeats after a first one that does not count; of what is slow, the first one's alone."""
    first = seconds_of(function)
    if first > enough_s:
        return (first,)
    return tuple(seconds_of(function) for _ in range(max(3, min(most, int(enough_s / max(first, 1e-9))))))


def figures(points: Sequence[Point], natures: Mapping[tuple[str, str], str] | None = None) -> Iterator[Figure]:
    """One for each curve: the largest size beside the smallest."""
    for (axis, curve), some in curves(points).items():
        first, last = some[0], some[-1]
        if first is last:
            yield missing(THEME, f"{curve}, {first.size:,} {axis}", "one size alone", ours=text(first))
            continue
        times = Spread.of([b / a for a, b in zip(_short(first, last), _short(last, first), strict=True)])
        said = f"as n^p, p = {exponents(some).text()}"
        nature = (natures or {}).get((axis, curve), "")
        yield Figure(
            THEME, f"{curve}, {first.size:,} to {last.size:,} {axis}", text(last), text(first), times, of="growth",
            nature=f"{said}; {nature}" if nature else said,
        )  # fmt: skip


def _short(point: Point, other: Point) -> tuple[float, ...]:
    return point.values[: min(len(point.values), len(other.values))]


def text(point: Point) -> str:
    spread = Spread.of(point.values)
    if point.unit == "bytes":
        return f"{spread.median / 1e6:.3g} MB"
    return spread.text(" s") if spread.median >= 1 else spread.text(" ms", 1e3)


def measure_growth(folder: Path, full: bool = False) -> Iterator[Figure]:
    """All curves; their points go to `folder`."""
    from .growth_diagnosis import diagnosis_points
    from .growth_store import store_points
    from .growth_training import training_points

    points: list[Point] = []
    budget_s = math.inf if full else BUDGET_S
    for part in (
        partial(store_points, folder),
        partial(diagnosis_points, 4 * budget_s),
        partial(training_points, budget_s),
    ):
        found, natures = part()
        points += found
        keep(points, folder)
        yield from figures(found, natures)


def keep(points: Sequence[Point], folder: Path) -> None:
    (folder / FILE).write_text(json.dumps([asdict(point) for point in points]))


def main(words: Sequence[str]) -> None:
    with work_folder() as folder:
        for figure in measure_growth(folder, "--full" in words):
            sys.stdout.write(figure.row() + "\n")
            sys.stdout.flush()
        for picture in (word for word in words if word != "--full"):
            draw(json.loads((folder / FILE).read_text()), Path(picture))


if __name__ == "__main__":
    main(sys.argv[1:])
