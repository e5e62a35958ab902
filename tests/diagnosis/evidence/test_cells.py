"""A gap table as a vector: its covariance, cell by cell."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from pyroshock.diagnosis.evidence.cells import Cells
from pyroshock.diagnosis.gap import GapTable
from support.records.toy_bench import Design, campaign, stages_of


@cache
def gap() -> GapTable:
    """Eight configurations, 0 to 4 repetitions of each cell, two uncertain nominal parameters, correlated noise."""
    rng = np.random.default_rng(4)
    record = campaign([], rng, Design(pressures_bar=(0.5, 4.0), masses_kg=(0.25, 1.0), repetitions=2))
    table = GapTable.of(record, stages_of(record))
    columns = len(table.observables)
    factor = rng.standard_normal((columns, columns))
    count = rng.integers(0, 5, table.count.shape)
    return replace(
        table,
        mean=np.where(count > 0, rng.standard_normal(count.shape), np.nan),
        count=count,
        noise=replace(table.noise, covariance=factor @ factor.T),
        nuisances=rng.standard_normal((2, *count.shape)),
    )


def test_cells_are_those_with_a_mean_by_configuration_then_observable() -> None:
    table, cells = gap(), Cells.of(gap())
    rows, columns = table.count.shape
    expected = [(c, o) for c in range(rows) for o in range(columns) if table.count[c, o] > 0]
    assert {0, 1, 2} <= set(table.count.ravel().tolist())
    assert list(zip(cells.configuration.tolist(), cells.observable.tolist(), strict=True)) == expected
    size = [table.observables[o].tolerance for _, o in expected]
    np.testing.assert_array_equal(cells.tolerance, size)
    np.testing.assert_allclose(cells.z, [table.mean[c, o] / s for (c, o), s in zip(expected, size, strict=True)])


def test_noise_is_of_means_and_of_uncertain_parameters() -> None:
    """Means of n and m runs of one configuration share S / sqrt(n m); of two, only what nominal parameters do."""
    table, cells = gap(), Cells.of(gap())
    where = list(zip(cells.configuration.tolist(), cells.observable.tolist(), strict=True))
    expected = np.zeros((len(where), len(where)))
    for i, (c, o) in enumerate(where):
        for j, (d, p) in enumerate(where):
            scatter = table.noise.covariance[o, p] / np.sqrt(table.count[c, o] * table.count[d, p]) if c == d else 0.0
            doubt = sum(each[c, o] * each[d, p] for each in table.nuisances)
            expected[i, j] = (scatter + doubt) / table.observables[o].tolerance / table.observables[p].tolerance
    np.testing.assert_allclose(cells.noise, expected, rtol=1e-12, atol=1e-9)
    assert np.linalg.eigvalsh(cells.noise).min() > -1e-6 * np.linalg.eigvalsh(cells.noise).max()


def test_variance_of_a_mean_is_that_which_repetitions_leave() -> None:
    table = replace(gap(), nuisances=np.zeros((0, *gap().count.shape)))
    cells = Cells.of(table)
    variance = table.floor_variance[cells.configuration, cells.observable] / cells.tolerance**2
    np.testing.assert_allclose(np.diag(cells.noise), variance)
    apart = cells.configuration[:, None] != cells.configuration
    assert np.all(cells.noise[apart] == 0)


def test_tables_are_taken_as_the_gap_is() -> None:
    cells = Cells.of(gap())
    np.testing.assert_allclose(cells.take(gap().mean), cells.z)
    several = np.stack([gap().mean, 3 * gap().mean])[None]
    np.testing.assert_allclose(cells.take(several), np.stack([cells.z, 3 * cells.z])[None])


@pytest.mark.parametrize("factor", [0.5, 4.0])
def test_wider_tolerances_make_gap_and_scatter_smaller_alike(factor: float) -> None:
    wide = tuple(replace(item, tolerance=item.tolerance * factor) for item in gap().observables)
    plain, wider = Cells.of(gap()), Cells.of(replace(gap(), observables=wide))
    np.testing.assert_allclose(wider.z * factor, plain.z)
    np.testing.assert_allclose(wider.noise * factor**2, plain.noise, rtol=1e-9)
