"""Scores of predictions whose calibration is known by construction, and planted failures that come
back as rules."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.validation.prediction_scores.failure_rules import EVERYWHERE, ShotFactor, failures
from pyroshock.validation.prediction_scores.quantity_score import (
    ComparedValues,
    Coverage,
)
from support.records.scored_shots import FORCE, gaussian, score


def test_calibrated_predictions_have_nominal_coverage_and_flat_histogram() -> None:
    result = score(gaussian(20_000))
    assert result.coverage50.share == pytest.approx(0.50, abs=0.015)
    assert result.coverage90.share == pytest.approx(0.90, abs=0.01)
    assert result.histogram == pytest.approx(np.full(10, 0.1), abs=0.01)
    assert result.sharpness == pytest.approx(2 * 1.645, rel=0.02)
    assert result.crps == pytest.approx(1 / np.sqrt(np.pi), rel=0.02)
    assert result.median_abs_error == pytest.approx(0.6745, rel=0.03)


def test_repetitions_count_as_much_as_they_differ() -> None:
    configuration = np.repeat(np.arange(30), 4)
    inside = np.repeat(np.random.default_rng(4).random(30) < 0.8, 4)
    coverage = Coverage.of(inside, configuration)
    assert coverage.effective == pytest.approx(30, rel=0.05)
    low, high = coverage.interval()
    assert high - low > 1.8 * np.subtract(*reversed(Coverage.of(inside, np.arange(120)).interval()))
    rng = np.random.default_rng(5)
    effective = [
        Coverage.of(rng.random(400) < 0.8, np.repeat(np.arange(100), 4)).effective
        for _ in range(50)
    ]
    assert np.median(effective) > 330
    coverage = Coverage.of(np.ones(12, dtype=bool), np.repeat(np.arange(4), 3))
    assert coverage.effective == 4
    assert coverage.interval() == pytest.approx(
        (0.025**0.25, 1.0)
    )  # Clopper and Pearson, closed form for all of 4


def test_intervals_of_clustered_shares_hold_their_level() -> None:
    """Beta-binomial repetitions: the interval holds the true share in about 95 of 100 campaigns."""
    rng = np.random.default_rng(6)
    configuration = np.repeat(np.arange(40), 3)
    hits = 0
    for _ in range(300):
        share = rng.beta(0.9 * 2, 0.1 * 2, 40)
        low, high = Coverage.of(rng.random(120) < np.repeat(share, 3), configuration).interval()
        hits += low <= 0.9 <= high
    assert hits / 300 >= 0.92


def test_rank_of_values_beyond_draws_is_inside_unit_interval() -> None:
    draws = np.linspace(0.0, 1.0, 9)[:, None] * np.ones(3)
    assert ComparedValues.of(draws, np.array([-1.0, 0.5, 2.0])).rank == pytest.approx(
        [0.05, 0.5, 0.95]
    )
    with pytest.raises(ValueError, match="leave out what was not measured"):
        ComparedValues.of(np.zeros((4, 1)), np.array([np.nan]))
    keys = {
        "name",
        "unit",
        "shots",
        "coverage50",
        "coverage90",
        "coverage90_ci95",
        "crps",
        "median_abs_error",
    }
    assert keys <= set(score(gaussian(20)).as_json())


def campaign(
    seed: int, configurations: int = 40, repetitions: int = 3
) -> tuple[np.ndarray, list[ShotFactor]]:
    rng = np.random.default_rng(seed)
    tips = rng.choice(["delrin", "polyurethane", "steel"], configurations)
    pressure = rng.choice([1e5, 2e5, 4e5, 6e5], configurations)
    radius = rng.choice([0.02, 0.045], configurations)
    number = np.repeat(np.arange(configurations), repetitions)
    return number, [
        ShotFactor("tip_material", tips[number]),
        ShotFactor("tank_pressure", pressure[number], "bar", 1e-5),
        ShotFactor("tip_radius", radius[number], "mm", 1e3),
    ]


def noise(number: np.ndarray, seed: int) -> np.ndarray:
    """Of each configuration, and of each shot."""
    rng = np.random.default_rng(seed)
    return 0.1 * rng.normal(size=number.max() + 1)[number] + 0.05 * rng.normal(size=len(number))


def test_one_or_two_conditions() -> None:
    number, factors = campaign(0)
    residual = noise(number, 1) + 0.43 * (factors[0].values == "polyurethane")
    named = failures(FORCE, residual, number, factors, np.random.default_rng(0))
    rule = named[-1]
    assert rule.rule == "tip_material = polyurethane"
    assert rule.bias == pytest.approx(np.exp(-0.43) - 1, abs=0.06)
    assert rule.sentence.startswith("tip material = polyurethane: the peak force is predicted 3")
    assert rule.sentence.endswith("% too low")
    number, factors = campaign(3, 60)
    both = (factors[0].values == "polyurethane") & (factors[1].values > 3e5)
    named = failures(
        FORCE, noise(number, 4) + 0.5 * both, number, factors, np.random.default_rng(0)
    )
    assert named[-1].rule == "tip_material = polyurethane and tank_pressure > 3 bar"


def test_bias_of_all_shots() -> None:
    number, factors = campaign(5)
    named = failures(FORCE, noise(number, 6) - 0.2, number, factors, np.random.default_rng(0))
    assert [failure.rule for failure in named] == [EVERYWHERE]
    assert named[0].bias == pytest.approx(np.exp(0.2) - 1, abs=0.05)
    assert "too high" in named[0].sentence


def test_noise_gives_seldom_a_rule() -> None:
    count = 0
    for seed in range(60):
        number, factors = campaign(seed, 24)
        count += bool(
            failures(
                FORCE, noise(number, 1000 + seed), number, factors, np.random.default_rng(seed)
            )
        )
    # one test for all shots and one for the rules, each at 5 %, and a bias of 5 % at least
    assert count <= 10


def test_repetitions_do_not_make_a_rule() -> None:
    # A single configuration with many shots is a single observation.
    number = np.repeat(np.arange(8), 25)
    factors = [ShotFactor("tip_material", np.where(number < 4, "delrin", "steel"))]
    residual = np.where(number == 5, 0.8, 0.0) + 0.01 * np.random.default_rng(1).normal(
        size=len(number)
    )
    assert failures(FORCE, residual, number, factors, np.random.default_rng(0)) == []
    assert (
        failures(FORCE, np.full(4, 0.5), np.zeros(4, dtype=int), [], np.random.default_rng(0)) == []
    )
