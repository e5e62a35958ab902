"""Planted failures come back as rules; noise gives none."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.validation.prediction_scores.failure_rules import EVERYWHERE, ShotFactor, failures
from pyroshock.validation.prediction_scores.quantity_score import Measure

FORCE = Measure("peak_force", "peak force", "ln", "N")


def campaign(seed: int, configurations: int = 40, repetitions: int = 3) -> tuple[np.ndarray, list[ShotFactor]]:
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


def test_one_condition() -> None:
    number, factors = campaign(0)
    residual = noise(number, 1) + 0.43 * (factors[0].values == "polyurethane")
    named = failures(FORCE, residual, number, factors, np.random.default_rng(0))
    rule = named[-1]
    assert rule.rule == "tip_material = polyurethane"
    assert rule.bias == pytest.approx(np.exp(-0.43) - 1, abs=0.06)
    assert rule.sentence.startswith("tip_material = polyurethane: the peak force is predicted 3")
    assert rule.sentence.endswith("% too low")


def test_two_conditions() -> None:
    number, factors = campaign(3, 60)
    both = (factors[0].values == "polyurethane") & (factors[1].values > 3e5)
    named = failures(FORCE, noise(number, 4) + 0.5 * both, number, factors, np.random.default_rng(0))
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
        count += bool(failures(FORCE, noise(number, 1000 + seed), number, factors, np.random.default_rng(seed)))
    # one test for all shots and one for the rules, each at 5 %, and a bias of 5 % at least
    assert count <= 10


def test_repetitions_do_not_make_a_rule() -> None:
    # A single configuration with many shots is a single observation.
    number = np.repeat(np.arange(8), 25)
    factors = [ShotFactor("tip_material", np.where(number < 4, "delrin", "steel"))]
    residual = np.where(number == 5, 0.8, 0.0) + 0.01 * np.random.default_rng(1).normal(size=len(number))
    assert failures(FORCE, residual, number, factors, np.random.default_rng(0)) == []
    assert failures(FORCE, np.full(4, 0.5), np.zeros(4, dtype=int), [], np.random.default_rng(0)) == []
