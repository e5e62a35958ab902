"""What no effect explains: whether there is something, how it spreads over the configurations, and
drifts."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.inference.problem import InferenceProblem, StageBlock
from pyroshock.diagnosis.inference.subset_fit import no_effects
from pyroshock.diagnosis.inference.unexplained_gap import (
    RunOrderDrift,
    UnexplainedEvidence,
    configuration_patterns,
    factor_levels,
    unexplained_evidence,
)
from scipy.stats import multivariate_normal
from support.records.linear_problems import LinearSimulator, gap_of

FACTORS = [
    {"pressure": p, "tip": tip, "mass": m}
    for p, tip, m in itertools.product((1.0, 2.0, 3.0), ("steel", "delrin", "brass"), (0.25, 1.0))
]
COUNT, REPETITIONS, SCATTER = len(FACTORS), 3, 0.3


def evidence_of(
    gap: np.ndarray, *, drift: float = 0.0, seed: int = 0, columns: int = 1
) -> UnexplainedEvidence:
    """Beside no effects, of a gap (C,) in tolerances and a drift from the first to the last run."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(np.tile(np.arange(COUNT), REPETITIONS))
    time = np.linspace(0, 1, order.size)
    residuals = (gap[order] + drift * (time - 0.5))[:, None] + SCATTER * rng.standard_normal(
        (order.size, columns)
    )
    table = gap_of(residuals, order, FACTORS, SCATTER)
    return _beside_nothing(table)


def _beside_nothing(table: GapTable) -> UnexplainedEvidence:
    block = StageBlock.of(table, "gun")
    simulator = LinearSimulator({}, (COUNT, len(table.observables)))
    problem = InferenceProblem(table, (block,), simulator, ())
    return unexplained_evidence(table, (block,), no_effects(problem), RunOrderDrift.of(table))


def where(**wanted) -> np.ndarray:
    return np.array(
        [all(row[name] == value for name, value in wanted.items()) for row in FACTORS], dtype=float
    )


@pytest.mark.parametrize(
    ("rule", "inside"),
    [
        ("tip = delrin", {"tip": "delrin"}),
        ("mass = 1.0", {"mass": 1.0}),
        ("pressure = 2.0", {"pressure": 2.0}),
    ],
)
def test_gap_of_one_level_is_named_by_its_rule(rule: str, inside: dict):
    evidence = evidence_of(8.0 * where(**inside))
    names = {
        name for name, rows in factor_levels(FACTORS) if np.array_equal(rows, where(**inside) > 0)
    }
    assert evidence.pattern in names | {rule}
    assert evidence.stage == "gun"
    assert evidence.gain > 10


def test_gap_is_named_alike_everywhere_or_without_order():
    assert evidence_of(8.0 * np.ones(COUNT)).pattern == "all configurations alike"
    evidence = evidence_of(8.0 * np.random.default_rng(3).standard_normal(COUNT))
    assert evidence.pattern == "from configuration to configuration"
    assert evidence.gain > 10
    gains = [evidence_of(size * where(tip="delrin")).gain for size in (0.0, 2.0, 5.0, 15.0)]
    assert gains == sorted(gains)


@pytest.mark.parametrize("seed", range(3))
def test_noise_has_no_gain_and_a_planted_drift_is_over_the_order_of_runs(seed: int):
    assert evidence_of(np.zeros(COUNT), seed=seed).gain < 0
    still, drifting = (evidence_of(np.zeros(COUNT), drift=size, seed=seed) for size in (0.0, 9.0))
    assert drifting.pattern == "over the order of runs"
    assert drifting.gain > max(10.0, still.gain)


def test_rules_hold_for_two_configurations_and_leave_two():
    factors = [
        {"tip": tip, "run": float(i)}
        for i, tip in enumerate(["steel"] * 3 + ["delrin"] * 2 + ["brass"])
    ]
    rules = dict(factor_levels(factors))
    assert set(rules) == {"tip = steel", "tip = delrin"}
    assert rules["tip = delrin"].tolist() == [False, False, False, True, True, False]
    together = [
        {"operator": name, "tip": tip}
        for name, tip in [("a", "x"), ("a", "x"), ("b", "y"), ("b", "y")]
    ]
    assert len(factor_levels(together)) == 2


def test_patterns_have_variance_one_where_they_act():
    rng = np.random.default_rng(1)
    order = rng.permutation(np.tile(np.arange(COUNT), REPETITIONS))
    table = gap_of(rng.standard_normal((order.size, 1)), order, FACTORS)
    loudness = {"gun": np.log([row["pressure"] for row in FACTORS])}
    object.__setattr__(table, "loudness", loudness)
    patterns = configuration_patterns(table, "gun", RunOrderDrift.of(table))
    assert len({pattern.name for pattern in patterns}) == len(patterns)
    for pattern in patterns:
        variance = np.diag(pattern.covariance)
        np.testing.assert_allclose(pattern.covariance, pattern.covariance.T)
        if not pattern.drift:
            assert variance[variance > 0].mean() == pytest.approx(1.0)
    order = np.arange(COUNT)
    table = gap_of(np.zeros((COUNT, 1)), order, FACTORS)
    object.__setattr__(table, "loudness", {"gun": np.linspace(0, 1, COUNT)})
    by_name = {
        p.name: p.covariance for p in configuration_patterns(table, "gun", RunOrderDrift.of(table))
    }
    for share in (0.25, 0.5, 0.75):
        acting = np.diag(by_name[f"beyond the quantile {share:g} of how hard runs are"]) > 0
        assert acting.sum() == np.sum(np.linspace(0, 1, COUNT) > share + 1e-6)


PLACE_COUNT, SHOTS_PER_PLACE, SCATTER = 10, 4, 0.3
PLACES = [{"place": float(c)} for c in range(PLACE_COUNT)]
AMPLITUDES = (1.5, 4.0, 10.0)


def drift_of(size: float, seed: int = 0, columns: int = 1, shuffled: bool = True) -> RunOrderDrift:
    """Of a campaign that drifts by `size` tolerances from its first run to its last, in all its
    observables."""
    rng = np.random.default_rng(seed)
    runs = PLACE_COUNT * SHOTS_PER_PLACE
    order = (
        rng.permutation(np.tile(np.arange(PLACE_COUNT), SHOTS_PER_PLACE))
        if shuffled
        else np.arange(runs) // SHOTS_PER_PLACE
    )
    time = np.linspace(0, 1, runs)
    residuals = size * time[:, None] + SCATTER * rng.standard_normal((runs, columns))
    return RunOrderDrift.of(gap_of(residuals, order, PLACES, SCATTER))


@pytest.mark.parametrize("size", [-6.0, 0.0, 3.0])
def test_slope_is_that_of_the_drift(size: float):
    drift = drift_of(size)
    assert drift.slope[0] == pytest.approx(size, abs=3 * np.sqrt(drift.noise[0, 0]))


def test_slope_is_the_regression_with_a_mean_for_each_configuration():
    rng = np.random.default_rng(5)
    order = np.array([0, 1, 0, 2, 1, 2, 0, 1, 2, 2])
    residuals = rng.standard_normal((10, 2))
    drift = RunOrderDrift.of(gap_of(residuals, order, PLACES[:3]))
    design = np.column_stack([np.linspace(0, 1, 10), np.eye(3)[order]])
    np.testing.assert_allclose(drift.slope, np.linalg.lstsq(design, residuals, rcond=None)[0][0])
    # A kernel over the order of runs, half of it the same for all, averaged within configurations.
    order = np.random.default_rng(3).permutation(np.tile(np.arange(PLACE_COUNT), SHOTS_PER_PLACE))
    drift = RunOrderDrift.of(gap_of(np.zeros((order.size, 1)), order, PLACES))
    time = np.linspace(0, 1, order.size)
    kernel = 0.5 + 0.5 * np.exp(-0.5 * (time[:, None] - time[None, :]) ** 2 / 0.4**2)
    share = np.eye(PLACE_COUNT)[order].T / SHOTS_PER_PLACE
    expected = share @ kernel @ share.T
    np.testing.assert_allclose(drift.means @ drift.means.T, expected, atol=2e-3 * expected.max())
    # What drifts lies in the means of the configurations instead.
    drift = drift_of(5.0, shuffled=False)
    assert drift.columns.size == 0
    assert drift.log_gains(AMPLITUDES) == [0.0, 0.0, 0.0]
    assert (drift.means**2).sum(axis=1).mean() == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("seed", range(4))
def test_planted_drift_raises_the_gain_and_noise_lowers_it(seed: int):
    gains = drift_of(5.0, seed).log_gains(AMPLITUDES)
    assert max(gains) > 10
    assert all(gain > 0 for gain in gains)
    assert all(gain < 0 for gain in drift_of(0.0, seed).log_gains(AMPLITUDES))


def test_gain_is_the_logarithm_of_the_ratio_of_two_gaussians():
    """Half of it for a drift of one size in all observables, half for one of its own in each."""
    drift = drift_of(2.0, columns=3)
    free = multivariate_normal(cov=drift.noise).logpdf(drift.slope)
    for size, gain in zip(AMPLITUDES, drift.log_gains(AMPLITUDES), strict=True):
        ratios = [
            multivariate_normal(cov=drift.noise + size**2 * kernel).logpdf(drift.slope) - free
            for kernel in (np.eye(3), np.ones((3, 3)))
        ]
        assert gain == pytest.approx(np.logaddexp(*ratios) - np.log(2))
