"""Campaigns simulated for a design of one's own: what is drawn, and what the map makes of it."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from pyroshock.diagnosis.calibration import CalibrationMap
from pyroshock.diagnosis.diagnose import probabilities
from pyroshock.diagnosis.evidence.scene import Scene
from pyroshock.diagnosis.evidence.surface import surfaces
from pyroshock.diagnosis.evidence.weighing import weigh
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.hypotheses import Priors
from pyroshock.diagnosis.options import Options
from pyroshock.diagnosis.own_design import own_map, simulated, with_gap
from support.records.toy_bench import ToyLayer, ToyLeak, ToyLoss, ToyMass, campaign, stages_of

KINDS = (ToyLoss, ToyLeak, ToyMass, ToyLayer)


@pytest.fixture(scope="module")
def scene() -> Scene:
    stages = stages_of(campaign([], np.random.default_rng(3)))
    return Scene.of(GapTable.of(stages[0].record, stages), surfaces(stages, KINDS))


def test_causes_are_drawn_by_the_priors(scene: Scene) -> None:
    drawn = list(simulated(scene, Priors(0.3, 0.3, 0.2, 0.2), 400, np.random.default_rng(0)))
    kinds = Counter("pair" if "+" in truth else truth if truth in ("none", "unknown") else "one" for *_, truth in drawn)
    for kind, share in (("none", 0.3), ("one", 0.3), ("pair", 0.2), ("unknown", 0.2)):
        assert kinds[kind] / 400 == pytest.approx(share, abs=0.08)
    assert {truth for *_, truth in drawn if "+" not in truth} == {"none", "unknown", *scene.ids}


def test_campaigns_without_a_cause_scatter_as_the_bank_and_the_noise_say(scene: Scene) -> None:
    """Whitened by the covariance that all backgrounds have on the mean, the sum of squares is N on the mean."""
    drawn = np.array([z for z, *_ in simulated(scene, Priors(1.0, 0.0, 0.0, 0.0), 800, np.random.default_rng(1))])
    mean = sum(white.lower @ white.lower.T for white in scene.before) / len(scene.before)
    squares = (np.linalg.solve(np.linalg.cholesky(mean), drawn.T) ** 2).sum(axis=0)
    assert squares.mean() / drawn.shape[1] == pytest.approx(1.0, abs=0.1)
    assert np.abs(drawn.mean(axis=0)).max() < 5 * np.sqrt(np.diag(mean).max() / 800)


def test_what_is_drawn_is_found(scene: Scene) -> None:
    """No law is wrong by more than the evidence allows for: what is drawn comes first or among the first."""
    drawn = list(simulated(scene, Priors(0.25, 0.5, 0.0, 0.25), 60, np.random.default_rng(2)))
    found = [list(weigh(with_gap(scene, *means)).probability) for *means, _ in drawn]
    right = [truth in said[:2] for (*_, truth), said in zip(drawn, found, strict=True)]
    assert np.mean(right) > 0.85


def test_map_is_of_the_design_and_of_the_seed(scene: Scene) -> None:
    told: list[tuple[int, int, str]] = []
    one = own_map(scene, Priors(), 12, 7, lambda *now: told.append(now))
    assert one == own_map(scene, Priors(), 12, 7)
    assert one != own_map(scene, Priors(), 12, 8)
    assert "12 simulated campaigns of this design" in one.source
    assert isinstance(one, CalibrationMap)
    assert told[-1][:2] == (12, 12)


def test_no_campaign_at_all_is_refused(scene: Scene) -> None:
    with pytest.raises(ValueError, match="expected at least 1"):
        own_map(scene, Priors(), 0, 1)


def test_probabilities_go_through_the_map_that_was_asked_for() -> None:
    record = campaign([], np.random.default_rng(3))
    stages = stages_of(record)
    made = Scene.of(GapTable.of(record, stages), surfaces(stages, KINDS))
    one = own_map(made, Priors(), 3, 0)
    options = Options(map=one)
    weighed = weigh(made)
    assert probabilities(weighed, options) == one(weighed.log_joint)
    assert probabilities(weighed, Options()) != probabilities(weighed, options)
