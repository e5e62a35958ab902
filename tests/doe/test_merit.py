"""Figures of a design against closed forms, a full factorial, and what is quoted for Table A.1."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray
from pyroshock.doe.designs.lhs import balance_levels
from pyroshock.doe.merit import FIGURES, compare, quality
from pyroshock.doe.merit.pair_matrix import level_labels, pair_matrix
from pyroshock.doe.merit.space_filling import (
    axis_centres,
    beyond_one,
    cell_counts,
    d_efficiency,
    d_efficiency_limit,
    discrepancy,
    fewest_differences,
    largest_correlation,
    main_effects,
    minimum_distance,
    rms_deviation,
    worst_deviation,
)
from pyroshock.doe.space import gun_space, hammer_space

GUN, HAMMER = gun_space(), hammer_space()
SIZES = [axis.size for axis in GUN.axes]

designs = hnp.arrays(
    np.int64, st.tuples(st.integers(1, 12), st.just(3)), elements=st.integers(0, 1)
)


def _every(*sizes: int) -> NDArray[np.int64]:
    return np.indices(sizes).reshape(len(sizes), -1).T.astype(np.int64)


def test_full_factorial_is_perfect_and_table_a1_has_its_quoted_figures(thesis_tables: Path) -> None:
    plan_quality = quality(GUN, GUN.all_treatments())
    assert (plan_quality.runs, plan_quality.distinct) == (810, 810)
    assert (
        max(
            plan_quality.worst_level,
            plan_quality.worst_pair,
            plan_quality.worst_triple,
            plan_quality.rms_triple,
        )
        < 1e-9
    )
    assert plan_quality.largest_correlation == pytest.approx(0.0, abs=1e-12)
    assert plan_quality.d_efficiency == pytest.approx(plan_quality.d_efficiency_limit, rel=1e-12)
    assert (plan_quality.uneven_triples, plan_quality.fewest_differences) == (0, 1)
    counts = quality(HAMMER, HAMMER.all_treatments()).level_counts
    assert counts["anvil_material+insulator"]["steel/polymeric"] == 180 // 5
    assert counts["tip_material+tip_radius"] == {
        "aluminum/30": 60,
        "delrin/30": 60,
        "polyurethane/15": 60,
    }
    with (thesis_tables / "table_a1_lhs_105_runs.csv").open(newline="") as handle:
        plan_quality = quality(GUN, GUN.treatments(list(csv.DictReader(handle))))
    assert (plan_quality.runs, plan_quality.distinct, plan_quality.worst_pair) == (105, 98, 11.5)
    assert round(plan_quality.centred_discrepancy, 3) == 0.114
    assert round(plan_quality.wrap_around_discrepancy, 3) == 0.597
    assert round(plan_quality.d_efficiency, 3) == 0.469
    assert plan_quality.changeovers["plate_material"] == 1


def test_deviations_are_from_the_share() -> None:
    runs = np.array([[0, 0, 0], [0, 0, 1], [1, 1, 1]])
    assert cell_counts(runs, [2, 2, 2], (0, 1)).tolist() == [[2, 0], [0, 1]]
    assert worst_deviation(runs, [2, 2, 2], 1) == 0.5
    assert worst_deviation(runs, [2, 2, 2], 2) == 2 - 3 / 4
    assert rms_deviation(runs, [2, 2, 2], 3) == pytest.approx(
        math.sqrt((3 * (5 / 8) ** 2 + 5 * (3 / 8) ** 2) / 8)
    )
    assert beyond_one(runs, [2, 2, 2], 2) == 1
    assert worst_deviation(_every(2, 2), [2, 2], 3) == rms_deviation(_every(2, 2), [2, 2], 3) == 0.0


@given(designs)
def test_renaming_levels_changes_no_balance(runs: NDArray[np.int64]) -> None:
    renamed = np.where([True, False, True], 1 - runs, runs)
    for order in (1, 2, 3):
        assert rms_deviation(renamed, [2, 2, 2], order) == pytest.approx(
            rms_deviation(runs, [2, 2, 2], order)
        )
    assert largest_correlation(renamed, [2, 2, 2]) == pytest.approx(
        largest_correlation(runs, [2, 2, 2]), abs=1e-9
    )


def test_correlation_of_two_levels_is_pearson() -> None:
    rng = np.random.default_rng(4)
    runs = rng.integers(2, size=(30, 2))
    expected = abs(float(np.corrcoef(runs.T)[0, 1]))
    assert largest_correlation(runs, [2, 2]) == pytest.approx(expected, rel=1e-9)
    # Also where the order of the levels hides it from Pearson.
    runs = np.array([[0, 1], [1, 0], [2, 2]] * 4)
    assert largest_correlation(runs, [3, 3]) == pytest.approx(1.0)
    assert largest_correlation(np.array([[0, 0], [0, 1], [0, 1]]), [2, 2]) == pytest.approx(
        0.0, abs=1e-12
    )


@pytest.mark.parametrize("sizes", [(2, 2), (3, 2), (5, 3, 2), (4, 1, 3)])
def test_d_efficiency_limit_is_that_of_a_factorial(sizes: tuple[int, ...]) -> None:
    assert d_efficiency(_every(*sizes), sizes) == pytest.approx(
        d_efficiency_limit(sizes), rel=1e-12
    )


def test_d_efficiency_and_discrepancies_have_closed_forms() -> None:
    assert d_efficiency_limit([2, 2, 2]) == pytest.approx(1.0)
    assert d_efficiency(np.array([[0, 0], [0, 1], [0, 2]]), [2, 3]) == 0.0
    assert d_efficiency(_every(2, 3)[:2], [2, 3]) == 0.0
    assert main_effects(np.array([[0], [1], [2]]), [3]).tolist() == [
        [1, 1, 0],
        [1, 0, 1],
        [1, -1, -1],
    ]
    # Hickernell's sums at x = 1/2 in d axes: (13/12)^d - 2 + 1, and -(4/3)^d + (3/2)^d.
    point = np.full((1, 3), 0.5)
    assert discrepancy(point, "CD") == pytest.approx((13 / 12) ** 3 - 1)
    assert discrepancy(point, "WD") == pytest.approx(1.5**3 - (4 / 3) ** 3)
    with pytest.raises(ValueError, match="'L2'; expected CD or WD"):
        discrepancy(np.full((1, 2), 0.5), "L2")


def test_nearest_runs_set_the_distances() -> None:
    runs = np.array([[0, 0], [1, 1], [1, 2]])
    points = np.stack([(runs[:, 0] + 0.5) / 2, (runs[:, 1] + 0.5) / 3], axis=1)
    assert minimum_distance(points) == pytest.approx(1 / 3)
    assert fewest_differences(runs) == 1
    found = quality(GUN, GUN.all_treatments()[:1])
    assert found.minimum_distance == math.inf
    assert (found.distinct, found.fewest_differences, found.d_efficiency) == (1, 6, 0.0)
    with pytest.raises(ValueError, match="no run"):
        quality(GUN, np.zeros((0, 6), dtype=np.int64))


def test_places_are_centres_of_equal_cells() -> None:
    for axis, places in zip(GUN.axes, axis_centres(GUN), strict=True):
        assert sorted(places) == pytest.approx([(k + 0.5) / axis.size for k in range(axis.size)])
    axis, places = GUN.axes[1], axis_centres(GUN)[1]
    assert [axis.labels[k] for k in np.argsort(places)] == [
        "none/none", "aluminum/none", "steel/none", "aluminum/polymeric", "steel/polymeric",
    ]  # fmt: skip


def test_compare_names_the_better_of_two_and_the_matrix_their_pairs() -> None:
    every = GUN.all_treatments()
    rows = {row.figure: row for row in compare(quality(GUN, every), quality(GUN, every[:100]))}
    assert (rows["runs"].a, rows["runs"].b, rows["runs"].better) == ("810", "100", "")
    assert rows["worst pair from its share"].better == rows["D-efficiency"].better == "a"
    assert rows["changeovers, velocity_level"].better == "b"
    assert len(rows) == len(FIGURES) + len(GUN.factors)
    compared = compare(quality(GUN, every), quality(HAMMER, HAMMER.all_treatments()))
    (speed,) = [row for row in compared if row.figure == "changeovers, hammer_speed"]
    assert (speed.a, speed.better) == ("", "")
    pairs = pair_matrix(GUN, every[:405])  # the first plate only
    assert pairs.shape == (sum(SIZES), sum(SIZES))
    assert (pairs[0, 0], pairs[1, 1]) == (1.0, -1.0)  # twice its share, and never
    assert np.isnan(pairs[0, 1])
    np.testing.assert_array_equal(pairs, pairs.T)


def test_design_as_even_as_whole_runs_can_be_is_drawn_white() -> None:
    rows = balance_levels(GUN, 105, np.random.default_rng(1)).treatments
    pairs = pair_matrix(GUN, rows)
    assert np.nanmax(np.abs(pairs)) == 0.0
    assert [label for label in level_labels(GUN) if "radius" in label] == [
        f"tip radius {r} mm" for r in (30, 45, 60)
    ]
    drawn = np.random.default_rng(0).integers(0, SIZES, (105, len(SIZES)))
    assert np.nanmax(np.abs(pair_matrix(GUN, drawn))) > 0.5
