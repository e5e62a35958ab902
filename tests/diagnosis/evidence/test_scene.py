"""What hangs on the campaign's design alone: which effects and backgrounds there are, whitened, and priors of sizes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.diagnosis.evidence.background import BANK, PLATE_BANK
from pyroshock.diagnosis.evidence.scene import Scene
from pyroshock.diagnosis.gap import GapTable
from support.records.small_scenes import dense, given, of_size, small, small_scene
from support.records.toy_bench import ToyGun, ToyPlate


def test_before_are_the_noise_and_one_background_each() -> None:
    scene = small_scene()
    assert len(scene.before) == len(scene.backgrounds) > 2
    for b, white in enumerate(scene.before):
        np.testing.assert_allclose(white.lower @ white.lower.T, dense(scene, b), rtol=1e-9, atol=1e-12)


def test_backgrounds_that_differ_in_details_alone_stand_once() -> None:
    """Unless there are details."""
    gap, shown, _ = small()
    plain = [{"gun": one, "contact": one} for one in BANK if one.detail == 1]
    assert list(small_scene().backgrounds) == plain
    last = replace(gap.observables[-1], detail=True)
    detailed = replace(gap, observables=(*gap.observables[:-1], last))
    assert list(Scene.of(detailed, shown[:1]).backgrounds) == [{"gun": one, "contact": one} for one in BANK]


def test_of_a_plate_without_details_those_without_are_left() -> None:
    record = small()[0].record
    gap = GapTable.of(record, [ToyPlate(record)])
    assert list(Scene.of(gap, ()).backgrounds) == [{"plate": one} for one in PLATE_BANK if one.detail == 1]


def test_each_surface_is_whitened_before_each_background() -> None:
    scene = small_scene()
    assert len(scene.seen) == len(scene.surfaces) > 5
    for surface, seen in zip(scene.surfaces, scene.seen, strict=True):
        nodes = scene.cells.take(surface.nodes)
        assert len(seen) == len(scene.before)
        for b, one in enumerate(seen):
            inverse = np.linalg.inv(dense(scene, b))
            np.testing.assert_allclose(one.nodes, scene.before[b].white(nodes.T), atol=1e-9)
            np.testing.assert_allclose(one.gram, nodes @ inverse @ nodes.T, rtol=1e-6, atol=1e-6)
            changes = surface.basis @ nodes
            np.testing.assert_allclose(one.square, ((changes @ inverse) * changes).sum(axis=1), rtol=1e-6, atol=1e-6)


def test_scene_without_an_effect_is_one() -> None:
    scene = Scene.of(small()[0], ())
    assert scene.surfaces == scene.seen == scene.log_prior == scene.ids == ()


def test_effects_that_never_exceed_a_tolerance_are_none() -> None:
    """One tolerance is within tolerance; and without an answer anywhere there is no effect."""
    gap = small()[0]
    exactly, above = of_size(gap, np.array([0.3, 1.0])), of_size(gap, np.array([1.0, 1.001]))
    nowhere = given(gap, above.nodes, [False, False])
    scene = Scene.of(gap, [exactly, nowhere, above])
    assert scene.surfaces == (above,)
    assert scene.log_prior[0].tolist() == [-np.inf, 0.0]


def test_size_is_that_of_the_stage_where_an_effect_is_largest() -> None:
    """Root of the mean square over its cells: a stage in which nothing moves takes nothing from it."""
    gap = small()[0]
    gun, contact = of_size(gap, np.array([0.9, 1.1])), of_size(gap, np.array([0.9, 1.1]), "contact")
    scene = Scene.of(gap, [gun, contact, given(gap, 0.95 * gun.nodes + contact.nodes)])
    assert len(scene.surfaces) == 3
    for prior in scene.log_prior:
        assert prior.tolist() == [-np.inf, 0.0]
    half = gun.nodes.copy()
    half[:, ::2] *= 1.4  # mean square: (1 + 1.96) / 2
    assert Scene.of(gap, [given(gap, half / 1.2166)]).log_prior[0].tolist() == [-np.inf, 0.0]
    assert Scene.of(gap, [given(gap, half / 1.35)]).surfaces == ()


def test_a_gun_alone_has_sizes_of_its_own() -> None:
    record = small()[0].record
    gap = GapTable.of(record, [ToyGun(record)])
    scene = Scene.of(gap, [of_size(gap, np.array([0.9, 1.1, 3.0]))])
    np.testing.assert_allclose(np.exp(scene.log_prior[0]), [0.0, 0.5, 0.5])


@pytest.mark.parametrize(("points", "classes"), [(385, 24), (47, 5), (40, 5), (31, 4), (9, 4)])
def test_every_order_of_magnitude_is_as_likely_as_another(points: int, classes: int) -> None:
    """Whatever the density of points: classes of sizes, of about eight points and at most two dozen, share evenly."""
    gap = small()[0]
    sizes = 1 + 60 * np.linspace(0, 1, points + 1)[1:] ** 2
    scene = Scene.of(gap, [of_size(gap, np.concatenate([[0.0, 0.5], sizes]))])
    prior = np.exp(scene.log_prior[0])
    assert prior[:2].tolist() == [0.0, 0.0]
    assert prior.sum() == pytest.approx(1.0)
    logs = np.log(sizes)
    edges = np.linspace(logs.min(), logs.max(), classes + 1)
    place = np.minimum(np.floor((logs - edges[0]) / (edges[1] - edges[0]) + 1e-9).astype(int), classes - 1)
    masses = np.array([prior[2:][place == one].sum() for one in np.unique(place)])
    np.testing.assert_allclose(masses, 1 / len(masses), rtol=1e-9)
    for one in np.unique(place):
        assert np.ptp(prior[2:][place == one]) < 1e-12


def test_where_an_effect_has_no_answer_it_is_impossible() -> None:
    gap = small()[0]
    some = of_size(gap, np.array([0.0, 2.0, 3.0, 4.0]))
    prior = Scene.of(gap, [given(gap, some.nodes, [True, True, False, True])]).log_prior[0]
    np.testing.assert_allclose(np.exp(prior), [0.0, 0.5, 0.0, 0.5])


def test_opened_before_is_every_background_with_more_in_it() -> None:
    """For the sheets that were asked; what strays is reckoned anew."""
    scene = small_scene()
    strays = scene.strays(0)
    directions = np.random.default_rng(1).standard_normal((len(scene.cells.z), 2))
    opened = scene.opened([0, 3], directions)
    assert opened.strays(0) is not strays
    for b in range(len(scene.before)):
        inverse = np.linalg.inv(dense(scene, b) + directions @ directions.T)
        for i in (0, 3):
            nodes = scene.cells.take(scene.surfaces[i].nodes)
            np.testing.assert_allclose(opened.seen[i][b].gram, nodes @ inverse @ nodes.T, rtol=1e-6, atol=1e-6)
        assert opened.seen[1][b] is scene.seen[1][b]
        logs = np.linalg.slogdet(inverse)[1] - len(inverse) * np.log(2 * np.pi)
        assert opened.before[b].log_norm == pytest.approx(0.5 * logs)


def test_strays_of_a_background_are_reckoned_once() -> None:
    scene = Scene.of(*small()[:2])
    assert scene.strays(1) is scene.strays(1)
    assert scene.strays(1).white is scene.before[1]
    assert scene.strays(0).white is scene.before[0]


def test_an_effect_of_two_signs_has_two_sheets() -> None:
    scene = small_scene()
    assert scene.ids.count("gun.toy_loss") == 1
    assert len(scene.sheets("gun.toy_loss")) == 2
    assert len(scene.sheets("gun.toy_leak")) == 1
    assert sorted(i for name in scene.ids for i in scene.sheets(name)) == list(range(len(scene.surfaces)))
    assert all(scene.surfaces[i].id == "gun.toy_loss" for i in scene.sheets("gun.toy_loss"))
