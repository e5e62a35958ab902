"""A drift over the order of runs, and what is none: repetitions in a row, and factors that changed
with the order."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.diagnosis.localisation.drift import drift
from pyroshock.diagnosis.observables.base import Observable
from pyroshock.diagnosis.record import RunConfiguration

VELOCITY = (Observable("ln_velocity", "gun", "velocity", "1", 0.01, 0.008),)
CELLS, REPEATS = 12, 3
STRIKERS = ("254 mm", "127 mm", "PLA and steel")


def settings(strikers: list[str]) -> list[RunConfiguration]:
    return [
        RunConfiguration(f"{i}", {"striker": striker, "tank_pressure": 1e5 * (1 + (5 * i) % CELLS)})
        for i, striker in enumerate(strikers)
    ]


def sentences(
    order: np.ndarray,
    configurations: list[RunConfiguration],
    *,
    drifted: float = 0.0,
    striker: float = 0.0,
    repetition: float = 0.0,
    seed: int = 0,
) -> tuple[str, ...]:
    """Of residuals that change by `drifted` over the campaign, by `striker` from one striker to the
    next, and by `repetition` from a setting's first run to its last; `order` (R,) are places of the
    runs, setting by setting."""
    rng = np.random.default_rng(seed)
    of = np.repeat(np.arange(len(configurations)), order.size // len(configurations))
    kind = np.array(
        [STRIKERS.index(str(configuration.factors["striker"])) for configuration in configurations]
    )
    number = np.argsort(np.argsort(order.reshape(len(configurations), -1), axis=1), axis=1).ravel()
    gap = (
        drifted * order / max(1, order.max())
        + striker * kind[of]
        + repetition * number / max(1, number.max())
    )
    residual = gap + 0.004 * rng.standard_normal(order.size)
    return drift(
        residual[:, None], of, order, VELOCITY, rng, permutations=199, configurations=configurations
    )


IN_BLOCKS = settings([STRIKERS[i // 4] for i in range(CELLS)])
MIXED = settings([STRIKERS[i % 3] for i in range(CELLS)])
IN_A_ROW = np.arange(CELLS * REPEATS)


def shuffled(seed: int) -> np.ndarray:
    return np.random.default_rng([1, seed]).permutation(CELLS * REPEATS)


@pytest.mark.parametrize("configurations", [IN_BLOCKS, MIXED], ids=["blocks", "mixed"])
def test_shuffled_runs_tell_a_drift_and_steady_runs_nothing(
    configurations: list[RunConfiguration],
) -> None:
    (sentence,) = sentences(shuffled(0), configurations, drifted=0.04, striker=0.1)
    assert sentence.startswith(
        "gun: measured less simulated ln_velocity rises by 0.04 from the first run to the last"
    )
    assert "cannot be told apart" not in sentence
    assert sum(bool(sentences(IN_A_ROW, configurations, seed=seed)) for seed in range(20)) <= 4


def test_a_striker_makes_no_drift_of_shuffled_runs() -> None:
    assert (
        sum(
            bool(sentences(shuffled(seed), IN_BLOCKS, striker=0.1, seed=seed)) for seed in range(20)
        )
        <= 3
    )
    # Trettel's shots: five pressures in rising order, 14 or 15 shots each, whose gap falls with the
    # pressure.
    counts, gap = np.array([14, 15, 15, 15, 15]), np.array([-1.25, -0.99, -0.92, -0.92, -0.81])
    settings = [
        RunConfiguration(str(i), {"tank_pressure": p})
        for i, p in enumerate((207e3, 276e3, 345e3, 414e3, 483e3))
    ]
    of, rng = np.repeat(np.arange(5), counts), np.random.default_rng(0)
    residual = gap[of] + 0.05 * rng.standard_normal(of.size)
    *_, sentence = drift(
        residual[:, None], of, np.arange(of.size), VELOCITY, rng, configurations=settings
    )
    assert "order of runs and tank_pressure_bar cannot be told apart" in sentence


def test_a_factor_that_was_run_in_blocks_is_named_beside_the_order() -> None:
    # Its levels explain what the order explains.
    (sentence,) = sentences(IN_A_ROW, IN_BLOCKS, striker=0.02)
    assert "order of runs and striker cannot be told apart" in sentence
    assert "tank_pressure" not in sentence
    *_, sentence = sentences(IN_A_ROW, IN_BLOCKS, drifted=0.2)
    assert sentence.endswith("from the first run to the last (p = 0.005)")
    (sentence,) = sentences(IN_A_ROW, MIXED, drifted=0.05)
    assert sentence.startswith("gun: measured less simulated ln_velocity rises by 0.0")
    assert "cannot be told apart" not in sentence


@pytest.mark.parametrize(("count", "repeats"), [(CELLS, REPEATS), (5, 15), (7, 1)])
def test_a_number_that_rises_with_the_order_is_named_beside_it(count: int, repeats: int) -> None:
    rising = [
        RunConfiguration(str(i), {"striker": "254 mm", "tank_pressure": 1e5 * (1 + i)})
        for i in range(count)
    ]
    *_, sentence = sentences(np.arange(count * repeats), rising, drifted=0.15)
    assert "order of runs and tank_pressure_bar cannot be told apart" in sentence


def test_repetitions_in_a_row_are_no_drift() -> None:
    # Three shots in a row that rise by 0.03 would be a drift of 0.5 over the campaign.
    (sentence,) = sentences(IN_A_ROW, MIXED, repetition=0.03)
    assert "rises by 0.03 from a setting's first repetition to its last" in sentence
    (sentence,) = sentences(np.arange(CELLS), MIXED, drifted=0.06)
    assert "from the first run to the last" in sentence


@pytest.mark.parametrize("count", [1, 4])
def test_few_settings_without_repetitions_tell_nothing(count: int) -> None:
    assert sentences(np.arange(count), MIXED[:count], drifted=0.1) == ()
