"""A campaign as arrays: what its cells are, and what effects do to them, on a bench in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.inference.problem import InferenceProblem
from pyroshock.validation.baselines import BASELINES, GapProblem
from support.records.toy_bench import ToyGun, ToyLayer, ToyLoss, ToyMass, campaign, stages_of

KINDS = (ToyLoss, ToyMass, ToyLayer)


def problem(*effects, seed: int = 0) -> GapProblem:
    record = campaign(effects, np.random.default_rng(seed))
    stages = stages_of(record)[:2]
    gap = GapTable.of(record, stages)
    return GapProblem.of(gap, InferenceProblem.of(gap, stages, KINDS))


def test_without_effects_nothing_is_simulated() -> None:
    record = campaign((), np.random.default_rng(0))
    one = GapProblem.of(GapTable.of(record, [ToyGun(record)]))
    assert (one.changes, one.parameters) == ({}, {})
    assert one.noise.shape == (24, 24)


def test_cells_are_means_over_tolerances() -> None:
    record = campaign((ToyLoss(0.1),), np.random.default_rng(0))
    gap = GapTable.of(record, [ToyGun(record)])
    one = GapProblem.of(gap)
    np.testing.assert_allclose(one.z, gap.mean[one.configuration, one.observable] / 0.01)


def test_stages_have_no_noise_in_common() -> None:
    one = problem()
    apart = one.stage[:, None] != one.stage[None, :]
    assert apart.any() and not one.noise[apart].any()
    assert np.linalg.eigvalsh(one.noise).min() > 0


def test_changes_are_those_of_the_law() -> None:
    """A loss moves every velocity alike and no pulse; a heavier mass moves the three logarithms by its powers."""
    one = problem()
    gun = one.stage == "gun"
    loss = one.changes["gun.toy_loss"]
    assert np.ptp(loss[:, gun], axis=1).max() == pytest.approx(0.0, abs=1e-9)
    assert not loss[:, ~gun].any()
    peak, impulse, width = (one.changes["contact.toy_mass"][:, one.observable == i] for i in (1, 2, 3))
    np.testing.assert_allclose(peak / 0.6, width / 0.4, atol=1e-9)
    np.testing.assert_allclose(peak / 0.6, impulse, atol=1e-9)


def test_places_are_even_in_the_prior() -> None:
    """Nine of one parameter, whose likely range ends two standard deviations from none: the middle one does nothing."""
    loss = -0.01 * np.sort(problem().changes["gun.toy_loss"][:, 0])[::-1]
    assert len(loss) == 9
    np.testing.assert_allclose(loss, -loss[::-1], atol=1e-9)
    assert loss[5] == pytest.approx(0.2 * 0.2822, rel=1e-3)  # the normal quantile of 5.5 / 9 ...
    assert loss[8] == pytest.approx(0.2 * 1.5932, rel=1e-3)  # ... and of 8.5 / 9


@pytest.mark.parametrize("name", ["noise-only evidence", "BIC"])
@pytest.mark.parametrize("effect", [ToyLoss(0.12), ToyMass(1.3), ToyLayer(0.3)], ids=lambda effect: effect.id)
def test_a_simple_way_names_the_effect(name: str, effect) -> None:
    said = BASELINES[name](problem(effect))
    assert max(said, key=lambda label: said[label]) == effect.id
