"""Campaigns as arrays, and the simple ways of answering, on problems whose answer is known."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from pyroshock.array_types import Floats
from pyroshock.diagnosis import chain
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.inference.problem import InferenceProblem
from pyroshock.diagnosis.options import Options
from pyroshock.diagnosis.reading import read_folder
from pyroshock.validation.baselines import (
    BASELINES,
    Forest,
    GapProblem,
    bic,
    features,
    largest_residual,
    most_frequent,
    noise_only,
)
from pyroshock.validation.cases.draw import draw_case
from pyroshock.validation.cases.record import record_case
from pyroshock.validation.joint_ridge import joint_ridge
from support.records.toy_bench import ToyGun, ToyLayer, ToyLoss, ToyMass, campaign, stages_of

A, B = "gun.blow_by", "contact.plastic_yield"
C = 12
SLOPE = np.linspace(-1, 1, C)


def problem(z: Floats, sigma: float = 0.1, stage: str = "gun") -> GapProblem:
    """One observable; effect A moves it evenly by 0.1 to 3 tolerances, effect B along a slope."""
    sizes = np.linspace(0.1, 3.0, 30)[:, None]
    return GapProblem(
        z=z,
        noise=sigma**2 * np.eye(C),
        stage=np.array([stage] * C),
        configuration=np.arange(C),
        observable=np.zeros(C, dtype=np.intp),
        changes={A: sizes * np.ones(C), B: sizes * SLOPE},
        parameters={A: 1, B: 1},
    )


@pytest.mark.parametrize("name", ["noise-only evidence", "BIC"])
@pytest.mark.parametrize(
    ("truth", "z"), [(A, np.full(C, 1.5)), (B, 1.5 * SLOPE), ("none", np.zeros(C))]
)
def test_planted_effect_is_found(name: str, truth: str, z: Floats) -> None:
    said = BASELINES[name](problem(z + 0.1 * np.random.default_rng(3).standard_normal(C)))
    assert max(said, key=lambda label: said[label]) == truth
    assert sum(said.values()) == pytest.approx(1.0)


@pytest.mark.parametrize("answer", [noise_only, bic])
def test_background_is_taken_for_an_effect(answer) -> None:
    """What they fall short in: a background within tolerance that no effect of the catalogue
    makes."""
    z = 0.4 * np.sin(1.5 * SLOPE)
    assert answer(problem(z, sigma=0.05))["none"] < 0.01


def test_evidence_is_the_mean_of_the_likelihood() -> None:
    """One cell, one place: z = 1 with sigma 1 against a change of 1; both sides by hand."""
    gap_problem = GapProblem(
        z=np.array([1.0]),
        noise=np.array([[1.0 - 1e-4]]),
        stage=np.array(["gun"]),
        configuration=np.array([0]),
        observable=np.array([0]),
        changes={A: np.array([[1.0]])},
        parameters={A: 1},
    )
    odds = (5 / 7) / (2 / 7) * math.exp(0.5)
    assert noise_only(gap_problem)[A] == pytest.approx(odds / (1 + odds))
    assert bic(gap_problem)[A] == pytest.approx(
        1 / (1 + math.exp(-0.5))
    )  # ln 1 = 0: its parameter costs nothing


def test_largest_residual_names_the_stage_s_most_frequent() -> None:
    assert largest_residual(problem(np.full(C, 2.0))) == {A: 1.0}
    assert largest_residual(problem(np.full(C, 2.0), stage="contact")) == {B: 1.0}
    assert largest_residual(problem(np.full(C, 2.0)), {"gun": "gun.dead_volume"}) == {
        "gun.dead_volume": 1.0
    }
    assert largest_residual(problem(np.full(C, 0.5))) == {"none": 1.0}
    labels = [A, A, "gun.dead_volume", B, f"{A}+{B}", "none", "unknown"]
    assert most_frequent(labels) == {"gun": A, "contact": B}


def test_features_have_one_length() -> None:
    few, many = problem(np.zeros(C)), problem(np.zeros(C))
    grown = GapProblem(
        np.ones(4 * 50),
        np.eye(4 * 50),
        np.array(["plate"] * 200),
        np.repeat(np.arange(4), 50),
        np.tile(np.arange(50), 4),
        {},
        {},
    )
    assert features(few).shape == features(many).shape == features(grown).shape
    assert np.isfinite(features(grown)).all()


def test_forest_learns_two_shapes() -> None:
    rng = np.random.default_rng(5)
    shapes = {A: np.ones(C), B: SLOPE, "none": np.zeros(C)}
    rows = [
        (name, problem(size * shape + 0.1 * rng.standard_normal(C)))
        for name, shape in shapes.items()
        for size in rng.uniform(1, 3, 20)
    ]
    forest = Forest.trained(
        ["gun"] * len(rows),
        [features(p) for _, p in rows],
        [name for name, _ in rows],
        seed=1,
        trees=50,
    )
    said = forest.answer("gun", problem(2 * SLOPE))
    assert max(said, key=lambda label: said[label]) == B
    assert sum(said.values()) == pytest.approx(1.0)
    assert forest.answer("plate", problem(2 * SLOPE)) == {}


KINDS = (ToyLoss, ToyMass, ToyLayer)


def toy_problem(*effects, seed: int = 0) -> GapProblem:
    record = campaign(effects, np.random.default_rng(seed))
    stages = stages_of(record)[:2]
    gap = GapTable.of(record, stages)
    return GapProblem.of(gap, InferenceProblem.of(gap, stages, KINDS))


def test_cells_are_means_over_tolerances() -> None:
    record = campaign((), np.random.default_rng(0))
    gap_problem = GapProblem.of(GapTable.of(record, [ToyGun(record)]))
    assert (gap_problem.changes, gap_problem.parameters) == ({}, {})
    assert gap_problem.noise.shape == (24, 24)
    record = campaign((ToyLoss(0.1),), np.random.default_rng(0))
    gap = GapTable.of(record, [ToyGun(record)])
    gap_problem = GapProblem.of(gap)
    np.testing.assert_allclose(
        gap_problem.z, gap.mean[gap_problem.configuration, gap_problem.observable] / 0.01
    )
    # Nine of one parameter, whose likely range ends two standard deviations from none: the middle
    # one does nothing.
    loss = -0.01 * np.sort(toy_problem().changes["gun.toy_loss"][:, 0])[::-1]
    assert len(loss) == 9
    np.testing.assert_allclose(loss, -loss[::-1], atol=1e-9)
    assert loss[5] == pytest.approx(0.2 * 0.2822, rel=1e-3)  # the normal quantile of 5.5 / 9 ...
    assert loss[8] == pytest.approx(0.2 * 1.5932, rel=1e-3)  # ... and of 8.5 / 9


def test_changes_are_those_of_the_law_and_stages_have_no_noise_in_common() -> None:
    gap_problem = toy_problem()
    apart = gap_problem.stage[:, None] != gap_problem.stage[None, :]
    assert apart.any() and not gap_problem.noise[apart].any()
    assert np.linalg.eigvalsh(gap_problem.noise).min() > 0
    # A loss moves every velocity alike and no pulse; a heavier mass moves the three logarithms by
    # its powers.
    gun = gap_problem.stage == "gun"
    loss = gap_problem.changes["gun.toy_loss"]
    assert np.ptp(loss[:, gun], axis=1).max() == pytest.approx(0.0, abs=1e-9)
    assert not loss[:, ~gun].any()
    peak, impulse, width = (
        gap_problem.changes["contact.toy_mass"][:, gap_problem.observable == i] for i in (1, 2, 3)
    )
    np.testing.assert_allclose(peak / 0.6, width / 0.4, atol=1e-9)
    np.testing.assert_allclose(peak / 0.6, impulse, atol=1e-9)


@pytest.mark.parametrize("name", ["noise-only evidence", "BIC"])
@pytest.mark.parametrize(
    "effect", [ToyLoss(0.12), ToyMass(1.3), ToyLayer(0.3)], ids=lambda effect: effect.id
)
def test_a_simple_way_names_the_effect(name: str, effect) -> None:
    probabilities = BASELINES[name](toy_problem(effect))
    assert max(probabilities, key=lambda label: probabilities[label]) == effect.id


def test_gain_of_the_force_goes_held_out_too(tmp_path: Path) -> None:
    case = draw_case(
        "hammer",
        "strong",
        np.random.default_rng(2),
        cause="sensor.force_gain",
        decoy=False,
        number=0,
    )
    record_case(case, tmp_path / "c", 1)
    record = read_folder(tmp_path / "c")
    stages, _ = chain.stages_of(record, Options())
    answer = joint_ridge(stages, GapTable.of(record, stages))
    assert answer["fraction"] > 0.7
    assert answer["inside"] <= answer["after"] < answer["before"]
    assert sum(answer["shares"].values()) == pytest.approx(1.0)
