"""Two effects at once, against bounded least squares, densities summed one by one and closed forms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.diagnosis.evidence.pairs import (
    _POINTS,
    OnPair,
    Started,
    _around,
    _Best,
    _beyond_tolerance,
    _model,
    _Points,
    _refined,
    _shortened,
    _spacing,
    _thinned,
    interaction,
    of_pair,
    start_pair,
)
from pyroshock.diagnosis.evidence.scene import Scene
from pyroshock.diagnosis.evidence.singles import of_surface
from pyroshock.diagnosis.evidence.surface import Surface
from pyroshock.diagnosis.gap import GapTable
from pyroshock.twin.effects import Effect
from scipy.optimize import lsq_linear
from scipy.stats import multivariate_normal
from support.records.small_scenes import dense, law, small, small_scene, with_gap
from support.records.toy_bench import ToyGun, ToyLeak, ToyLoss, ToyMass

GAP = small()[0]
SHAPE = GAP.mean.shape


def ends(seed: int, count: int, alike: float = 0.0, size: float = 6.0) -> np.ndarray:
    """(count, C, D) random directions, `alike` in part, of so many tolerances."""
    rng = np.random.default_rng(seed)
    shared = rng.standard_normal(SHAPE)
    return size * GAP.tolerance * (alike * shared + (1 - alike) * rng.standard_normal((count, *SHAPE)))


def scene_of(surfaces: Sequence[Surface], change: np.ndarray) -> Scene:
    return Scene.of(with_gap(GAP, change), surfaces)


def started(scene: Scene, pair: tuple[int, int] = (0, 1)) -> tuple[Started, list[np.ndarray]]:
    whitened = [white.white(scene.cells.z) for white in scene.before]
    singles = {i: of_surface(scene, i, whitened) for i in pair}
    return start_pair(scene, *pair, singles, whitened), whitened


def exactly(scene: Scene, more: np.ndarray | None = None) -> float:
    """Evidence of the first two surfaces, all their points by all backgrounds; `more` (N, q) opens these."""
    one, two = (surface.basis @ scene.cells.take(surface.nodes) for surface in scene.surfaces[:2])
    both = (one[:, None] + two[None]).reshape(-1, len(scene.cells.z))
    stages = [scene.kernels.stage == name for name in scene.gap.stages]
    size = np.max([(both[:, own] ** 2).mean(axis=1) for own in stages], axis=0)
    mass = np.where(size > 1, (scene.log_prior[0][:, None] + scene.log_prior[1][None]).ravel(), -np.inf)
    z, logs = scene.cells.z, []
    for b in range(len(scene.before)):
        covariance = dense(scene, b) + (0.0 if more is None else more @ more.T)
        inverse, constant = np.linalg.inv(covariance), np.linalg.slogdet(2 * np.pi * covariance)[1]
        alone = [((each @ inverse) * (each - 2 * z)).sum(axis=1) for each in (one, two)]
        squares = z @ inverse @ z + alone[0][:, None] + alone[1][None] + 2 * one @ inverse @ two.T
        logs.append(np.logaddexp.reduce(mass - 0.5 * (constant + squares.ravel())))
    return float(np.logaddexp.reduce(logs) - np.log(len(logs)))


@pytest.mark.parametrize("truth", [(0.3, 0.6), (0.5, 1.3), (1.4, 0.2), (-0.2, 0.5), (0.6, -0.3), (1.2, -0.2)])
def test_place_is_that_of_bounded_least_squares(truth: tuple[float, float]) -> None:
    """Two laws that are much alike, so that what lies at a bound moves the other."""
    first, second = ends(3, 2, alike=0.6)
    scene = scene_of([law(ToyLoss, first[None]), law(ToyMass, second[None])], truth[0] * first + truth[1] * second)
    found, whitened = started(scene)
    b = found.best.background
    slopes = scene.before[b].white(scene.cells.take(np.stack([first, second])).T)
    best = lsq_linear(slopes, whitened[b], bounds=(0, 1), tol=1e-12)
    np.testing.assert_allclose(found.u, best.x, atol=5e-3)
    np.testing.assert_allclose(found.width, np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes + np.eye(2)))), rtol=1e-6)
    left = scene.cells.z - scene.cells.take(np.tensordot(found.u, np.stack([first, second]), axes=1))
    assert found.log_likelihood == pytest.approx(multivariate_normal(cov=dense(scene, b)).logpdf(left), rel=1e-6)
    assert found.log_likelihood == pytest.approx(scene.before[b].log_norm - best.cost, abs=0.05)


@pytest.mark.parametrize("seed", range(3, 23))
def test_least_squares_within_bounds_from_anywhere(seed: int) -> None:
    """Two laws of two parameters each, from a corner to what may lie outside."""
    rng = np.random.default_rng(seed)
    four = ends(seed, 4, alike=0.5)
    truth = rng.uniform(-0.5, 1.5, 4)
    scene = scene_of([law(ToyLoss, four[:2], 9), law(ToyMass, four[2:], 9)], np.tensordot(truth, four, axes=1))
    b = int(rng.integers(len(scene.before)))
    zw = scene.before[b].white(scene.cells.z)
    slopes = scene.before[b].white(scene.cells.take(four).T)
    start = rng.integers(0, 2, 4).astype(float)
    u, width, likelihood = _refined(scene, (0, 1), _Best((start[:2], start[2:]), b), zw)
    best = lsq_linear(slopes, zw, bounds=(0, 1), tol=1e-12)
    assert u.min() >= 0
    assert u.max() <= 1
    assert likelihood == pytest.approx(scene.before[b].log_norm - best.cost, abs=0.05)
    np.testing.assert_allclose(width, np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes + np.eye(4)))), rtol=1e-6)


@pytest.mark.parametrize("longer", [1.0, 1 / 0.3, 10.0])
def test_a_step_that_is_too_long_is_shortened(longer: float) -> None:
    """To a third or a tenth of it, whichever leaves least; within the sheet."""
    first, second = ends(3, 2, alike=0.6)
    scene = scene_of([law(ToyLoss, first[None]), law(ToyMass, second[None])], 0.25 * first + 0.75 * second)
    begin, best = np.array([0.45, 0.6]), np.array([0.25, 0.75])
    zw = scene.before[3].white(scene.cells.z)
    u, left, slopes = _shortened(scene, (0, 1), begin, longer * (best - begin), 3, zw)
    np.testing.assert_allclose(u, best)
    np.testing.assert_allclose(left, 0.0, atol=1e-9)
    np.testing.assert_allclose(slopes, scene.before[3].white(scene.cells.take(np.stack([first, second])).T), atol=1e-7)
    outside = _shortened(scene, (0, 1), best, np.array([50.0, -50.0]), 3, zw)[0]
    assert outside.tolist() == [1.0, 0.0]


@pytest.mark.parametrize("u", [(0.3, 0.7, 0.5), (0.0, 1.0, 0.2), (1.0, 0.0, 0.0)])
def test_slopes_are_those_of_the_laws(u: tuple[float, float, float]) -> None:
    """At the bounds those a thousandth inside."""
    three = ends(4, 3)
    first, second = law(ToyLoss, three[:2], 9, bend=0.5), law(ToyMass, three[2:], bend=0.5)
    scene = scene_of([first, second], three[0])
    place = np.array(u)
    left, slopes = _model(scene, (0, 1), place, 2, scene.before[2].white(scene.cells.z))
    change = np.tensordot(place * (1 + 0.5 * place), three, axes=1)
    np.testing.assert_allclose(left, scene.before[2].white(scene.cells.z - scene.cells.take(change)), atol=1e-9)
    inside = 1 + np.clip(place, 0.001, 0.999)
    np.testing.assert_allclose(slopes, scene.before[2].white(scene.cells.take(three).T) * inside, atol=1e-7)


def test_evidence_of_few_points_is_their_sum() -> None:
    """By both priors over all backgrounds; together they must exceed the tolerance, too."""
    first = ends(6, 1, size=2.0)
    second = -0.8 * first + ends(7, 1, size=0.4)  # they cancel one another in part
    surfaces = [law(ToyLoss, first, 40), law(ToyMass, second, 30)]
    scene = scene_of(surfaces, 0.3 * first[0])
    found, whitened = started(scene)
    assert found.evidence == pytest.approx(exactly(scene), abs=1e-6)
    pair = of_pair(scene, found, whitened)
    assert pair.log_evidence == found.evidence  # the posterior is wide
    assert pair.background == found.best.background
    assert np.concatenate(pair.u) == pytest.approx(np.concatenate(found.best.u))
    assert (pair.first, pair.second) == (0, 1)


def test_start_is_the_likeliest_pair_of_points() -> None:
    first, second = ends(6, 2, size=4.0)
    scene = scene_of([law(ToyLoss, first[None], 12), law(ToyMass, second[None], 15)], 0.5 * first + 0.3 * second)
    found, _ = started(scene)
    one, two = (surface.basis @ scene.cells.take(surface.nodes) for surface in scene.surfaces)
    best = (-np.inf, (0, 0, 0))
    for b in range(len(scene.before)):
        normal = multivariate_normal(cov=dense(scene, b))
        for i in range(12):
            for j in range(15):
                log = scene.log_prior[0][i] + scene.log_prior[1][j] + normal.logpdf(scene.cells.z - one[i] - two[j])
                best = max(best, (float(log), (b, i, j)))
    b, i, j = best[1]
    assert found.best.background == b
    assert found.best.u[0] == pytest.approx(scene.surfaces[0].points[i])
    assert found.best.u[1] == pytest.approx(scene.surfaces[1].points[j])


@pytest.mark.parametrize("effects", [(ToyLoss(0.08), ToyMass(1.3)), (ToyLoss(0.02), ToyMass(1.1))], ids=["far", "near"])
def test_evidence_of_a_narrow_posterior_is_the_sum_over_all_points(effects: tuple[ToyLoss, ToyMass]) -> None:
    """Which the coarse grid misses."""
    scene = small_scene(*effects)
    pair = scene.sheets("gun.toy_loss")[0], scene.sheets("contact.toy_mass")[0]
    found, whitened = started(scene, pair)
    two = replace(
        scene,
        surfaces=tuple(scene.surfaces[i] for i in pair),
        log_prior=tuple(scene.log_prior[i] for i in pair),
    )
    fine = of_pair(scene, found, whitened)
    assert fine.log_evidence == pytest.approx(exactly(two), abs=0.05)
    assert abs(found.evidence - fine.log_evidence) > 0.08
    loss, mass = fine.effects(scene)
    assert isinstance(loss, ToyLoss)
    assert isinstance(mass, ToyMass)
    assert loss.loss == pytest.approx(effects[0].loss, abs=0.01)
    assert mass.factor == pytest.approx(effects[1].factor, abs=0.05)
    np.testing.assert_allclose(np.concatenate(fine.u), found.u, atol=float(found.width.max()))
    np.testing.assert_allclose(np.concatenate(fine.width), found.width)


@pytest.mark.parametrize("sizes", [(30.0, 3.0), (3.0, 30.0)])
def test_one_of_two_may_be_known_far_better(sizes: tuple[float, float]) -> None:
    first, second = ends(5, 1, size=sizes[0]), ends(8, 1, size=sizes[1])
    rough = 0.6 * GAP.tolerance * np.random.default_rng(2).standard_normal(SHAPE)
    scene = scene_of([law(ToyLoss, first), law(ToyMass, second)], 0.7 * first[0] + 0.6 * second[0] + rough)
    found, whitened = started(scene)
    assert found.width.max() > 8 * found.width.min()
    assert of_pair(scene, found, whitened).log_evidence == pytest.approx(exactly(scene), abs=0.05)


def test_laws_that_are_nearly_one_are_told_apart_as_far_as_they_can_be() -> None:
    """Half a nat along what sets them apart is gone for all the same."""
    first, other = ends(3, 2)
    white = small_scene().before[3]
    apart = white.white(small_scene().cells.take(other))
    second = first + 0.7 / np.linalg.norm(apart) * other
    scene = scene_of([law(ToyLoss, first[None]), law(ToyMass, second[None])], 1.6 * first - 0.6 * second)
    zw = scene.before[3].white(scene.cells.z)
    slopes = scene.before[3].white(scene.cells.take(np.stack([first, second])).T)
    best = lsq_linear(slopes, zw, bounds=(0, 1), tol=1e-12)
    start = _Best((np.array([0.5]), np.array([0.5])), 3)
    _, _, likelihood = _refined(scene, (0, 1), start, zw)
    assert likelihood == pytest.approx(scene.before[3].log_norm - best.cost, abs=0.01)
    left = zw - slopes @ np.array([0.5, 0.5])
    assert likelihood > scene.before[3].log_norm - 0.5 * left @ left + 0.05


def test_what_is_best_already_stays() -> None:
    first, second = ends(3, 2, alike=0.6)
    scene = scene_of([law(ToyLoss, first[None]), law(ToyMass, second[None])], 0.25 * first + 0.75 * second)
    start = _Best((np.array([0.25]), np.array([0.75])), 3)
    u, _, likelihood = _refined(scene, (0, 1), start, scene.before[3].white(scene.cells.z))
    assert u.tolist() == [0.25, 0.75]
    assert likelihood == pytest.approx(scene.before[3].log_norm)


def test_evidence_in_three_parameters_is_that_of_laplace() -> None:
    """Prior's density where the likelihood is largest, times the integral of a normal density."""
    three = ends(9, 3, size=6.0)
    truth = np.array([0.4, 0.6, 0.5])
    rough = 0.6 * GAP.tolerance * np.random.default_rng(2).standard_normal(SHAPE)
    scene = scene_of([law(ToyLoss, three[:2], 49), law(ToyMass, three[2:])], np.tensordot(truth, three, axes=1) + rough)
    found, whitened = started(scene)
    total = []
    for b, zw in enumerate(whitened):
        slopes = scene.before[b].white(scene.cells.take(three).T)
        u = np.linalg.lstsq(slopes, zw, rcond=None)[0]
        nearest = ((scene.surfaces[0].points - u[:2]) ** 2).sum(axis=1).argmin()
        prior = scene.log_prior[0][nearest] + np.log(len(scene.log_prior[0]))
        prior += scene.log_prior[1][round(384 * u[2])] + np.log(385)
        left = zw - slopes @ u
        half = 0.5 * np.linalg.slogdet(slopes.T @ slopes)[1] - 1.5 * np.log(2 * np.pi)
        total.append(prior + scene.before[b].log_norm - 0.5 * left @ left - half)
    expected = np.logaddexp.reduce(total) - np.log(len(total))
    assert of_pair(scene, found, whitened).log_evidence == pytest.approx(expected, abs=0.1)


def test_posterior_is_wide_where_no_width_is_below_the_spacing_of_the_coarse_grid() -> None:
    three = ends(6, 3, size=4.0)
    scene = scene_of([law(ToyLoss, three[:2], 20), law(ToyMass, three[2:])], 0.5 * three[0] + 0.3 * three[2])
    found, whitened = started(scene)
    spacing = np.array([_POINTS**-0.5, _POINTS**-0.5, 1 / _POINTS])
    assert _spacing(scene, (0, 1)) == pytest.approx(spacing)
    assert of_pair(scene, replace(found, width=1.01 * spacing), whitened).log_evidence == found.evidence
    for axis in range(3):
        narrow = spacing * np.where(np.arange(3) == axis, 0.99, 5.0)
        assert of_pair(scene, replace(found, width=narrow), whitened).log_evidence != found.evidence


def test_where_the_fine_grid_is_impossible_the_coarse_one_counts() -> None:
    """Where one of them alone is within tolerance, and where they cancel one another."""
    first = ends(6, 1, size=4.0)
    scene = scene_of([law(ToyLoss, first), law(ToyMass, -first)], 0.5 * first[0])
    found, whitened = started(scene)
    for u in ([0.001, 0.5], [0.5, 0.001], [0.5, 0.5]):
        lost = replace(found, u=np.array(u), width=np.full(2, 1e-5))
        assert of_pair(scene, lost, whitened).log_evidence == found.evidence
        assert of_pair(scene, lost, whitened).background == found.best.background
    edge = replace(found, u=np.array([0.001, 0.9]), width=np.array([1e-5, 0.5]))  # one impossible, the other not
    assert of_pair(scene, edge, whitened).background == found.best.background
    kept = replace(found, u=np.array([0.9, 0.3]), width=np.full(2, 1e-5))
    assert of_pair(scene, kept, whitened).log_evidence < found.evidence


def test_coarse_grid_spreads_over_what_is_possible_and_holds_the_best_alone() -> None:
    scene = small_scene(ToyLoss(0.08))
    index = scene.sheets("gun.toy_loss")[0]
    whitened = [white.white(scene.cells.z) for white in scene.before]
    single = of_surface(scene, index, whitened)
    points = _thinned(scene, index, single)
    surface, allowed = scene.surfaces[index], np.isfinite(scene.log_prior[index])
    assert _POINTS <= len(points.u) <= _POINTS + 1
    possible = surface.points[allowed, 0]
    assert points.u[0, 0] == possible.min()
    assert points.u[-1, 0] == possible.max()
    assert np.diff(points.u[:, 0]).max() < 1.5 * np.ptp(possible) / (_POINTS - 1)
    assert surface.points[single.best[0], 0] in points.u[:, 0]
    assert np.exp(points.log_mass).sum() == pytest.approx(1.0)
    place = np.searchsorted(surface.points[:, 0], points.u[:, 0])
    np.testing.assert_allclose(
        points.log_mass - scene.log_prior[index][place],
        np.ptp([0, points.log_mass[0] - scene.log_prior[index][place[0]]]),
    )
    np.testing.assert_allclose(points.change, points.basis @ scene.cells.take(surface.nodes))


@pytest.mark.parametrize(("u", "low", "high"), [(0.5, 0.3, 0.7), (0.1, 0.0, 0.3), (0.95, 0.75, 1.0)])
def test_fine_grid_has_the_mass_of_its_box(u: float, low: float, high: float) -> None:
    """Four standard deviations each way, within the sheet; of an even prior the share of the sheet."""
    two = ends(6, 3, size=4.0)
    scene = scene_of([law(ToyLoss, two[:2], 20), law(ToyMass, two[2:])], two[0])
    even = tuple(np.full(len(each), -np.log(len(each))) for each in scene.log_prior)
    scene = replace(scene, log_prior=even)
    one = _around(scene, 1, np.array([u]), np.array([0.05]))
    np.testing.assert_allclose(one.u[:, 0], low + (high - low) * (np.arange(21) + 0.5) / 21)
    assert np.exp(one.log_mass).sum() == pytest.approx(high - low)
    both = _around(scene, 0, np.array([u, 0.5]), np.array([0.05, 0.1]))
    assert np.exp(both.log_mass).sum() == pytest.approx((high - low) * 0.8)
    assert both.u.shape == (81, 2)
    np.testing.assert_allclose(both.u.mean(axis=0), [(low + high) / 2, 0.5])
    np.testing.assert_allclose(both.change, scene.cells.take(np.tensordot(both.u, two[:2], axes=1)), atol=1e-9)


def test_fine_grid_of_three_parameters_has_the_mass_of_its_box() -> None:
    four = ends(6, 4, size=4.0)
    scene = scene_of([law(ToyLoss, four[:3], 7), law(ToyMass, four[3:])], four[0])
    even = tuple(np.full(len(each), -np.log(len(each))) for each in scene.log_prior)
    found = _around(replace(scene, log_prior=even), 0, np.array([0.5, 0.4, 0.9]), np.array([0.1, 0.05, 0.1]))
    assert found.u.shape == (125, 3)
    assert np.exp(found.log_mass).sum() == pytest.approx(0.8 * 0.4 * 0.5)
    np.testing.assert_allclose(found.u.mean(axis=0), [0.5, 0.4, 0.75])


def test_fine_grid_has_the_density_of_the_nearest_point() -> None:
    """All of a prior where it is possible at all."""
    first = ends(6, 1, size=30.0)
    scene = scene_of([law(ToyLoss, first, 20), law(ToyMass, first)], first[0])
    points = _around(scene, 0, np.array([0.5]), np.array([1.0]))
    for u, mass in zip(points.u[:, 0], points.log_mass, strict=True):
        assert mass == pytest.approx(scene.log_prior[0][round(19 * u)] + np.log(20 / 21))


def test_together_they_are_as_large_as_where_they_are_largest() -> None:
    """A stage without a cell says nothing; of exactly the tolerance is within it."""
    scene = small_scene()
    n = len(scene.cells.z)
    here = [scene.kernels.stage == name for name in ("gun", "contact")]
    rows = np.array([1.0 * here[0], 0.5 * here[1], 1.0 * here[1], 0.8 * here[0] + 0.8 * here[1]])

    def points(change: np.ndarray) -> _Points:
        return _Points(np.zeros((len(change), 1)), np.zeros((len(change), 2)), change, np.zeros(len(change)))

    found = _beyond_tolerance(scene, (points(rows), points(np.array([*-rows[:1], *0.5 * rows[1:3], np.zeros(n)]))))
    assert found.tolist() == [
        [False, False, False, False],
        [False, False, False, False],
        [False, True, True, False],
        [False, True, True, False],
    ]
    named = replace(scene.gap.observables[0], stage="plate")
    more = replace(scene, gap=replace(scene.gap, observables=(*scene.gap.observables, named)))
    assert not _beyond_tolerance(more, (points(rows), points(-rows)))[0, 0]


def test_together_they_are_as_large_as_their_sum() -> None:
    """Root of the mean square in the stage where that is largest, also of a gun alone."""
    rng = np.random.default_rng(3)
    record = GAP.record
    alone = GapTable.of(record, [ToyGun(record)])
    for scene in (small_scene(), Scene.of(alone, ())):
        first, second = (rng.uniform(0.2, 1.4, (30, 1)) * rng.standard_normal((30, len(scene.cells.z))) for _ in "ab")
        points = [_Points(np.zeros((30, 1)), np.zeros((30, 2)), change, np.zeros(30)) for change in (first, second)]
        found = _beyond_tolerance(scene, (points[0], points[1]))
        for i, j in np.ndindex(30, 30):
            both = first[i] + second[j]
            sizes = [np.sqrt(np.mean(both[scene.kernels.stage == name] ** 2)) for name in scene.gap.stages]
            assert found[i, j] == (max(sizes) > 1)
        assert 50 < found.sum() < 850


class Squared(ToyGun):
    """Moves by the square of all losses together, in every configuration by its number; has no answer beyond a half."""

    def changes(self, sets: Sequence[Sequence[Effect]]) -> np.ndarray:
        sizes = [sum(getattr(each, "loss", 0.0) + getattr(each, "share", 0.0) for each in one) for one in sets]
        each = np.array([size**2 if size < 0.5 else np.nan for size in sizes])
        return np.asarray(each[:, None, None] * np.arange(1.0, 9.0)[:, None])


def test_interaction_is_what_two_do_beyond_the_sum_of_each() -> None:
    """(a + b)^2 - a^2 - b^2, in the cells of the configurations that are looked at."""
    gap, shown, stages = small()
    rows = np.array([1, 2, 6])
    scene = Scene.of(gap.only(rows), [surface.only(rows) for surface in shown])
    first, second = scene.sheets("gun.toy_loss")[0], scene.sheets("gun.toy_leak")[0]
    bench = [Squared(gap.record), stages[1]]
    pair = OnPair(first, second, (np.array([0.5]), np.array([0.5])), (np.zeros(1), np.zeros(1)), 0, 0.0)
    a, b = 0.5 * 0.4, 0.5**2 * 0.5
    losses = pair.effects(scene)
    assert [type(each) for each in losses] == [ToyLoss, ToyLeak]
    assert getattr(losses[0], "loss") == pytest.approx(a)  # noqa: B009 - of either kind
    assert getattr(losses[1], "share") == pytest.approx(b)  # noqa: B009
    expected = np.where(scene.cells.observable == 0, 2 * a * b * (1 + rows[scene.cells.configuration]) / 0.01, 0.0)
    np.testing.assert_allclose(interaction(scene, pair, bench), expected, atol=1e-9)
    far = replace(pair, u=(np.array([0.8]), np.array([0.9])))
    gun = scene.cells.observable == 0
    found = interaction(scene, far, bench)
    assert np.isnan(found[gun]).all()
    assert np.isfinite(found[~gun]).all()
