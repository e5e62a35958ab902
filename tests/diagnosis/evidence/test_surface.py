"""Between its nodes a surface is what the stage says."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import ClassVar

import numpy as np
import pytest
from numpy.polynomial.chebyshev import chebpts2
from pyroshock.diagnosis.evidence import surface as module
from pyroshock.diagnosis.evidence.coordinates import Axis, Sheet
from pyroshock.diagnosis.evidence.surface import POINTS, Surface, basis, surfaces
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.record import CampaignRecord, Configuration
from pyroshock.diagnosis.stages.base import Observable, Stage, Upstream
from pyroshock.diagnosis.stages.gun import GunStage
from pyroshock.twin.effects import Effect, Value, parameter
from support.records.gun_shots import shots, tables

Law = Callable[["Push"], np.ndarray]


@dataclass(frozen=True)
class Push(Effect):
    id = "gun.push"
    law = "as a test says"
    source = "test"
    a: Value = parameter("a", "", default=0.5, low=-1e4, high=1e4, off=0.0, likely=(-1.0, 1.0))  # noqa: RUF009 - a field()
    b: Value = parameter("b", "", default=0.5, low=-1e4, high=1e4, off=0.0, likely=(0.0, 1.0))  # noqa: RUF009 - a field()
    c: Value = parameter("c", "", default=0.5, low=-1e4, high=1e4, off=0.0)  # noqa: RUF009 - a field()


@dataclass(frozen=True)
class Pull(Push):
    id = "gun.pull"


RECORD = CampaignRecord("bench", "gun", tuple(Configuration(name, {}) for name in "xyz"), ())


class Bench(Stage):
    """Three configurations and two observables, tolerances 0.01 and 0.1, and a law for what an effect changes."""

    name: ClassVar[str] = "gun"
    simulator = "gun:bench"
    observables: tuple[Observable, ...] = (
        Observable("first", "gun", "velocity", "1", 0.01, 0.005),
        Observable("second", "gun", "velocity", "1", 0.1, 0.05),
    )
    shows: tuple[str, ...] = ("gun.push",)
    fingerprint: Hashable | None = None

    def __init__(self, law: Law, *, loose: Law | None = None, fingerprint: Hashable | None = None) -> None:
        super().__init__(RECORD)
        self.law, self.open = law, loose
        self.asked: list[list[Effect]] = []
        self.fingerprint = fingerprint

    def changes(self, sets: Sequence[Sequence[Effect]]) -> np.ndarray:
        self.asked.append([each for (each,) in sets])
        return np.array([self.law(each) for (each,) in sets])

    def loose(self, effects: Sequence[Effect], change: np.ndarray) -> np.ndarray | None:
        return None if self.open is None else change * self.open(effects[0])

    def measured(self) -> np.ndarray:
        raise NotImplementedError("surfaces ask a stage for its changes alone")

    def simulated(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> np.ndarray:
        raise NotImplementedError("surfaces ask a stage for its changes alone")

    def output(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Upstream:
        raise NotImplementedError("surfaces ask a stage for its changes alone")


class Other(Bench):
    """Of one observable, before which another effect shows as well."""

    observables = (Observable("third", "gun", "velocity", "1", 1.0, 0.05),)
    shows = ("gun.push", "gun.pull")


def even(names: str, end: float = 1.0) -> Sheet:
    """Parameters that go evenly from 0 to the end, the others off."""
    off = tuple((name, 0.0) for name in "abc" if name not in names)
    return Sheet(Push, tuple(Axis(name, "", 0.0, end, 1.0) for name in names), off)


#: By configuration and observable, within both tolerances' limits.
SIZE = 0.1 * np.array([[1.0, 2.0], [3.0, -4.0], [-5.0, 6.0]])


def square(one: Effect) -> np.ndarray:
    """Of second degree in each parameter."""
    assert isinstance(one, Push)
    a, b, c = float(one.a), float(one.b), float(one.c)
    return SIZE * (0.3 + a - 0.7 * a**2) * (1 - 0.4 * b + 0.9 * b**2) + SIZE**2 * (c - c**2) * a**2


def asked(names: str, law: Law = square, end: float = 1.0) -> Surface:
    return Surface.of(even(names, end), [Bench(law)])


def at(names: str, place: np.ndarray) -> Push:
    return Push(**{"a": 0.0, "b": 0.0, "c": 0.0, **dict(zip(names, map(float, place), strict=True))})


@pytest.mark.parametrize(("names", "nodes", "points"), [("a", 13, 385), ("ab", 9, 49), ("abc", 5, 17)])
def test_nodes_and_points_are_those_of_the_docs(names: str, nodes: int, points: int) -> None:
    """Nodes are the extrema of Chebyshev's polynomials, from end to end; points lie evenly."""
    stage = Bench(square)
    surface = Surface.of(even(names), [stage])
    along = (chebpts2(nodes) + 1) / 2
    expected = [at(names, np.array(place)) for place in itertools.product(along, repeat=len(names))]
    got = stage.asked[-1]
    for name in names:
        np.testing.assert_allclose([getattr(e, name) for e in got], [getattr(e, name) for e in expected], atol=1e-15)
    np.testing.assert_allclose(surface.nodes, [square(each) for each in got])
    assert surface.knots == nodes
    assert surface.id == "gun.push"
    evenly = list(itertools.product(np.linspace(0, 1, points), repeat=len(names)))
    np.testing.assert_allclose(surface.points, evenly, atol=1e-15)
    assert surface.valid.all()
    assert surface.loose is None


@pytest.mark.parametrize("names", ["a", "ab", "abc"])
def test_what_is_of_second_degree_is_met_everywhere(names: str) -> None:
    surface = asked(names)
    exact = np.array([square(at(names, place)) for place in surface.points])
    np.testing.assert_allclose(np.tensordot(surface.basis, surface.nodes, axes=1), exact, atol=1e-13)
    for place in np.random.default_rng(0).uniform(size=(5, len(names))):
        np.testing.assert_allclose(surface.change(place), square(at(names, place)), atol=1e-13)
        assert surface.effect(place) == at(names, place)


def test_interpolation_error_falls_with_the_cube_of_the_nodes() -> None:
    """Cubics whose slopes are of second order err by the third derivative of the law."""
    u = np.linspace(0, 1, 1001)[:, None]
    worst = []
    for n in (9, 17, 33):
        nodes = (chebpts2(n) + 1) / 2
        worst.append(np.abs(basis(u, n) @ np.exp(2 * nodes) - np.exp(2 * u[:, 0])).max())
    ratios = np.array(worst[:-1]) / np.array(worst[1:])
    assert np.all((ratios > 6.5) & (ratios < 13))


def test_basis_is_of_hermite_cubics_with_slopes_of_three_nodes() -> None:
    """Each node's weight, by the parabolas through a node and its neighbours, or through the three at an end."""
    n = 7
    nodes = (chebpts2(n) + 1) / 2
    u = np.linspace(0, 1, 57)
    for k in range(n):
        value = np.eye(n)[k]
        slopes = []
        for i in range(n):
            three = [min(max(i, 1), n - 2) + j for j in (-1, 0, 1)]
            slopes.append(np.polyval(np.polyder(np.polyfit(nodes[three], value[three], 2)), nodes[i]))
        cell = np.clip(np.searchsorted(nodes, u, side="right") - 1, 0, n - 2)
        h = nodes[cell + 1] - nodes[cell]
        t = (u - nodes[cell]) / h
        m, slope = np.array(value), np.array(slopes)
        expected = (1 + 2 * t) * (1 - t) ** 2 * m[cell] + t**2 * (3 - 2 * t) * m[cell + 1]
        expected += h * (t * (1 - t) ** 2 * slope[cell] + t**2 * (t - 1) * slope[cell + 1])
        np.testing.assert_allclose(basis(u[:, None], n)[:, k], expected, atol=1e-12)


def test_a_place_beyond_the_sheet_is_its_end() -> None:
    surface = asked("ab")
    for place, end in (((-0.2, 0.4), (0.0, 0.4)), ((0.3, 1.5), (0.3, 1.0)), ((2.0, -2.0), (1.0, 0.0))):
        np.testing.assert_allclose(surface.change(np.array(place)), square(at("ab", np.array(end))), atol=1e-13)
        assert surface.effect(np.array(place)) == at("ab", np.array(end))


Where = Callable[[np.ndarray, np.ndarray], np.ndarray]


def far_corner(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """That neither axis reaches alone."""
    return a + b > 1.55


def hole(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.abs(a - 0.5) + np.abs(b - 0.5) < 0.2


MISSING = pytest.mark.parametrize("missing", [far_corner, hole])


def without(missing: Where) -> Law:
    def law(one: Push) -> np.ndarray:
        found = square(one)
        found[1, 0] = np.nan if missing(np.array(one.a), np.array(one.b)) else found[1, 0]
        return found

    return law


@MISSING
def test_no_claim_beside_nodes_without_an_answer(missing: Where) -> None:
    """A point counts where no node of its cell is without an answer, nor next to one that is: there the law is met."""
    surface = asked("ab", without(missing))
    t = (chebpts2(9) + 1) / 2
    bad = missing(t[:, None], t)
    near = np.array([[bad[max(i - 1, 0) : i + 2, max(j - 1, 0) : j + 2].any() for j in range(9)] for i in range(9)])
    width = np.diff(t)
    left, right = np.r_[np.inf, width], np.r_[width, np.inf]
    for place, valid in zip(surface.points, surface.valid, strict=True):
        away = place[:, None] - t
        around = (away < right - 1e-12) & (away > -left + 1e-12)  # nodes of the cell that a point is in
        assert valid == (not near[np.ix_(around[0], around[1])].any())
    assert 0.1 < surface.valid.mean() < 0.9
    exact = np.array([square(at("ab", place)) for place in surface.points[surface.valid]])
    np.testing.assert_allclose(np.tensordot(surface.basis[surface.valid], surface.nodes, axes=1), exact, atol=1e-13)


@MISSING
def test_nodes_without_an_answer_take_that_of_the_nearest(missing: Where) -> None:
    surface = asked("ab", without(missing))
    t = (chebpts2(9) + 1) / 2
    places = np.array(list(itertools.product(t, t)))
    good = ~missing(places[:, 0], places[:, 1])
    assert not good.all()
    for k, place in enumerate(places):
        distance = ((places[good] - place) ** 2).sum(axis=1)
        nearest = np.flatnonzero(distance < distance.min() + 1e-9)
        options = [square(at("ab", places[good][i])) for i in nearest]
        assert any(np.allclose(surface.nodes[k], option, atol=1e-12) for option in options)


def test_without_any_answer_nothing_is_claimed() -> None:
    surface = asked("ab", lambda one: np.full((3, 2), np.nan))
    assert not surface.valid.any()
    assert np.all(surface.nodes == 0)


def steep(of: dict[str, float], column: int = 0) -> Law:
    """So many tolerances at the end of each axis, in one configuration."""

    def law(one: Push) -> np.ndarray:
        found = np.zeros((3, 2))
        tolerance = Bench.observables[column].tolerance
        found[2, column] = -sum(size * tolerance * float(getattr(one, name)) for name, size in of.items())
        return found

    return law


def ends(surface: Surface) -> list[float]:
    return [axis.end for axis in surface.sheet.axes]


@pytest.mark.parametrize("column", [0, 1])
@pytest.mark.parametrize(
    ("size", "end"),
    [(99.9, 1.0), (101.0, 15 / 16), (159.9, 10 / 16), (160.0, 9 / 16), (250.0, 6 / 16), (1500.0, 1 / 16)],
)
def test_an_axis_ends_where_a_change_reaches_a_hundred_tolerances(column: int, size: float, end: float) -> None:
    """At the last of seventeen places before that."""
    surface = asked("a", steep({"a": size}, column))
    assert ends(surface) == pytest.approx([end])
    assert np.abs(surface.nodes[:, 2, column]).max() == pytest.approx(size * end * Bench.observables[column].tolerance)
    assert surface.valid.all()


def test_an_axis_ends_at_its_last_answer() -> None:
    def stops(one: Push) -> np.ndarray:
        return square(one) if float(one.a) < 0.4 else np.full((3, 2), np.nan)

    assert ends(asked("a", stops)) == pytest.approx([6 / 16])
    assert ends(asked("ba", stops)) == pytest.approx([1.0, 6 / 16])


def test_only_what_is_absurd_alone_is_cut() -> None:
    """One axis is too long, the other is not; of two that are too much only together neither is."""
    assert ends(asked("ab", steep({"a": 200.0, "b": 50.0}))) == pytest.approx([7 / 16, 1.0])
    assert ends(asked("ab", steep({"a": 50.0, "b": 400.0}))) == pytest.approx([1.0, 3 / 16])
    assert ends(asked("ab", steep({"a": 60.0, "b": 60.0}))) == [1.0, 1.0]


def test_an_axis_is_cut_at_its_first_absurd_change() -> None:
    def hump(one: Push) -> np.ndarray:
        found = square(one)
        found[0, 0] = 10.0 if 0.45 < float(one.a) < 0.55 or float(one.a) > 0.95 else found[0, 0]
        return found

    assert ends(asked("a", hump)) == pytest.approx([7 / 16])


def test_an_axis_without_an_answer_is_left_as_it_is() -> None:
    assert ends(asked("a", steep({"a": 1601.0}))) == [1.0]
    assert ends(asked("a", lambda one: np.full((3, 2), np.nan))) == [1.0]


def test_what_laws_leave_open_stands_in_the_columns_of_their_stage() -> None:
    def third(one: Push) -> np.ndarray:
        return square(one)[:, 1:]

    def left(one: Push) -> np.ndarray:
        return np.where(np.arange(3)[:, None] == 1, np.nan, 2.0 + float(one.a)) * np.ones((3, 1))

    for last in (False, True):
        stages: list[Stage] = [Bench(square), Other(third, loose=left)]
        columns = slice(2, 3) if last else slice(0, 1)
        surface = Surface.of(even("a"), stages if last else stages[::-1])
        assert surface.loose is not None
        t = (chebpts2(13) + 1) / 2
        expected = np.zeros_like(surface.nodes)
        expected[:, [0, 2], columns] = surface.nodes[:, [0, 2], columns] * (2 + t)[:, None, None]
        np.testing.assert_allclose(surface.loose, expected, atol=1e-13)
        assert np.abs(expected).max() > 0.5


def test_some_of_the_configurations_are_some_of_the_rows() -> None:
    definite, open_ = asked("a"), Surface.of(even("a"), [Bench(square, loose=lambda one: np.full((3, 2), 3.0))])
    for whole in (definite, open_):
        some = whole.only(np.array([2, 0]))
        np.testing.assert_array_equal(some.nodes, whole.nodes[:, [2, 0]])
        np.testing.assert_array_equal(some.points, whole.points)
    assert definite.only(np.array([2, 0])).loose is None
    np.testing.assert_allclose(open_.only(np.array([2, 0])).loose, 3 * open_.nodes[:, [2, 0]])


def test_a_stage_that_does_not_show_an_effect_is_not_moved_nor_asked() -> None:
    first, second = Bench(square), Other(lambda one: square(one)[:, :1])
    found = Surface.of(Sheet(Pull, even("a").axes), [first, second])
    assert first.asked == []
    assert np.all(found.nodes[..., :2] == 0)
    assert np.abs(found.nodes[..., 2]).max() > 0.1


def test_every_sheet_of_what_some_stage_shows() -> None:
    """Signs apart, in the order of the effects; those without any answer are left out."""

    @dataclass(frozen=True)
    class Unseen(Push):
        id = "gun.unseen"

    def positive(one: Effect) -> np.ndarray:
        assert isinstance(one, Push)
        return (
            square(one)[:, :1]
            if float(one.a) >= 0 and not (isinstance(one, Pull) and one.b > 0.5)
            else np.full((3, 1), np.nan)
        )

    told: list[str] = []
    found = surfaces([Bench(square), Other(positive)], [Pull, Unseen, Push], told.append)
    assert told == ["gun.pull", "gun.push"]
    assert [(each.id, *ends(each)) for each in found] == [
        ("gun.pull", 1.0, pytest.approx((11 / 16) ** 2)),
        ("gun.push", 1.0, 1.0),
    ]
    quietly = surfaces([Bench(square), Other(positive)], [Pull, Unseen, Push])
    assert [each.id for each in quietly] == ["gun.pull", "gun.push"]


def test_campaigns_of_one_design_are_simulated_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_KEPT", {})
    first, again, another = (Bench(square, fingerprint=design) for design in ("one", "one", "two"))
    tables = [Surface.of(even("a"), [stage]).nodes for stage in (first, again, another)]
    assert [len(stage.asked) for stage in (first, again, another)] == [2, 0, 2]  # its end, and its nodes
    np.testing.assert_array_equal(tables[0], tables[1])
    longer = Surface.of(even("a", 0.5), [again])
    assert len(again.asked) == 2
    assert np.abs(longer.nodes - tables[0]).max() > 0.01
    assert len(Surface.of(even("a"), [Other(square, fingerprint="one")]).nodes) == 13  # another stage's are its own


def test_without_a_design_in_common_each_campaign_is_simulated(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_KEPT", {})
    first, again = Bench(square), Bench(square)
    for stage in (first, again):
        Surface.of(even("a"), [stage])
    assert [len(stage.asked) for stage in (first, again)] == [2, 2]


def test_the_oldest_simulated_tables_make_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_KEPT", {})
    monkeypatch.setattr(module, "_MOST_KEPT", 4)  # two for each stage: its end, and its nodes
    stages = [Bench(square, fingerprint=design) for design in range(3)]
    for stage in stages:
        Surface.of(even("a"), [stage])
    again = [Bench(square, fingerprint=stage.fingerprint) for stage in stages]
    for stage in reversed(again):
        Surface.of(even("a"), [stage])
    assert [len(stage.asked) for stage in again] == [2, 0, 0]
    assert len(module._KEPT) == 4


@cache
def made() -> tuple[GapTable, tuple[Surface, ...], GunStage]:
    return tables(shots())


def test_surfaces_interpolate_the_stage() -> None:
    """To a third of the tolerance and 5 % of the change, wherever they claim to be valid: laws are off by a tenth."""
    gap, surfaces, stage = made()
    assert len(surfaces) > 10
    for surface in surfaces:
        rng = np.random.default_rng(1)
        u = surface.points[rng.choice(np.flatnonzero(surface.valid), 24)]
        exact = stage.changes([[surface.effect(row)] for row in u])
        near = np.array([surface.change(row) for row in u])
        assert np.isfinite(exact).all()
        far = np.abs(near - exact) - 0.33 * gap.tolerance[0] - 0.05 * np.abs(exact)
        assert np.all(far < 0), (surface.id, [axis.name for axis in surface.sheet.axes], far.max())


def test_basis_sums_to_one() -> None:
    u = np.random.default_rng(0).uniform(size=(40, 2))
    np.testing.assert_allclose(basis(u, 7).sum(axis=1), 1.0, atol=1e-12)


def test_points_are_many_enough_for_a_narrow_posterior() -> None:
    """Neighbours differ by less than a standard error of a mean of four shots."""
    for surface in made()[1]:
        if len(surface.sheet.axes) == 1:
            changes = (surface.basis @ surface.nodes.reshape(len(surface.nodes), -1))[surface.valid]
            inside = np.abs(changes).max(axis=1) < 0.3
            steps = np.abs(np.diff(changes[inside], axis=0)).max(axis=1)
            assert np.median(steps) < 0.0075
            assert len(surface.points) == POINTS[1]
