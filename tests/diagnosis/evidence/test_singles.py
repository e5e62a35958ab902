"""Evidence of none, of every effect alone and of the unknown, against densities summed one by one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.diagnosis.evidence.singles import likelihood, of_none, of_strays, of_surface, summed
from pyroshock.twin.effects import Effect
from scipy.stats import multivariate_normal
from support.records.small_scenes import dense, small_scene
from support.records.toy_bench import ToyLoss, ToyMass

RNG = np.random.default_rng(5)
LOGS = RNG.normal(-1200.0, 3.0, (6, 4))  # of points before backgrounds: far too small to be anything but logarithms
PRIOR = np.log(np.array([0.0, 0.1, 0.2, 0.3, 0.15, 0.25]) + 1e-300)


def test_evidence_is_the_mean_by_the_prior_over_backgrounds() -> None:
    found = summed(small_scene().surfaces[0], PRIOR, LOGS)
    expected = sum(np.exp(PRIOR[m] + LOGS[m, b] + 1200) for m in range(6) for b in range(4)) / 4
    assert found.log_evidence == pytest.approx(np.log(expected) - 1200)


def test_posterior_of_points_is_summed_over_backgrounds() -> None:
    found = summed(small_scene().surfaces[0], PRIOR, LOGS)
    weights = np.array([sum(np.exp(PRIOR[m] + LOGS[m, b] + 1200) for b in range(4)) for m in range(6)])
    np.testing.assert_allclose(np.exp(found.log_posterior), weights / weights.sum(), rtol=1e-9)


def test_best_is_the_likeliest_point_and_background_with_the_prior() -> None:
    logs = np.zeros((6, 4))
    logs[4, 2], logs[3, 1] = 1.0, 0.5  # the second is likelier by a prior of twice the first's
    prior = np.log(np.array([0.1, 0.1, 0.1, 0.4, 0.2, 0.1]))
    assert summed(small_scene().surfaces[0], prior, logs).best == (3, 1)
    logs[4, 2] = 1.5
    assert summed(small_scene().surfaces[0], prior, logs).best == (4, 2)


@pytest.mark.parametrize("effects", [(), (ToyLoss(0.08),), (ToyMass(1.3),)], ids=len)
def test_densities_are_normal_ones(effects: tuple[Effect, ...]) -> None:
    scene = small_scene(*effects)
    z = scene.cells.z
    covariances = [dense(scene, b) for b in range(len(scene.before))]
    np.testing.assert_allclose(
        of_none(scene, z), [multivariate_normal(cov=one).logpdf(z) for one in covariances], rtol=1e-9
    )
    whitened = [white.white(z) for white in scene.before]
    for index in (0, 4):
        surface = scene.surfaces[index]
        found = of_surface(scene, index, whitened)
        changes = surface.basis @ scene.cells.take(surface.nodes)
        for b, covariance in enumerate(covariances):
            expected = multivariate_normal(cov=covariance).logpdf(z - changes)
            np.testing.assert_allclose(found.log_likelihood[:, b], expected, rtol=1e-7)
            one = likelihood(surface, scene.seen[index][b], whitened[b], scene.before[b])
            np.testing.assert_allclose(one, expected, rtol=1e-7)
        weights = np.exp(scene.log_prior[index][:, None] + found.log_likelihood)
        assert np.exp(found.log_evidence) == pytest.approx(weights.sum() / len(covariances), rel=1e-6)


@pytest.mark.parametrize("loss", [0.05, 0.12])
def test_evidence_is_the_integral_over_sizes(loss: float) -> None:
    """Of a law that is linear, with a prior that is even over the logarithm of size from 1 to 40 tolerances."""
    scene = small_scene(ToyLoss(loss), seed=3)
    index = scene.sheets("gun.toy_loss")[0]
    surface, z = scene.surfaces[index], scene.cells.z
    largest = scene.cells.take(surface.nodes[-1])
    end = np.abs(largest[scene.kernels.stage == "gun"]).mean()
    assert end == pytest.approx(40.0)
    sizes = np.exp(np.linspace(0, np.log(end), 20_001))
    total = 0.0
    for b in range(len(scene.before)):
        inverse, log_det = np.linalg.inv(dense(scene, b)), np.linalg.slogdet(dense(scene, b))[1]
        direction = largest / end
        square = z @ inverse @ z - 2 * sizes * (direction @ inverse @ z) + sizes**2 * (direction @ inverse @ direction)
        density = np.exp(-0.5 * (square + log_det + len(z) * np.log(2 * np.pi)))
        total += float(np.trapezoid(density / sizes, sizes)) / np.log(end) / len(scene.before)
    found = of_surface(scene, index, [white.white(z) for white in scene.before])
    assert found.log_evidence == pytest.approx(np.log(total), abs=0.15)


def test_unknown_is_the_mean_over_its_sizes_ways_and_backgrounds() -> None:
    """What backgrounds that are not asked would add counts as nothing."""
    scene = small_scene(ToyLoss(0.1))
    z, under = scene.cells.z, [0, 3, 5]
    found = of_strays(scene, z, under)
    assert list(found) == ["gun", "contact"]
    for stage, log in found.items():
        total = 0.0
        for b in under:
            strays = scene.strays(b)
            densities = np.exp(strays.log_densities(scene.before[b].white(z), scene.cells.creep.whitened))
            names = list(dict.fromkeys((course, manner) for where, course, manner in strays.names if where == stage))
            courses = list(dict.fromkeys(course for course, _ in names))
            for course in courses:
                manners = [manner for one, manner in names if one == course]
                for manner in manners:
                    own = [densities[i] for i, name in enumerate(strays.names) if name == (stage, course, manner)]
                    total += float(np.mean(own)) / len(manners) / len(courses) / len(scene.before)
        assert np.exp(log) == pytest.approx(total)


def test_stage_without_a_cell_is_not_unknown() -> None:
    scene = small_scene()
    named = replace(scene.gap.observables[0], stage="plate")
    more = replace(scene, gap=replace(scene.gap, observables=(*scene.gap.observables, named)))
    assert of_strays(more, scene.cells.z, [0])["plate"] == -np.inf


def test_a_gap_whitened_before_some_backgrounds_alone_is_refused() -> None:
    scene = small_scene()
    with pytest.raises(ValueError, match="shorter"):
        of_surface(scene, 0, [white.white(scene.cells.z) for white in scene.before[:-1]])
