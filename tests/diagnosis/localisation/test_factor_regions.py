"""Regions of the factor space: found where the gap is local, not where it is everywhere or
nowhere."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.diagnosis.localisation.factor_regions import factor_regions
from pyroshock.diagnosis.verdict import Region
from support.records.toy_bench import Scatter, ToyLayer, ToyLoss, ToyMass, campaign, stages_of

_BACKGROUND = Scatter(background=(0.005, 0.015, 0.25))


def _regions(
    effects, seed, stage=1, scatter=_BACKGROUND, permutations=199, shuffled=False
) -> tuple[Region, ...]:
    rng = np.random.default_rng(seed)
    record = campaign(effects, rng, scatter=scatter)
    own = stages_of(record)[stage]
    configurations = list(record.configurations)
    if shuffled:
        rng.shuffle(configurations)
    return factor_regions(
        own.residuals(), record.configuration_of, configurations, own.observables, rng, permutations
    )


def test_planted_layer_is_found_again_and_again() -> None:
    (found,) = _regions((ToyLayer(0.1),), 0, permutations=999)
    assert found.rule == "insulator = polymeric"
    assert found.p_value < 0.01
    assert found.excess > 2
    named = [[each.rule for each in _regions((ToyLayer(0.15),), seed)] for seed in range(10)]
    assert sum(each == ["insulator = polymeric"] for each in named) >= 9


def test_a_region_of_two_conditions() -> None:
    """A gap of the polymeric layer at high pressures alone."""
    rng = np.random.default_rng(1)
    record = campaign((), rng, scatter=_BACKGROUND)
    stage = stages_of(record)[1]
    residual = stage.residuals().copy()
    for row, run in enumerate(record.runs):
        factors = record.configurations[run.configuration].factors
        residual[row] += 0.3 * (
            factors["insulator"] == "polymeric" and float(factors["tank_pressure"]) > 1.5e5
        )
    found = factor_regions(
        residual, record.configuration_of, record.configurations, stage.observables, rng
    )
    assert found[0].rule in (
        "tank_pressure_bar > 1.5 and insulator = polymeric",
        "insulator = polymeric and tank_pressure_bar > 1.5",
    )


@pytest.mark.parametrize("confounded", [False, True], ids=["alone", "confounded"])
@pytest.mark.parametrize("word", ["254 mm", "254", "PLA and steel"])
def test_a_gap_of_one_level_of_a_text(word: str, confounded: bool) -> None:
    """With the bullet that always went with it, where one did."""
    rng = np.random.default_rng(2)
    record = campaign((), rng, scatter=_BACKGROUND)
    stage = stages_of(record)[1]
    words = [("127 mm", "M4 x 10", word)[i % 3] for i in range(len(record.configurations))]
    more = [{"striker": each} | ({"bullet": f"no {each}"} if confounded else {}) for each in words]
    pairs = zip(record.configurations, more, strict=True)
    configurations = [replace(each, factors={**each.factors, **own}) for each, own in pairs]
    struck = np.array([each == word for each in words])[record.configuration_of]
    residual = stage.residuals() + 0.3 * struck[:, None]
    found = factor_regions(
        residual, record.configuration_of, configurations, stage.observables, rng, 199
    )
    expected = {f"striker = {word}"} | ({f"bullet = no {word}"} if confounded else set())
    assert {each.rule for each in found} == expected


@pytest.mark.parametrize("background", [0.0, 0.8], ids=["scatter", "background"])
def test_no_region_without_an_effect(background: float) -> None:
    """In tolerances: a scatter of 2 a run, and of each configuration."""
    rng = np.random.default_rng(0)
    record = campaign((), rng)
    of, observables = record.configuration_of, stages_of(record)[1].observables
    tolerance = np.array([item.tolerance for item in observables])
    named = 0
    for _ in range(100):
        gap = (
            2.0 * rng.standard_normal((of.size, 3)) + background * rng.standard_normal((24, 3))[of]
        )
        named += bool(
            factor_regions(
                gap * tolerance, of, record.configurations, observables, rng, permutations=99
            )
        )
    assert named <= 5


def test_shuffled_factors_give_chance_and_everywhere_is_no_region() -> None:
    named = sum(
        any(
            each.rule == "insulator = polymeric"
            for each in _regions((ToyLayer(0.15),), seed, shuffled=True)
        )
        for seed in range(20)
    )
    assert named <= 2
    everywhere = ((ToyMass(1.2), 1), (ToyLoss(0.1), 0))
    assert (
        sum(
            bool(_regions((effect,), seed, stage))
            for seed in range(5)
            for effect, stage in everywhere
        )
        <= 1
    )
    rng = np.random.default_rng(0)
    record = campaign((ToyLayer(0.2),), rng)
    contact = stages_of(record)[1]
    residual = np.where(record.configuration_of[:, None] < 3, contact.residuals(), np.nan)
    assert (
        factor_regions(
            residual, record.configuration_of, record.configurations, contact.observables, rng
        )
        == ()
    )


@pytest.mark.bench
def test_a_search_takes_a_second() -> None:
    started = time.perf_counter()
    _regions((ToyLayer(0.15),), 0, permutations=999)
    assert time.perf_counter() - started < 1.0
