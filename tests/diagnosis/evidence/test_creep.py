"""What repetitions say of a drift that the means of shuffled runs hide."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.diagnosis.evidence.creep import Creep
from pyroshock.diagnosis.evidence.factors import smooth
from pyroshock.diagnosis.evidence.scene import Scene
from pyroshock.diagnosis.evidence.surface import surfaces
from pyroshock.diagnosis.evidence.weighing import weigh
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.record import CampaignRecord
from pyroshock.diagnosis.verdict import NONE, UNKNOWN
from support.records.toy_bench import (
    Design,
    Scatter,
    ToyLayer,
    ToyLeak,
    ToyLoss,
    ToyMass,
    ToyVelocityGain,
    campaign,
    stages_of,
)

KINDS = (ToyLoss, ToyLeak, ToyMass, ToyLayer, ToyVelocityGain)
TIME = np.linspace(0, 1, 96)  # of the toy bench's runs


def table(record: CampaignRecord) -> GapTable:
    return GapTable.of(record, stages_of(record))


def shuffled(drift: float = 0.0, seed: int = 3) -> CampaignRecord:
    return campaign([], np.random.default_rng(seed), scatter=Scatter(drift=drift))


def in_blocks(record: CampaignRecord) -> CampaignRecord:
    """The same runs, a configuration's repetitions one after the other."""
    runs = sorted(record.runs, key=lambda run: run.configuration)
    return replace(record, runs=tuple(replace(run, order=place) for place, run in enumerate(runs)))


@pytest.mark.parametrize("drift", [-0.08, 0.0, 0.05])
def test_slope_is_that_of_the_drift(drift: float) -> None:
    gap = table(shuffled(drift))
    creep = Creep.of(gap)
    first = int(np.flatnonzero(creep.columns == 0)[0])
    assert gap.observables[0].stage == "gun"
    uncertain = np.sqrt((creep.noise.lower @ creep.noise.lower.T)[first, first])
    assert creep.slope[first] == pytest.approx(drift / gap.tolerance[0], abs=3 * uncertain)
    assert uncertain < max(0.6, abs(drift) / gap.tolerance[0] / 5)  # the scatter has the drift in it


def test_means_and_slope_vary_as_a_drift_makes_them() -> None:
    """Drifts drawn from the kernel, averaged and regressed run by run."""
    gap = table(shuffled())
    creep, of = Creep.of(gap), gap.record.configuration_of
    rng = np.random.default_rng(1)
    kernel = smooth((TIME[:, None] - TIME[None, :]) ** 2, 0.4)
    drifts = np.linalg.cholesky(kernel + 1e-9 * np.eye(TIME.size)) @ rng.standard_normal((TIME.size, 20_000))
    member = np.eye(len(gap.rows))[of].T
    share = member / member.sum(axis=1, keepdims=True)
    off = TIME - (share @ TIME)[of]
    drawn = np.concatenate([share @ drifts, (off @ drifts)[None] / (off @ off)])
    root = np.concatenate([creep.means, creep.within.sum(axis=0)[None]])
    expected = np.cov(drawn)
    np.testing.assert_allclose(root @ root.T, expected, atol=0.05 * np.abs(expected).max())


def test_configurations_without_repetition_say_nothing_of_a_drift() -> None:
    record = campaign([], np.random.default_rng(1), Design(repetitions=1))
    assert Creep.of(table(record)).columns.size == 0


def test_repetitions_that_follow_one_another_say_nothing_of_a_drift() -> None:
    """Their means do: the whole drift lies between them."""
    creep = Creep.of(table(in_blocks(shuffled())))
    assert creep.columns.size == 0
    assert (creep.means**2).sum(axis=1).mean() == pytest.approx(1.0, abs=0.02)


def test_drift_that_shuffling_hides_is_unknown() -> None:
    """Half of the drift stands in every mean, where it looks like a gain; only repetitions tell."""
    record = shuffled(-0.12, seed=5)
    stages = stages_of(record)
    gap = GapTable.of(record, stages)
    scene = Scene.of(gap, surfaces(stages, KINDS))
    assert next(iter(weigh(scene).probability)) == UNKNOWN
    hidden = replace(scene.cells.creep, slope=np.zeros_like(scene.cells.creep.slope))
    blind = replace(scene, cells=replace(scene.cells, creep=hidden))
    assert next(iter(weigh(blind).probability)) not in (UNKNOWN, NONE)


def test_some_of_the_configurations_have_their_own_slope() -> None:
    gap = table(shuffled(0.05))
    half = Creep.of(gap.only(np.arange(0, len(gap.rows), 2)))
    assert half.means.shape[0] == half.within.shape[0] == len(gap.rows[::2])
    assert half.slope.shape == half.columns.shape
    assert half.slope[0] != Creep.of(gap).slope[0]
