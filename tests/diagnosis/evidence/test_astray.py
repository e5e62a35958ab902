"""What acts as an effect does, but not where and when its law says, is unknown: in one stage and across two."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.diagnosis.evidence.astray import AsEffectsDo
from pyroshock.diagnosis.evidence.scene import Scene
from pyroshock.diagnosis.evidence.surface import Surface, surfaces
from pyroshock.diagnosis.evidence.weighing import weigh
from pyroshock.diagnosis.evidence.whitening import Whitening
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.stages.base import Stage
from pyroshock.diagnosis.verdict import UNKNOWN
from pyroshock.twin.effects import Effect
from toy_bench import (
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


def test_ways_are_weighed_as_their_covariance_says() -> None:
    """The closed form over three sizes against the densities of C + a^2 W W'."""
    rng = np.random.default_rng(2)
    root, noise = rng.standard_normal((12, 4)), np.diag(rng.uniform(0.5, 2.0, 12))
    white = Whitening.of(noise)
    z = 4 * rng.standard_normal(12)
    way = AsEffectsDo.of("gun", white, white.white(root))
    densities = [Whitening.of(noise + a**2 * root @ root.T).log_density(z) for a in (3.0, 6.0, 12.0)]
    assert way.log_density(z) == pytest.approx(np.logaddexp.reduce(densities) - np.log(3))


def test_strays_of_a_scene_are_those_of_whitened_roots() -> None:
    """Each way's W W' before its background has the rank and the size that was asked: a tolerance rms in its stage."""
    gap, table, _ = bench(3)
    scene = Scene.of(gap, table)
    ways = [one for one in scene.astray if isinstance(one, AsEffectsDo)]
    assert {one.stage for one in ways} == set(gap.stages)
    for one in ways[:: max(1, len(ways) // 40)]:
        lower = one.white.lower
        spread = lower @ one.directions  # back from before the background
        variance = (spread**2).sum(axis=1)
        here = scene.kernels.stage == one.stage
        touched = variance[here] > 1e-9
        assert touched.any()
        assert 0.05 < np.sqrt(variance[here][touched].mean()) < 3.5
