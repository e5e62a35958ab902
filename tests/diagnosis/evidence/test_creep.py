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
from pyroshock.diagnosis.gap import GapTable, means
from pyroshock.diagnosis.noise import Noise
from pyroshock.diagnosis.record import CampaignRecord, Configuration, Run
from pyroshock.diagnosis.stages.base import Observable
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


def by_hand(of: list[int], order: list[int], residuals: np.ndarray, noise: np.ndarray) -> GapTable:
    """A gap table of runs of these configurations, at these places in the order; tolerances 1, 2, ..."""
    runs = tuple(Run(c, i, 1, o) for i, (c, o) in enumerate(zip(of, order, strict=True)))
    cells = tuple(Configuration(str(c), {"place": float(c)}) for c in range(max(of) + 1))
    mean, count = means(residuals, np.array(of), len(cells))
    d = residuals.shape[1]
    return GapTable(
        CampaignRecord("by hand", "gun", cells, runs),
        tuple(Observable(f"o{i}", "gun", "velocity", "1", 1.0 + i, 0.1) for i in range(d)),
        residuals,
        mean,
        count,
        Noise(noise, np.full(d, 5.0)),
        np.zeros((0, len(cells), d)),
        np.arange(len(cells)),
        {"gun": np.zeros(len(cells))},
    )


def gappy() -> GapTable:
    """Five configurations, one of a single run and one of which nothing is known; the last run has no channel left."""
    rng = np.random.default_rng(11)
    of = [0, 1, 0, 2, 1, 2, 0, 3, 1, 2, 2, 4, 0]
    order = [3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 23]
    residuals = rng.standard_normal((len(of), 4))
    residuals[[0, 4, 5], [1, 1, 2]] = np.nan
    residuals[[1, 4, 8], 2] = np.nan  # a configuration without this observable
    residuals[[11, 12]] = np.nan
    residuals[:, 3] = np.where(np.arange(len(of)) < 2, residuals[:, 3], np.nan)  # never repeated
    root = rng.standard_normal((4, 6))
    return by_hand(of, order, residuals, 0.1 * root @ root.T)


def test_slope_is_the_regression_with_a_mean_for_each_configuration() -> None:
    gap = gappy()
    creep = Creep.of(gap)
    assert creep.columns.tolist() == [0, 1, 2]
    time = np.array([(run.order - 3) / 20 for run in gap.record.runs])
    power = []
    for column, slope in zip(creep.columns, creep.slope, strict=True):
        known = np.isfinite(gap.residuals[:, column])
        dummies = np.eye(5)[gap.record.configuration_of[known]]
        design = np.column_stack([time[known], dummies])
        found = np.linalg.lstsq(design, gap.residuals[known, column], rcond=None)[0]
        assert slope == pytest.approx(found[0] / (1 + column))
        off = time[known] - dummies @ np.linalg.lstsq(dummies, time[known], rcond=None)[0]
        power.append(float(off @ off))
    assert max(power) < 1.0  # far less than a long campaign has
    covariance = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            one = gap.noise.covariance[i, j] / (1 + i) / (1 + j)
            alike = gap.noise.covariance[i, j] / np.sqrt(gap.noise.covariance[i, i] * gap.noise.covariance[j, j])
            covariance[i, j] = one / np.sqrt(power[i] * power[j]) + 0.3**2 * alike + 0.02 * (i == j)
    np.testing.assert_allclose(creep.noise.lower @ creep.noise.lower.T, covariance, rtol=1e-9)
    assert creep.whitened @ creep.whitened == pytest.approx(creep.slope @ np.linalg.solve(covariance, creep.slope))


def kernel_of(gap: GapTable, rows: list[int], least: float = 0.0) -> tuple[np.ndarray, int]:
    """(2C, 2C) of means and shares of the slope, run by run, and how many components are worth a thousandth."""
    runs = [
        (run.configuration, (run.order - min(r.order for r in gap.record.runs)))
        for i, run in enumerate(gap.record.runs)
        if run.configuration in rows and np.isfinite(gap.residuals[i]).any()
    ]
    span = np.ptp([run.order for run in gap.record.runs])
    weights = np.zeros((2 * len(rows), len(runs)))
    for place, row in enumerate(rows):
        own = [i for i, (c, _) in enumerate(runs) if c == row]
        for i in own:
            weights[place, i] = 1 / len(own)
            weights[len(rows) + place, i] = (runs[i][1] - np.mean([runs[j][1] for j in own])) / span
    weights[len(rows) :] /= max((weights[len(rows) :] ** 2).sum(), least)
    kernel = np.array([[0.5 + 0.5 * np.exp(-((a - b) ** 2) / span**2 / 0.32) for _, b in runs] for _, a in runs])
    found = weights @ kernel @ weights.T
    values = np.linalg.eigvalsh(found)
    return found, int((values > 1e-3 * values.max()).sum())


@pytest.mark.parametrize("rows", [[0, 1, 2, 3, 4], [0, 2, 4], [1, 3]])
def test_a_drift_is_averaged_and_regressed_over_the_runs_that_were_made(rows: list[int]) -> None:
    """But for components that are worth less than a thousandth of the largest."""
    gap = gappy()
    creep = Creep.of(gap.only(np.array(rows)))
    expected, kept = kernel_of(gap, rows)
    root = np.concatenate([creep.means, creep.within])
    assert root.shape == (2 * len(rows), kept)
    left = np.linalg.eigvalsh(expected - root @ root.T)
    largest = np.linalg.eigvalsh(expected).max()
    assert left.min() > -1e-9 * largest
    assert left.max() < 1e-3 * largest


def test_where_repetitions_hardly_differ_in_time_a_drift_adds_little_to_their_slope() -> None:
    """Divided by what would just be enough to say anything, not by next to nothing."""
    of, order = [0, 0, 1, 1], [0, 1, 19, 20]
    gap = by_hand(of, order, np.random.default_rng(1).standard_normal((4, 1)), np.eye(1))
    creep = Creep.of(gap)
    assert creep.columns.size == 0
    expected, _ = kernel_of(gap, [0, 1], least=0.05)
    root = np.concatenate([creep.means, creep.within])
    np.testing.assert_allclose(root @ root.T, expected, atol=1e-3 * np.linalg.eigvalsh(expected).max())


def test_two_runs_of_one_configuration_slope_by_their_difference() -> None:
    creep = Creep.of(by_hand([0, 0], [7, 8], np.array([[0.4], [1.0]]), np.eye(1)))
    assert creep.slope == pytest.approx([0.6])
    assert (creep.means**2).sum() == pytest.approx(0.75 + 0.25 * np.exp(-3.125), rel=1e-3)


def test_one_run_says_nothing_of_a_drift() -> None:
    creep = Creep.of(by_hand([0], [5], np.array([[0.4]]), np.eye(1)))
    assert creep.columns.size == creep.slope.size == 0
    assert creep.means.tolist() == [[1.0]]
    assert creep.within.tolist() == [[0.0]]
