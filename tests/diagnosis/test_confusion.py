"""Which hypotheses go under one probability: distances against dense matrices, and groups against their rules."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.diagnosis import confusion
from pyroshock.diagnosis.confusion import Group, distance, groups
from pyroshock.diagnosis.evidence.form import SHARES, form_modes
from pyroshock.diagnosis.evidence.pairs import OnPair
from pyroshock.diagnosis.evidence.scene import Scene
from pyroshock.diagnosis.evidence.singles import OnSurface
from pyroshock.diagnosis.evidence.surface import surfaces
from pyroshock.diagnosis.evidence.weighing import Weighed
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.verdict import NONE, UNKNOWN
from scipy.stats import norm
from support.records.toy_bench import (
    Design,
    ToyForceGain,
    ToyLayer,
    ToyLeak,
    ToyLoss,
    ToyMass,
    ToyVelocityGain,
    campaign,
    changes_of,
    stages_of,
)

LOSS, LEAK, MASS, LAYER = "gun.toy_loss", "gun.toy_leak", "contact.toy_mass", "contact.toy_layer"
FORCE, VELOCITY = "sensor.toy_force_gain", "sensor.toy_velocity_gain"
SINGLES = (LOSS, LEAK, MASS, LAYER, FORCE, VELOCITY)
KINDS = (ToyLoss, ToyLeak, ToyMass, ToyLayer, ToyForceGain, ToyVelocityGain)
#: Backgrounds with errors of all kinds: of half a tolerance and of a whole one.
MIXED, COARSE = 5, 6
#: Which of an effect's sheets (signs of its parameter) it is fitted on, at which of the 385 points, and before which
#: background; the columns behind those of the bank are those with an error of the law's form.
Place = tuple[int, int, int]


@cache
def scene() -> Scene:
    """Gun and contact, eight settings."""
    design = Design(masses_kg=(0.5,))
    stages = stages_of(campaign([], np.random.default_rng(1), design))[:2]
    return Scene.of(GapTable.of(stages[0].record, stages), surfaces(stages, KINDS))


def fitted(places: Mapping[str, Place], both: Mapping[str, OnPair] | None = None, seen: Scene | None = None) -> Weighed:
    """Effects as if they had been found there; what is not named at the middle of its first sheet."""
    seen = seen or scene()
    singles = {}
    for name in seen.ids:
        chosen, point, column = places.get(name, (0, 192, MIXED))
        found = []
        for number, index in enumerate(seen.sheets(name)):
            log = np.full((len(seen.surfaces[index].points), 2 * len(seen.before)), -1e3)
            log[point, column] = 0.0
            found.append(OnSurface(seen.surfaces[index], seen.log_prior[index], log, -3.0 * abs(number - chosen)))
        singles[name] = tuple(found)
    names = (NONE, UNKNOWN, *singles, *(both or {}))
    return Weighed(seen, dict.fromkeys(names, 0.0), dict.fromkeys(names, 0.0), singles, dict(both or {}))


def pair(one: str, other: str, u: tuple[float, float], background: int) -> OnPair:
    first, second = (scene().sheets(name)[-1] for name in (one, other))
    places = (np.array([u[0]]), np.array([u[1]]))
    return OnPair(first, second, places, places, background, 0.0)


BOTH = (f"{LOSS}+{MASS}", f"{LEAK}+{LAYER}", f"{FORCE}+{VELOCITY}")


@cache
def pairs() -> dict[str, OnPair]:
    found = (
        pair(LOSS, MASS, (0.8, 0.9), 2),
        pair(LEAK, LAYER, (0.6, 0.3), MIXED),
        pair(FORCE, VELOCITY, (0.5, 0.7), 3),
    )
    return dict(zip(BOTH, found, strict=True))


PLACES: dict[str, Place] = {LOSS: (1, 300, 3), LEAK: (0, 200, MIXED), MASS: (0, 350, 8 + 2), FORCE: (1, 150, 8 + 6)}


def at_points(index: int) -> np.ndarray:
    """(M, N): the changes of one sheet at all its points, in tolerances."""
    surface = scene().surfaces[index]
    changes = np.tensordot(surface.basis, surface.nodes, axes=1)
    return np.array([scene().cells.take(table) for table in changes])


def change(name: str) -> np.ndarray:
    """(N,): of a hypothesis where `PLACES` and `pairs()` have it."""
    if name in pairs():
        found = pairs()[name]
        both = [scene().surfaces[i].change(u) for i, u in zip((found.first, found.second), found.u, strict=True)]
        return scene().cells.take(both[0] + both[1])
    sheet, point, _ = PLACES[name]
    return np.asarray(at_points(scene().sheets(name)[sheet])[point])


def background(name: str) -> int:
    return pairs()[name].background if name in pairs() else PLACES[name][2] % len(scene().before)


def allowed(at: int, law: np.ndarray, share: float = SHARES[-1]) -> np.ndarray:
    """(N, N): the inverse of a background's covariance, widened by an error of a law's form."""
    lower, modes = scene().before[at].lower, form_modes(scene())
    return np.linalg.inv(lower @ lower.T + share**2 * np.outer(law, law) * (modes @ modes.T))


def nearest(one: str, other: str, share: float = SHARES[-1]) -> float:
    """By dense matrices, over all points of the other that have a prior."""
    law = change(one)
    inverse = allowed(background(one), law, share)
    if other in pairs():
        apart = law - change(other)
        return float(np.sqrt(apart @ inverse @ apart))
    rows = np.concatenate([at_points(i)[np.isfinite(scene().log_prior[i])] for i in scene().sheets(other)])
    return float(np.sqrt(np.einsum("mi,ij,mj->m", law - rows, inverse, law - rows).min()))


def test_the_scene_is_what_these_tests_need() -> None:
    """Both signs of four effects, points without a prior, fewer directions of a law's error than cells."""
    assert set(scene().ids) == set(SINGLES)
    assert [len(scene().sheets(name)) for name in SINGLES] == [2, 1, 2, 1, 2, 2]
    assert len(scene().before) == 8
    assert form_modes(scene()).shape == (32, 24)
    assert all(np.isinf(prior).any() for prior in scene().log_prior)


@pytest.mark.parametrize("other", [*SINGLES, *BOTH])
@pytest.mark.parametrize("one", [*PLACES, *BOTH])
def test_distance_is_that_of_dense_matrices(one: str, other: str) -> None:
    """The covariance in full, with the error of the law's form in it, before the background of the one."""
    found = distance(fitted(PLACES, pairs()), one, other)
    assert found == pytest.approx(nearest(one, other), rel=1e-6, abs=1e-4)


def test_distance_of_pairs_is_that_of_their_simulations() -> None:
    """What two effects do is added up; on this bench, which is linear in logarithms, they do no more together."""
    weighed = fitted(PLACES, pairs())
    stages = stages_of(scene().gap.record)[:2]
    one, _, other = BOTH
    tables = [
        np.concatenate([changes_of(stage, [pairs()[name].effects(scene())])[0] for stage in stages], axis=1)
        for name in (one, other)
    ]
    law, rival = (scene().cells.take(table) for table in tables)
    square = (law - rival) @ allowed(pairs()[one].background, law) @ (law - rival)
    assert distance(weighed, one, other) == pytest.approx(np.sqrt(square), rel=2e-3)


def test_the_widest_error_of_form_is_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(confusion, "SHARES", (0.02, 0.1, 0.3))
    found = distance(fitted(PLACES, pairs()), LOSS, LEAK)
    assert found == pytest.approx(nearest(LOSS, LEAK, 0.3), rel=1e-6)
    assert found < nearest(LOSS, LEAK, 0.1)


@pytest.mark.parametrize("name", SINGLES)
def test_nothing_is_apart_from_itself(name: str) -> None:
    """At any of its likely points: rounding makes no negative square."""
    for sheet, index in enumerate(scene().sheets(name)):
        points = np.flatnonzero(np.isfinite(scene().log_prior[index]))[:: 384 // 12]
        for point in points:
            assert distance(fitted({name: (sheet, int(point), MIXED)}), name, name) == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("name", BOTH)
def test_no_pair_is_apart_from_itself(name: str) -> None:
    assert distance(fitted({}, pairs()), name, name) == 0.0


def test_distance_is_the_same_both_ways_where_laws_are_taken_at_their_word(monkeypatch: pytest.MonkeyPatch) -> None:
    """And the background is the same; the error of a law's form is the one's, whose change differs."""
    alike = {name: replace(each, background=MIXED) for name, each in pairs().items()}
    weighed = fitted({}, alike)
    one, other, _ = BOTH
    assert distance(weighed, one, other) != pytest.approx(distance(weighed, other, one), rel=1e-3)
    monkeypatch.setattr(confusion, "SHARES", (1e-9,))
    assert distance(weighed, one, other) == pytest.approx(distance(weighed, other, one))


def test_the_nearest_is_one_that_has_a_prior() -> None:
    """No prior allows the leak that is nearest, nor those like it."""
    index = scene().sheets(LEAK)[0]
    law = change(MASS)
    apart = law - at_points(index)
    squares = np.einsum("mi,ij,mj->m", apart, allowed(background(MASS), law), apart)
    allowed_points = np.isfinite(scene().log_prior[index]) & (squares > 1.1 * nearest(MASS, LEAK) ** 2)
    priors = list(scene().log_prior)
    priors[index] = np.where(allowed_points, priors[index], -np.inf)
    weighed = fitted(PLACES, seen=replace(scene(), log_prior=tuple(priors)))
    assert distance(weighed, MASS, LEAK) == pytest.approx(np.sqrt(squares[allowed_points].min()), rel=1e-6)


@cache
def weak() -> dict[str, Place]:
    """Where effects are so small that a loss and a misread velocity are hardly apart."""
    first = {name: np.isfinite(scene().log_prior[scene().sheets(name)[0]]).argmax() for name in SINGLES}
    return {name: (0, int(point), COARSE) for name, point in first.items()}


def strong() -> dict[str, Place]:
    return dict.fromkeys(SINGLES, (0, 384, MIXED))


def members(found: tuple[Group, ...]) -> list[tuple[str, ...]]:
    return [group.members for group in found]


def test_weak_effects_are_near_and_strong_ones_far() -> None:
    near, far = fitted(weak()), fitted(strong())
    assert distance(near, LOSS, VELOCITY) < 1.0
    assert all(distance(far, LOSS, other) > 5.0 for other in SINGLES[1:])


def test_two_are_one_where_the_wrong_one_would_be_chosen_in_a_tenth_of_the_cases() -> None:
    """A misread velocity, the more so the farther from a loss, which these data leave 5 %."""
    shares = []
    for point in range(weak()[VELOCITY][1], 385, 2):
        weighed = fitted({VELOCITY: (0, point, MIXED)})
        wrong = float(norm.cdf(-0.5 * distance(weighed, VELOCITY, LOSS)))
        together = len(groups(weighed, {VELOCITY: 0.95, LOSS: 0.05})) == 1
        shares.append(wrong)
        if abs(wrong - 0.10) > 0.005:
            assert together is (wrong > 0.10)
    assert any(0.105 < wrong < 0.12 for wrong in shares)
    assert any(0.08 < wrong < 0.095 for wrong in shares)


@pytest.mark.parametrize(("rival", "together"), [(0.099, False), (0.1, True), (0.101, True)])
def test_what_the_data_leave_a_tenth_is_not_told_apart(rival: float, together: bool) -> None:
    """However far apart they are as fitted."""
    found = members(groups(fitted(strong()), {LOSS: 1 - rival, LAYER: rival}))
    assert found == ([(LOSS, LAYER)] if together else [(LOSS,), (LAYER,)])


@pytest.mark.parametrize(("share", "together"), [(0.9, False), (1.0, False), (1.1, True)])
def test_what_is_far_less_likely_is_not_named_beside_the_first(share: float, together: bool) -> None:
    """However near it is: below a fiftieth of it."""
    found = members(groups(fitted(weak()), {LOSS: 0.5, VELOCITY: 0.5 * share * 0.02}))
    assert found == ([(LOSS, VELOCITY)] if together else [(LOSS,), (VELOCITY,)])


def test_far_rivals_stand_alone_and_near_ones_behind_them_do_not() -> None:
    one, far, near = BOTH
    weighed = fitted({}, pairs() | {near: pairs()[one]})
    assert distance(weighed, one, far) > 5.0
    found = groups(weighed, {one: 0.9, far: 0.06, near: 0.04})
    assert members(found) == [(one, near), (far,)]


@pytest.mark.parametrize("alone", [NONE, UNKNOWN])
@pytest.mark.parametrize("share", [0.6, 0.33, 0.15])
def test_none_and_unknown_stand_alone(alone: str, share: float) -> None:
    """As the likeliest, between two that are near each other, and behind them."""
    probability = {LOSS: 0.55 * (1 - share), alone: share, LEAK: 0.45 * (1 - share)}
    found = groups(fitted(weak()), probability)
    assert set(members(found)) == {(alone,), (LOSS, LEAK)}


def test_none_and_unknown_are_not_one() -> None:
    found = groups(fitted(weak()), {UNKNOWN: 0.4, NONE: 0.6})
    assert members(found) == [(NONE,), (UNKNOWN,)]


def test_pairs_and_single_effects_are_not_one() -> None:
    """However much the data leave each; nor does one of a kind keep two of the other apart."""
    one, other, _ = BOTH
    found = groups(fitted(weak(), pairs()), {LOSS: 0.4, one: 0.3, LEAK: 0.2, other: 0.1})
    assert members(found) == [(LOSS, LEAK), (one, other)]


def test_a_group_names_four_at_most_and_the_likeliest_of_them_first() -> None:
    """The others begin another."""
    values = (0.1, 0.25, 0.12, 0.2, 0.18, 0.15)
    found = groups(fitted(weak()), dict(zip(SINGLES, values, strict=True)))
    assert members(found) == [(LEAK, LAYER, FORCE, VELOCITY), (MASS, LOSS)]
    assert [group.each for group in found] == [(0.25, 0.2, 0.18, 0.15), (0.12, 0.1)]
    assert [group.probability for group in found] == pytest.approx([0.78, 0.22])


def test_groups_stand_in_the_order_of_their_sums() -> None:
    """Two that share 60 % come before the one hypothesis that is likelier than each."""
    found = groups(fitted(weak()), {NONE: 0.4, LOSS: 0.31, LEAK: 0.29})
    assert members(found) == [(LOSS, LEAK), (NONE,)]
    assert [group.probability for group in found] == pytest.approx([0.6, 0.4])


@settings(max_examples=25)
@given(st.lists(st.floats(1e-4, 1.0), min_size=11, max_size=11), st.sampled_from([weak, strong, dict]))
def test_every_hypothesis_is_in_one_group_with_its_probability(
    weights: list[float], places: Callable[[], dict[str, Place]]
) -> None:
    weighed = fitted(places(), pairs())
    probability = {name: w / sum(weights) for name, w in zip(weighed.log_joint, weights, strict=True)}
    found = groups(weighed, probability)
    assert sorted(name for group in found for name in group.members) == sorted(probability)
    for group in found:
        assert group.each == tuple(probability[name] for name in group.members)
        assert list(group.each) == sorted(group.each, reverse=True)
        assert group.probability == pytest.approx(sum(group.each))
        assert len(group.members) <= 4
    totals = [group.probability for group in found]
    assert totals == sorted(totals, reverse=True)
    assert sum(totals) == pytest.approx(1.0)
