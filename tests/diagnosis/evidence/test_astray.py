"""What acts as an effect does, but not where and when its law says, is unknown: in one stage and across two."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.diagnosis.evidence.astray import AMPLITUDES, Strays
from pyroshock.diagnosis.evidence.scene import Scene
from pyroshock.diagnosis.evidence.surface import Surface, surfaces
from pyroshock.diagnosis.evidence.way import Block, Way
from pyroshock.diagnosis.evidence.weighing import weigh
from pyroshock.diagnosis.evidence.whitening import Whitening
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.stages.base import Stage
from pyroshock.diagnosis.verdict import UNKNOWN
from pyroshock.twin.effects import Effect
from support.records.toy_bench import (
    ToyDamping,
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

KINDS = (ToyLoss, ToyLeak, ToyMass, ToyLayer, ToyDamping, ToyForceGain, ToyVelocityGain)


def bench(seed: int) -> tuple[GapTable, tuple[Surface, ...], tuple[Stage, ...]]:
    stages = stages_of(campaign([], np.random.default_rng(seed)))
    gap = GapTable.of(stages[0].record, stages)
    return gap, surfaces(stages, KINDS), stages


def acting(gap: GapTable, stages: tuple[Stage, ...], effect: Effect, size: np.ndarray) -> GapTable:
    """With so many times the change of an effect in each configuration."""
    change = np.concatenate([changes_of(stage, [[effect]])[0] for stage in stages], axis=1)
    return replace(gap, mean=gap.mean + size[:, None] * change[gap.rows])


@pytest.mark.parametrize("effect", [ToyForceGain(1.3), ToyMass(1.4), ToyVelocityGain(0.85)], ids=lambda e: e.id)
def test_size_that_follows_no_law_is_unknown(effect: Effect) -> None:
    """Two of them show in two stages, as what a sensor between these misreads does."""
    gap, table, stages = bench(1)
    rng = np.random.default_rng(5)
    by_law = weigh(Scene.of(acting(gap, stages, effect, np.ones(len(gap.rows))), table))
    lawless = weigh(Scene.of(acting(gap, stages, effect, rng.uniform(-0.6, 2.0, len(gap.rows))), table))
    assert next(iter(by_law.probability)) == effect.id
    assert next(iter(lawless.probability)) == UNKNOWN


def in_all(course: str, manner: str, whitened: np.ndarray, least: float = 0.0) -> Way:
    """A way that is given as it is."""
    return Way("gun", course, manner, Block(whitened[:, None]), np.ones((1, 1)), least=least)


def test_ways_are_weighed_as_their_covariance_says() -> None:
    """The closed form over three sizes against the densities of C + a^2 W W'."""
    rng = np.random.default_rng(2)
    root, noise = rng.standard_normal((12, 4)), np.diag(rng.uniform(0.5, 2.0, 12))
    white = Whitening.of(noise)
    z = 4 * rng.standard_normal(12)
    ways = [in_all("smooth", "direction", white.white(part)) for part in (root, root[:, :1], root[:, 1:3])]
    found = Strays.of(white, ways).log_densities(white.white(z), np.zeros(0))
    for part, log in zip((root, root[:, :1], root[:, 1:3]), found, strict=True):
        densities = [Whitening.of(noise + a**2 * part @ part.T).log_density(z) for a in AMPLITUDES]
        assert log == pytest.approx(np.logaddexp.reduce(densities) - np.log(3))


def test_courses_count_alike_and_manners_within_one() -> None:
    """A third way of one manner takes nothing from another manner, nor a second manner from another course."""
    rng = np.random.default_rng(8)
    white = Whitening.of(np.eye(5))
    names = [("smooth", "law"), ("smooth", "law"), ("smooth", "one"), ("drift", "one")]
    strays = Strays.of(white, [in_all(*name, rng.standard_normal((5, 2))) for name in names])
    densities = rng.uniform(0.1, 1.0, 4)
    expected = 0.5 * (0.5 * (densities[:2].mean() + densities[2]) + densities[3])
    assert np.exp(strays.log_mean("gun", np.log(densities))) == pytest.approx(expected)


@pytest.mark.parametrize("size", [-4.0, 0.3, 2.5])
def test_stray_of_one_size_is_beyond_the_least(size: float) -> None:
    """Against the integral over sizes, of a normal prior without its middle."""
    rng = np.random.default_rng(4)
    root, noise = rng.standard_normal((9, 1)), np.diag(rng.uniform(0.5, 2.0, 9))
    white = Whitening.of(noise)
    z = size * root[:, 0] + rng.standard_normal(9)
    least = 1.2
    way = Strays.of(white, [in_all("same", "law", white.white(root), least)])
    sizes = np.linspace(-60, 60, 120_001)
    sizes = sizes[np.abs(sizes) > least]
    away = white.white(z[:, None] - root * sizes)
    likelihood = np.exp(white.log_norm - 0.5 * (away**2).sum(axis=0))
    priors = [np.exp(-0.5 * (sizes / amplitude) ** 2) for amplitude in AMPLITUDES]
    found = np.mean([(likelihood * prior).sum() / prior.sum() for prior in priors])
    assert way.log_densities(white.white(z), np.zeros(0)) == pytest.approx(np.log(found), abs=0.005)


def test_ways_have_the_size_that_was_asked() -> None:
    """Each way's W W' before its background is of about a tolerance where it is touched, in its stage."""
    gap, table, _ = bench(3)
    scene = Scene.of(gap, table)
    for background in (0, len(scene.before) - 1):
        strays, lower = scene.strays(background), scene.before[background].lower
        assert {stage for stage, _, _ in strays.names} == set(gap.stages)
        assert {course for _, course, _ in strays.names} >= {"smooth", "rough", "each", "drift", "level"}
        for way in range(0, len(strays.names), max(1, len(strays.names) // 40)):
            variance = ((lower @ strays.roots(way)[: len(lower)]) ** 2).sum(axis=1)  # back from before the background
            here = scene.kernels.stage == strays.names[way][0]
            touched = variance[here] > 1e-9
            assert touched.any()
            assert 0.05 < np.sqrt(variance[here][touched].mean()) < 6.0


@pytest.mark.parametrize(
    ("inside", "effect"),
    [("one level", ToyForceGain(1.3)), ("beyond a limit", ToyMass(1.5))],
)
def test_what_acts_in_a_part_of_the_campaign_is_unknown(inside: str, effect: Effect) -> None:
    """Where an effect acts by the library's law in all configurations, a cause that acts in some is none of it."""
    gap, table, stages = bench(6)
    factors = [gap.record.configurations[int(row)].factors for row in gap.rows]
    name = next(name for name in sorted(factors[0]) if len({row[name] for row in factors}) > 1)
    level = factors[0][name]
    loud = gap.loudness[stages[-1].name][gap.rows]
    part = np.array([row[name] == level for row in factors]) if inside == "one level" else loud > np.quantile(loud, 0.7)
    weighed = weigh(Scene.of(acting(gap, stages, effect, 2.0 * part), table))
    assert next(iter(weighed.probability)) == UNKNOWN


def test_without_any_effect_a_gap_is_unknown() -> None:
    """Nothing in the catalogue: what is beyond tolerance in a stage of one observable, as in any other, is unknown."""
    gap, _, stages = bench(2)
    rng = np.random.default_rng(1)
    for factor in (np.full(len(gap.rows), 2.0), rng.uniform(-3, 3, len(gap.rows))):
        moved = acting(gap, stages, ToyVelocityGain(1.3), factor)
        assert next(iter(weigh(Scene.of(moved, ())).probability)) == UNKNOWN


def test_stage_of_which_nothing_is_left_strays_nowhere() -> None:
    """As in a fold whose configurations have no record of it."""
    gap, table, _ = bench(2)
    count, mean = gap.count.copy(), gap.mean.copy()
    gone = gap.columns("contact")
    count[:, gone], mean[:, gone] = 0, np.nan
    scene = Scene.of(replace(gap, count=count, mean=mean), table)
    assert "contact" not in {stage for stage, _, _ in scene.strays(0).names}
    probability = weigh(scene).probability
    assert sum(probability.values()) == pytest.approx(1.0)
    assert np.isfinite(probability[UNKNOWN])


def test_products_of_a_way_are_those_of_its_columns() -> None:
    """Blocks mixed by a root, with slopes beside, against W as one matrix."""
    rng = np.random.default_rng(3)
    block, root, slopes = (
        Block(rng.standard_normal((20, 4, 3))),
        rng.standard_normal((4, 2)),
        rng.standard_normal((5, 6)),
    )
    zw, slope = rng.standard_normal(20), rng.standard_normal(5)
    for beside in (slopes, None):
        way = Way("gun", "drift", "mode", block, root, beside)
        whole = way.whitened(5)
        np.testing.assert_allclose(way.gram, whole.T @ whole, atol=1e-12)
        np.testing.assert_allclose(way.along(block.along(zw), slope), whole.T @ np.concatenate([zw, slope]), atol=1e-12)
