"""All hypotheses on one scale, each against its own sum; which pairs are tried, refined and simulated."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from pyroshock.diagnosis.evidence import weighing
from pyroshock.diagnosis.evidence.background import under
from pyroshock.diagnosis.evidence.form import form_modes, left_open, with_form_error
from pyroshock.diagnosis.evidence.pairs import OnPair, Started, interaction, of_pair, start_pair
from pyroshock.diagnosis.evidence.scene import Scene
from pyroshock.diagnosis.evidence.singles import OnSurface, of_none, of_strays, of_surface
from pyroshock.diagnosis.evidence.surface import Surface
from pyroshock.diagnosis.evidence.weighing import Weighed, weigh
from pyroshock.diagnosis.hypotheses import Priors
from pyroshock.twin.effects import Effect, catalogue
from support.records.small_scenes import law, small, small_scene, with_gap
from support.records.toy_bench import ToyGun, ToyLoss, ToyMass

GAP = small()[0]
SHAPE = GAP.mean.shape
KINDS = [kind for kind in catalogue().values() if any(item.likely for item in kind.parameters())]


def laws(seed: int = 1, size: float = 3.0) -> list[Surface]:
    """Ten effects in random directions; the first has two signs."""
    rng = np.random.default_rng(seed)
    ends = size * GAP.tolerance * rng.standard_normal((10, 1, *SHAPE))
    found = [law(kind, end, 60) for kind, end in zip(KINDS[:10], ends, strict=True)]
    return [*found, law(KINDS[0], -ends[0], 60)]


@cache
def ten(seed: int = 1, rough: float = 0.5) -> Scene:
    """A gap of three of them and some scatter."""
    every = laws(seed)
    rng = np.random.default_rng(seed + 100)
    change = 0.5 * every[2].nodes[-1] + 0.3 * every[6].nodes[-1] + 0.25 * every[9].nodes[-1]
    return Scene.of(with_gap(GAP, change + rough * GAP.tolerance * rng.standard_normal(SHAPE)), every)


@cache
def one() -> Scene:
    """A gap of one of them and little beside."""
    every = laws()
    rough = 0.35 * GAP.tolerance * np.random.default_rng(3).standard_normal(SHAPE)
    return Scene.of(with_gap(GAP, 0.6 * every[4].nodes[-1] + rough), every)


@cache
def completed(seed: int) -> Scene:
    """Four effects that are each near the gap but for a part of their own, two for each that undo this part and explain
    nothing alone, and six others that are somewhat like the gap."""
    rng = np.random.default_rng(seed)
    gap, parts = 4 * rng.standard_normal(SHAPE), 4 * rng.standard_normal((4, *SHAPE))
    near = [gap + 0.5 * part for part in parts]
    undoing = [-part + share * rng.standard_normal(SHAPE) for part in parts for share in (0.5, 1.0)]
    others = [gap + 5 * rng.standard_normal(SHAPE) for _ in range(6)]
    every = [law(kind, GAP.tolerance * end[None], 40) for kind, end in zip(KINDS, [*near, *undoing, *others])]  # noqa: B905
    return Scene.of(with_gap(GAP, GAP.tolerance * (0.8 * gap + 0.5 * rng.standard_normal(SHAPE))), every)


def alone(scene: Scene, z: np.ndarray | None = None) -> tuple[list[OnSurface], list[np.ndarray]]:
    whitened = [white.white(scene.cells.z if z is None else z) for white in scene.before]
    return [of_surface(scene, i, whitened) for i in range(len(scene.surfaces))], whitened


def by_effect(scene: Scene, plain: Sequence[OnSurface]) -> dict[str, float]:
    """Sheets of one effect are alike."""
    found: dict[str, list[float]] = {}
    for surface, one in zip(scene.surfaces, plain, strict=True):
        found.setdefault(surface.id, []).append(one.log_evidence)
    return {name: float(np.logaddexp.reduce(logs)) - np.log(len(logs)) for name, logs in found.items()}


@pytest.mark.parametrize("scene", [ten(1), ten(2), one()], ids=["some", "others", "one"])
def test_single_effects_none_and_unknown_are_their_own_means(scene: Scene) -> None:
    found = weigh(scene, quick=True)
    plain, _ = alone(scene)
    for name, log in by_effect(scene, plain).items():
        assert found.log_evidence[name] == pytest.approx(log)
    none = of_none(scene, scene.cells.z)
    assert found.log_evidence["none"] == pytest.approx(np.logaddexp.reduce(none) - np.log(len(none)))
    always = [i for i, one in enumerate(scene.backgrounds) if one in under(scene.gap.stages)]
    best = max(plain, key=lambda one: one.log_evidence)
    suited = [*np.argsort(none)[-2:], *np.argsort(best.log_likelihood.max(axis=0))[-2:]]
    astray = list(of_strays(scene, scene.cells.z, sorted({*always, *suited})).values())
    assert found.log_evidence["unknown"] == pytest.approx(np.logaddexp.reduce(astray) - np.log(len(astray)))


@pytest.mark.parametrize("priors", [Priors(), Priors(0.1, 0.3, 0.4, 0.2)], ids=["published", "other"])
def test_members_share_the_prior_of_their_kind(priors: Priors) -> None:
    """Ten single effects, and 45 pairs whether they are tried or not."""
    found = weigh(ten(), priors, quick=True)
    assert found.pairs
    for name, log in found.log_joint.items():
        share = {"none": priors.none, "unknown": priors.unknown}.get(name, priors.singles / 10)
        share = priors.pairs / 45 if "+" in name else share
        assert log - found.log_evidence[name] == pytest.approx(np.log(share))
    assert sum(found.probability.values()) == pytest.approx(1.0)
    assert list(found.probability.values()) == sorted(found.probability.values(), reverse=True)
    total = np.logaddexp.reduce(list(found.log_joint.values()))
    for name, probability in found.probability.items():
        assert probability == pytest.approx(np.exp(found.log_joint[name] - total))


def test_of_one_effect_there_is_no_pair() -> None:
    scene = Scene.of(GAP, laws()[1:2])
    found = weigh(scene)
    assert set(found.log_joint) == {"none", "unknown", scene.ids[0]}
    assert found.log_joint[scene.ids[0]] - found.log_evidence[scene.ids[0]] == pytest.approx(np.log(0.5))


def test_pairs_without_a_prior_are_not_tried() -> None:
    found = weigh(ten(), Priors(0.3, 0.5, 0.0, 0.2), quick=True)
    assert not found.pairs
    assert len(found.log_joint) == 12
    rare = weigh(ten(), Priors(0.3, 0.5, 1e-12, 0.2 - 1e-12), quick=True)
    assert rare.pairs


def test_what_has_no_prior_has_no_probability() -> None:
    found = weigh(ten(), Priors(0.0, 0.7, 0.1, 0.2), quick=True)
    assert found.log_joint["none"] == -np.inf
    assert found.probability["none"] == 0.0


@pytest.mark.parametrize("quick", [False, True])
@pytest.mark.parametrize("scene", [ten(2), completed(1), completed(4)], ids=["ten", "completed", "others"])
def test_which_pairs_are_tried_and_which_are_kept(
    scene: Scene,
    quick: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Among the seven best single effects, and each of the best three with the two that explain best what it leaves;
    quick: the four best, each on its likeliest sheet. The eight likeliest are summed, the four best simulated."""
    plain, whitened = alone(scene)
    evidence = by_effect(scene, plain if quick else shaped(scene))
    ranked = sorted(evidence, key=lambda name: evidence[name], reverse=True)
    pairs = {frozenset(pair) for pair in itertools.combinations(ranked[: 4 if quick else 7], 2)}
    for name in [] if quick else ranked[:3]:
        sheet = max((plain[i] for i in scene.sheets(name)), key=lambda one: one.log_evidence)
        change = sheet.surface.change(sheet.surface.points[sheet.best[0]])
        left = by_effect(scene, alone(scene, scene.cells.z - scene.cells.take(change))[0])
        others = sorted(set(left) - {name}, key=lambda other: left[other], reverse=True)
        pairs |= {frozenset((name, other)) for other in others[:2]}
    tried: list[tuple[int, int]] = []
    summed: list[tuple[int, int]] = []
    simulated: list[tuple[int, int]] = []

    def start(of: Scene, first: int, second: int, *more: object) -> object:
        if not simulated:
            tried.append((first, second))
        return start_pair(of, first, second, *more)

    def fine(of: Scene, begun: Started, before: list[np.ndarray]) -> OnPair:
        if not simulated:
            summed.append((begun.first, begun.second))
        return of_pair(of, begun, before)

    def open_(of: Scene, sheets: list[tuple[Surface, np.ndarray]], *more: object, errors: bool) -> list[np.ndarray]:
        assert errors == (not quick)
        first, second = (of.surfaces.index(surface) for surface, _ in sheets)
        simulated.append((first, second))
        return left_open(of, sheets, *more, errors=errors)

    monkeypatch.setattr(weighing, "start_pair", start)
    monkeypatch.setattr(weighing, "of_pair", fine)
    monkeypatch.setattr(weighing, "left_open", open_)
    found = weigh(scene, quick=quick)

    def likeliest(name: str) -> list[int]:
        return sorted(scene.sheets(name), key=lambda i: plain[i].log_evidence)[-1:] if quick else scene.sheets(name)

    place = scene.ids.index
    names = [tuple(sorted(pair, key=place)) for pair in pairs]
    assert sorted(tried) == sorted((i, j) for a, b in names for i in likeliest(a) for j in likeliest(b))
    begun = {(i, j): start_pair(scene, i, j, dict(enumerate(plain)), whitened) for i, j in tried}
    best = {
        f"{a}+{b}": max((begun[i, j] for i in likeliest(a) for j in likeliest(b)), key=lambda one: one.log_likelihood)
        for a, b in names
    }
    kept = sorted(best, key=lambda name: best[name].log_likelihood, reverse=True)[: min(8, len(names))]
    assert sorted(summed) == sorted((best[name].first, best[name].second) for name in kept)
    assert set(found.pairs) == set(kept)
    once = {name: of_pair(scene, best[name], whitened).log_evidence for name in kept}
    four = sorted(once, key=lambda name: once[name], reverse=True)[:4]
    assert sorted(simulated) == sorted((best[name].first, best[name].second) for name in four)
    for name in set(kept) - set(four):
        assert found.pairs[name].log_evidence == pytest.approx(once[name])


def test_backgrounds_that_suit_an_effect_are_others_than_those_that_suit_none() -> None:
    """So that the sum above has them by the effect alone."""
    scene = one()
    plain, _ = alone(scene)
    best = max(plain, key=lambda one: one.log_evidence)
    suited = np.argsort(best.log_likelihood.max(axis=0))[-2:]
    without = np.argsort(of_none(scene, scene.cells.z))[-2:]
    always = [i for i, one in enumerate(scene.backgrounds) if one in under(scene.gap.stages)]
    assert set(suited) - set(without) - set(always)
    assert set(without) - set(suited) - set(always)


def shaped(scene: Scene) -> list[OnSurface]:
    plain, whitened = alone(scene)
    top = max(one.log_evidence for one in plain)
    modes = form_modes(scene)
    return [
        with_form_error(scene, i, one, whitened, modes) if top - one.log_evidence < 40 + len(scene.cells.z) else one
        for i, one in enumerate(plain)
    ]


def test_the_form_of_a_law_may_err_where_it_is_near_the_best() -> None:
    """Near: so many nats, and one more for each cell; far from it nobody looks."""
    scene = ten(rough=0.5)
    scene = Scene.of(with_gap(GAP, 2.0 * scene.gap.mean), laws())
    plain, _ = alone(scene)
    logs = np.array([one.log_evidence for one in plain])
    assert 0 < np.sum(logs < logs.max() - 40 - len(scene.cells.z)) < len(logs) - 1
    found = weigh(scene, Priors(0.3, 0.5, 0.0, 0.2))
    expected = shaped(scene)
    for i, one in enumerate(one for name in scene.ids for one in found.singles[name]):
        index = [j for name in scene.ids for j in scene.sheets(name)][i]
        assert one.log_likelihood.shape == expected[index].log_likelihood.shape
        assert one.log_evidence == pytest.approx(expected[index].log_evidence)
        assert (one.log_likelihood.shape == plain[index].log_likelihood.shape) == (
            logs[index] <= logs.max() - 40 - len(scene.cells.z)
        )


def loosened(scene: Scene, which: Sequence[int]) -> Scene:
    """With laws that leave half of a change open in one observable."""
    some = tuple(
        replace(surface, loose=1.5 * np.abs(surface.nodes) * (np.arange(4) == 2)) if i in which else surface
        for i, surface in enumerate(scene.surfaces)
    )
    return replace(scene, surfaces=some)


def test_what_a_law_leaves_open_is_looked_for_even_in_haste() -> None:
    scene = loosened(ten(), [2])
    plain, whitened = alone(scene)
    modes = form_modes(scene)
    found = weigh(scene, quick=True)
    for name in scene.ids:
        for i, one in zip(scene.sheets(name), found.singles[name], strict=True):
            expected = with_form_error(scene, i, plain[i], whitened, modes) if i == 2 else plain[i]
            assert one.log_evidence == pytest.approx(expected.log_evidence)
    assert found.log_evidence[scene.surfaces[2].id] != pytest.approx(plain[2].log_evidence, abs=0.01)


class Additive(ToyGun):
    """Two do what each does; or more by so many tolerances everywhere."""

    more = 0.0

    @property
    def together(self) -> np.ndarray:
        return np.full(SHAPE, self.more) * GAP.tolerance

    def changes(self, sets: Sequence[Sequence[Effect]]) -> np.ndarray:
        return np.array([self.together if len(each) == 2 else np.zeros(SHAPE) for each in sets])


def bench(more: float) -> Additive:
    stage = Additive(GAP.record)
    stage.more = more
    return stage


@pytest.mark.parametrize("more", [0.0, 0.7])
def test_what_two_do_together_is_taken_off_the_gap(more: float) -> None:
    """Of the four best pairs, which are summed again then."""
    scene = ten()
    before, found = weigh(scene, quick=True), weigh(scene, stages=[bench(more)], quick=True)
    assert list(found.pairs) == list(before.pairs)
    best = sorted(before.pairs, key=lambda name: before.pairs[name].log_evidence, reverse=True)[:4]
    for name, pair in before.pairs.items():
        z = scene.cells.z - (interaction(scene, pair, [bench(more)]) if name in best else 0.0)
        _, whitened = alone(scene, z)
        one = {i: of_surface(scene, i, whitened) for i in (pair.first, pair.second)}
        again = of_pair(scene, start_pair(scene, pair.first, pair.second, one, whitened), whitened)
        assert found.pairs[name].log_evidence == pytest.approx(again.log_evidence)
        assert (found.pairs[name].log_evidence == pytest.approx(pair.log_evidence)) == (more == 0 or name not in best)


def test_two_that_have_no_answer_together_are_impossible() -> None:
    scene = ten()
    before, found = weigh(scene, quick=True), weigh(scene, stages=[bench(np.nan)], quick=True)
    best = sorted(before.pairs, key=lambda name: before.pairs[name].log_evidence, reverse=True)[:4]
    assert {name for name, pair in found.pairs.items() if pair.log_evidence == -np.inf} == set(best)
    assert sum(found.probability[name] for name in best) == 0.0


def again(scene: Scene, pair: OnPair, directions: np.ndarray) -> OnPair:
    """A pair with more in every background."""
    opened = scene.opened((pair.first, pair.second), directions) if directions.shape[1] else scene
    whitened = [white.white(scene.cells.z) for white in opened.before]
    one = {i: of_surface(opened, i, whitened) for i in (pair.first, pair.second)}
    return of_pair(opened, start_pair(opened, pair.first, pair.second, one, whitened), whitened)


def test_forms_of_pairs_may_err_as_those_of_single_effects() -> None:
    """As likely as not."""
    scene = ten()
    modes = form_modes(scene)
    found = weigh(scene)
    changed = 0
    for pair in found.pairs.values():
        once = again(scene, pair, np.zeros((len(scene.cells.z), 0)))
        places = [(scene.surfaces[i], u) for i, u in zip((pair.first, pair.second), once.u, strict=True)]
        both = [again(scene, pair, each).log_evidence for each in left_open(scene, places, modes, errors=True)]
        assert len(both) == 2
        mean = np.logaddexp(*both) - np.log(2)
        assert pair.log_evidence == pytest.approx(mean) or pair.log_evidence == pytest.approx(once.log_evidence)
        changed += pair.log_evidence == pytest.approx(mean)
    assert changed == 4


@cache
def both_open() -> Scene:
    """A gap of two laws that each leave one observable open, which they do not meet."""
    rng = np.random.default_rng(6)
    first, second = 8.0 * GAP.tolerance * rng.standard_normal((2, 1, *SHAPE))
    change = 0.6 * first[0] + 0.4 * second[0]
    change[:, 2] *= 0.5  # which is what they leave open
    rough = 0.4 * GAP.tolerance * rng.standard_normal(SHAPE)
    laws_of_both = [law(KINDS[0], first), law(KINDS[1], second)]
    return loosened(Scene.of(with_gap(GAP, change + rough), laws_of_both), [0, 1])


def test_all_laws_may_leave_something_open() -> None:
    scene = both_open()
    plain, whitened = alone(scene)
    found = weigh(scene, quick=True)
    for i, name in enumerate(scene.ids):
        expected = with_form_error(scene, i, plain[i], whitened, form_modes(scene))
        assert found.log_evidence[name] == pytest.approx(expected.log_evidence)
        assert found.log_evidence[name] != pytest.approx(plain[i].log_evidence, abs=0.01)


def test_what_the_laws_of_a_pair_leave_open_is_looked_for_twice() -> None:
    """Again from where it is likeliest with that open."""
    scene = both_open()
    modes = form_modes(scene)
    found = weigh(scene, quick=True)
    name = "+".join(scene.ids)
    pair = again(scene, found.pairs[name], np.zeros((len(scene.cells.z), 0)))
    logs = []
    for _ in range(2):
        places = [(scene.surfaces[i], u) for i, u in zip((pair.first, pair.second), pair.u, strict=True)]
        (directions,) = left_open(scene, places, modes, errors=False)
        assert directions.shape[1] == 2
        pair = again(scene, pair, directions)
        logs.append(pair.log_evidence)
    assert found.pairs[name].log_evidence == pytest.approx(logs[1], rel=1e-12)
    assert logs[0] != pytest.approx(logs[1], rel=1e-6)


def test_effects_of_a_hypothesis_are_those_of_its_likeliest_place() -> None:
    scene = small_scene(ToyLoss(0.08), ToyMass(1.3))
    found = weigh(scene, quick=True)
    assert found.effects("none") == found.effects("unknown") == ()
    for name in scene.ids:
        (effect,) = found.effects(name)
        sheet = max(found.singles[name], key=lambda one: one.log_evidence)
        joint = sheet.log_likelihood.max(axis=1) + sheet.log_prior
        point = sheet.surface.points[int(np.argmax(joint))]
        assert effect == sheet.surface.effect(point)
        assert found.best_sheet(name) is sheet
        assert found.best_point(name) == pytest.approx(point)
    both = found.effects("gun.toy_loss+contact.toy_mass")
    assert [type(each) for each in both] == [ToyLoss, ToyMass]
    assert next(iter(found.probability)) == "gun.toy_loss+contact.toy_mass"
    assert getattr(both[0], "loss") == pytest.approx(0.08, abs=0.01)  # noqa: B009 - of one kind
    assert getattr(both[1], "factor") == pytest.approx(1.3, abs=0.05)  # noqa: B009


def test_alike_hypotheses_keep_their_order() -> None:
    logs = dict.fromkeys("abcdefghijklmnopqrstuvwxyz", -2000.0)  # each far below what numbers hold
    found = Weighed(small_scene(), logs, logs, {})
    assert list(found.probability) == list(logs)
    assert found.probability["z"] == pytest.approx(1 / 26)
    assert found.pairs == {}
