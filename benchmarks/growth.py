"""`python -m benchmarks growth`: how time and room grow with impacts, configurations and pulses.

Each curve is a list of points, a size with the seconds or bytes of some repeats; the figure is the
exponent p of n^p through them. The points go to growth.json in the folder, from where
`page.draw_growth` draws them. A size that would take longer than the budget is left out, and the
figure says so.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

import numpy as np
from pyroshock.diagnosis.diagnose import diagnose
from pyroshock.diagnosis.options import Options
from pyroshock.schema.conditions import Condition
from pyroshock.schema.listings import iter_impacts, list_campaigns, list_impacts_page
from pyroshock.schema.session import Store, open_store
from pyroshock.training.estimators.base import Estimator
from pyroshock.training.estimators.coregional import Coregional
from pyroshock.training.estimators.linear import KernelRidge
from pyroshock.training.estimators.network import Network
from pyroshock.training.estimators.single_outputs import SingleOutputs
from pyroshock.training.estimators.support_vectors import SupportVectors
from pyroshock.training.estimators.trees import DecisionTree, TreeEnsemble
from pyroshock.twin.gun.effects.valve_flow import ValveFlow
from sqlalchemy.orm import Session

from .coregional import pulses
from .harness import Figure, Spread, missing, ratio, spread_text, take_turns, wall_seconds
from .shared_records import WRITER, campaign_name, filled, gun_record

THEME = "Growth"
FILE = "growth.json"
BUDGET_S = 12.0
IMPACTS = (1_000, 10_000, 100_000, 1_000_000)
_STEEL = (Condition("tip_material", "=", "steel"),)
_PAGE, _CAMPAIGN = (
    "50 rows at any size",
    "its rows: 1,000 in the smallest store, 1,800 in the others",
)
#: Questions of a store, and what bounds their growth.
QUESTIONS: dict[str, tuple[Callable[[Session], object], str]] = {
    "the first 50 impacts": (lambda s: list_impacts_page(s, None, (), None, 50), _PAGE),
    "the first 50 with tip_material=steel": (
        lambda s: list_impacts_page(s, None, _STEEL, None, 50),
        _PAGE,
    ),
    "all impacts of a campaign": (
        lambda s: sum(1 for _ in iter_impacts(s, campaign_name(1))),
        _CAMPAIGN,
    ),
    "all campaigns with their counts": (list_campaigns, "two rows for each campaign"),
}
ROOM = "room without series and curves"
DIAGNOSIS = "where and causes of a gun's gap"
#: Pressures (Pa) by masses (kg) of a diagnosed gun, each configuration three times: numbers and
#: ranges.
GRIDS = {12: (4, 3), 40: (8, 5), 120: (12, 10), 400: (20, 20)}
RANGES = ((0.4e5, 4e5), (0.1, 1.0))
PULSES, ASKED, PULSES_PER_GROUP = (100, 300, 1_000, 3_000), 1_000, 10
#: The laboratory's own model is measured at all sizes, whatever the budget of the others.
COREGIONAL, COREGIONAL_BUDGET_S = "coregional Gaussian process", 60.0
FAMILIES: dict[str, Callable[[], Estimator]] = {
    "tree": DecisionTree,
    "tree ensemble": TreeEnsemble,
    "network of 10-10": partial(Network, (10, 10)),
    "kernel ridge": KernelRidge,
    "support vector machine": SupportVectors,
    "Gaussian process an output": SingleOutputs,
    COREGIONAL: Coregional,
}


@dataclass(frozen=True)
class Point:
    """`values` of some repeats at a size: seconds, or bytes where `unit` says so. `axis` names what
    the size counts."""

    axis: str
    curve: str
    size: int
    values: tuple[float, ...]
    unit: str = "s"

    @property
    def text(self) -> str:
        if self.unit == "bytes":
            return spread_text(self.values, "MB")
        return spread_text(self.values, "s" if np.median(self.values) >= 1 else "ms")


@dataclass(frozen=True)
class Curve:
    """Points in rising order of size, and what bounds them."""

    points: Sequence[Point]
    bound: str = ""

    def exponents(self) -> Spread:
        """p of value = c size^p by least squares of logarithms, one for each repeat; fewer of them
        repeat."""
        sizes = np.log([point.size for point in self.points])
        turns = max(len(point.values) for point in self.points)
        rows = [
            np.log([point.values[turn % len(point.values)] for point in self.points])
            for turn in range(turns)
        ]
        return Spread.of([float(np.polyfit(sizes, row, 1)[0]) for row in rows])

    def figure(self) -> Figure:
        """The largest size beside the smallest."""
        first, last = self.points[0], self.points[-1]
        if first is last:
            name = f"{first.curve}, {first.size:,} {first.axis}"
            return missing(THEME, name, "one size alone", ours=first.text)
        repeats = min(len(first.values), len(last.values))
        return Figure(
            THEME, f"{first.curve}, {first.size:,} to {last.size:,} {first.axis}", last.text,
            first.text,
            ratio(last.values[:repeats], first.values[:repeats]), kind="growth",
            bound="; ".join([f"as n^p, p = {self.exponents().text()}",
            *([self.bound] if self.bound else [])]),
        )  # fmt: skip


def within_budget(
    cost: Callable[[int], tuple[float, ...]], sizes: Iterable[int], budget_s: float
) -> dict[int, tuple[float, ...]]:
    """Sizes with their seconds, as long as the next one, growing as the last ones did, stays within
    the budget."""
    costs: dict[int, tuple[float, ...]] = {}
    for size in sizes:
        if costs and _expected_s(costs, size) > budget_s:
            break
        costs[size] = cost(size)
    return costs


def _expected_s(costs: dict[int, tuple[float, ...]], size: int) -> float:
    """By the last two sizes; as the square from one alone."""
    (last, seconds), power = list(costs.items())[-1], 2.0
    if len(costs) > 1:
        before, earlier = list(costs.items())[-2]
        power = max(1.0, math.log(min(seconds) / min(earlier)) / math.log(last / before))
    return float(min(seconds) * (size / last) ** power)


def repeated(
    function: Callable[[], object], most: int = 3, enough_s: float = 2.0
) -> tuple[float, ...]:
    """Seconds of some repeats after a first one that does not count; of what is slow, the first
    one's alone."""
    first = wall_seconds(function)
    return (first,) if first > enough_s else tuple(wall_seconds(function) for _ in range(most))


def measure_growth(folder: Path, budget_s: float = BUDGET_S) -> Iterator[Figure]:
    """All curves; their points go to `folder`."""
    points: list[Point] = []
    for part in (store_curves(folder), diagnosis_curves(4 * budget_s), training_curves(budget_s)):
        for curve in part:
            points += curve.points
            yield curve.figure()
    (folder / FILE).write_text(json.dumps([asdict(point) for point in points]))


def store_curves(folder: Path, sizes: Sequence[int] = IMPACTS, repeats: int = 5) -> Iterator[Curve]:
    """Of SQLite stores in `folder`, made where they are not there yet."""
    curves: dict[str, list[Point]] = {name: [] for name in (*QUESTIONS, ROOM)}
    for size in sizes:
        url = filled(folder, size)
        with open_store(url, WRITER) as store:
            questions = {
                name: partial(_answer, store, question) for name, (question, _) in QUESTIONS.items()
            }
            seconds = take_turns(questions, repeats)
        for name, values in seconds.items():
            curves[name].append(Point("impacts", name, size, tuple(values)))
        room = float(Path(url.removeprefix("sqlite:///")).stat().st_size)
        curves[ROOM].append(Point("impacts", ROOM, size, (room,), "bytes"))
    bounds = {name: bound for name, (_, bound) in QUESTIONS.items()}
    bounds[ROOM] = (
        f"{room / sizes[-1]:.0f} bytes an impact, its pulse's figures and indexes included"
    )
    return (Curve(points, bounds[name]) for name, points in curves.items())


def _answer(store: Store, question: Callable[[Session], object]) -> object:
    with store.reading() as session:
        return question(session)


def diagnosis_curves(budget_s: float) -> Iterator[Curve]:
    options = Options(shrink=False, plan=False, rate_pulses=False)
    diagnose(gun_record([ValveFlow()]), options=options)  # imports

    def cost(size: int) -> tuple[float, ...]:
        pressures, masses = (
            np.geomspace(*ends, n) for ends, n in zip(RANGES, GRIDS[size], strict=True)
        )
        # Gas that is lost to a valve no nominal law knows.
        record = gun_record(
            [ValveFlow()], scatter=0.01, pressures_pa=pressures.tolist(), masses_kg=masses.tolist()
        )
        return repeated(lambda: diagnose(record, options=options))

    costs = within_budget(cost, GRIDS, budget_s)
    points = [Point("configurations", DIAGNOSIS, size, seconds) for size, seconds in costs.items()]
    yield Curve(points, _left_out(list(GRIDS), costs, budget_s))


def _left_out(sizes: Sequence[int], costs: dict[int, tuple[float, ...]], budget_s: float) -> str:
    rest = ", ".join(f"{size:,}" for size in sizes if size not in costs)
    return f"{rest} would take more than {budget_s:g} s and are left out" if rest else ""


def training_curves(
    budget_s: float, sizes: Sequence[int] = PULSES, names: Sequence[str] = ()
) -> Iterator[Curve]:
    """Training and 1,000 predictions of the named families (none: of all)."""
    new_inputs = pulses(ASKED)[0]
    for name in names or FAMILIES:
        training, predictions = f"training a {name}", list[Point]()

        def train(n: int, name: str = name) -> Estimator:
            x, y = pulses(n)
            return FAMILIES[name]().fit(
                x, y, np.arange(n) // PULSES_PER_GROUP, np.random.default_rng(0)
            )

        def cost(n: int, train=train, name=name, predictions=predictions) -> tuple[float, ...]:  # type: ignore[no-untyped-def]
            models: list[Estimator] = []
            seconds = repeated(lambda: models.append(train(n)), enough_s=1.0)
            predicting = repeated(partial(models[-1].predict, new_inputs), enough_s=1.0)
            predictions.append(Point("pulses", f"1,000 predictions of a {name}", n, predicting))
            return seconds

        train(50)  # imports
        family_budget_s = max(budget_s, COREGIONAL_BUDGET_S) if name == COREGIONAL else budget_s
        costs = within_budget(cost, sizes, family_budget_s)
        points = [Point("pulses", training, size, seconds) for size, seconds in costs.items()]
        yield Curve(points, _left_out(sizes, costs, family_budget_s))
        yield Curve(predictions)
