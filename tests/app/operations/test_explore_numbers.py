"""The numbers of an exploration against NumPy, SciPy and printed examples; and that thinning loses
no row."""

from __future__ import annotations

import statistics

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pyroshock.app.operations.explore.columns import NO_VALUE, OTHERS, Column, groups_of
from pyroshock.app.operations.explore.control import BEYOND, ONE_SIDE, RUN, control_chart
from pyroshock.app.operations.explore.correlation import average_ranks, rank_correlation
from pyroshock.app.operations.explore.distribution import (
    FEWEST_CELLS,
    MOST_CELLS,
    histogram_edges,
    summary_of,
)
from pyroshock.app.operations.explore.thinning import (
    MOST_POINTS,
    thin_line,
    thin_outliers,
    thin_scatter,
)
from scipy import stats

NUMBERS = st.floats(-1e6, 1e6, allow_nan=False, width=32)


def samples(least: int, most: int = 60) -> st.SearchStrategy:
    """Values (n,) with ties among them."""
    return arrays(
        np.float64, st.integers(least, most), elements=st.one_of(NUMBERS, st.integers(-3, 3))
    )


# --- correlation


@given(samples(1))
def test_ranks_are_those_of_scipy(values):
    np.testing.assert_allclose(average_ranks(values), stats.rankdata(values))


@given(st.integers(3, 60).flatmap(lambda n: st.tuples(samples(n, n), samples(n, n))))
def test_correlation_is_that_of_scipy(pair):
    x, y = pair
    correlation = rank_correlation(x, y, x.size)
    if np.ptp(x) == 0 or np.ptp(y) == 0:
        assert np.isnan(correlation.coefficient)
        return
    assert correlation.coefficient == pytest.approx(stats.spearmanr(x, y).statistic, abs=1e-9)


def test_interval_holds_the_correlation_as_often_as_it_says():
    """Of a normal distribution Spearman's coefficient is 6/pi asin(r/2) (Kendall and Gibbons)."""
    rng, runs, repeats, r = np.random.default_rng(5), 40, 600, 0.6
    truth = 6 / np.pi * np.arcsin(r / 2)
    held = 0
    for _ in range(repeats):
        x = rng.normal(size=runs)
        y = r * x + np.sqrt(1 - r**2) * rng.normal(size=runs)
        correlation = rank_correlation(x, y, runs)
        held += correlation.low <= truth <= correlation.high
    assert 0.925 < held / repeats < 0.975


def test_repeated_hits_establish_no_trend_that_runs_do_not():
    """Ten hits of each of twelve runs, whose means have no trend: counted as independent rows they
    would show one half of the time."""
    rng, runs, hits, repeats = np.random.default_rng(6), 12, 10, 400
    by_runs = by_rows = 0
    for _ in range(repeats):
        x = np.repeat(rng.normal(size=runs), hits)
        y = np.repeat(rng.normal(size=runs), hits) + 0.05 * rng.normal(size=runs * hits)
        by_runs += rank_correlation(x, y, runs).is_established
        by_rows += rank_correlation(x, y, runs * hits).is_established
    assert by_runs / repeats < 0.09
    assert by_rows / repeats > 0.3


@pytest.mark.parametrize("independent", [0, 1, 3])
def test_few_runs_have_no_interval(independent):
    x = np.arange(9.0)
    correlation = rank_correlation(x, x**2, independent)
    assert correlation.coefficient == pytest.approx(1.0)
    assert not correlation.is_established and np.isnan(correlation.low)


# --- distribution


@given(samples(1))
def test_quantiles_are_those_of_numpy_in_order(values):
    summary = summary_of("all", values)
    expected = np.percentile(values, [0, 5, 25, 50, 75, 95, 100], method="linear")
    stated = [summary.minimum, summary.q05, summary.q25, summary.median]
    stated += [summary.q75, summary.q95, summary.maximum]
    np.testing.assert_allclose(stated, expected)
    assert summary.count == values.size
    assert summary.mean == pytest.approx(np.mean(values), abs=1e-6)
    if values.size > 1:
        assert summary.deviation == pytest.approx(statistics.stdev(values), abs=1e-6)


@given(samples(1, 300), st.booleans())
def test_a_histogram_counts_every_value(values, logarithmic):
    values = np.abs(values) + 1e-3 if logarithmic else values
    edges = histogram_edges(values, logarithmic=logarithmic)
    assert np.all(np.diff(edges) > 0)
    assert np.histogram(values, edges)[0].sum() == values.size
    assert edges.size - 1 == 1 or FEWEST_CELLS <= edges.size - 1 <= MOST_CELLS


def test_cells_are_as_wide_as_the_rule_of_freedman_and_diaconis_has_them():
    values = np.random.default_rng(1).normal(size=4000)
    edges = histogram_edges(values)
    first, third = np.quantile(values, [0.25, 0.75])
    width = 2 * (third - first) / 4000 ** (1 / 3)
    cells = int(np.ceil(np.ptp(values) / width))
    assert edges.size - 1 == cells
    assert np.diff(edges)[0] == pytest.approx(np.ptp(values) / cells)


# --- control chart

#: NIST/SEMATECH e-Handbook of Statistical Methods, section 6.3.2.2: flow rates of ten batches, with
#: the mean moving range 1.8778, centre line 50.81 and limits 55.8041 and 45.8159 (from 3/1.128,
#: which is 2.6596).
NIST = np.array([49.6, 47.6, 49.9, 51.3, 47.8, 51.2, 52.6, 52.4, 53.6, 52.1])


def test_limits_are_those_of_the_printed_example():
    chart = control_chart(NIST)
    assert chart.mean_range == pytest.approx(1.8778, abs=5e-5)
    assert chart.centre == pytest.approx(50.81, abs=5e-3)
    assert chart.upper == pytest.approx(55.8041, abs=1e-3)
    assert chart.lower == pytest.approx(45.8159, abs=1e-3)
    assert not chart.rules_broken(200)


def test_a_point_beyond_a_limit_and_its_range_are_named():
    values = np.tile([10.0, 10.2, 9.9, 10.1], 10)
    values[20] = 14.0
    chart = control_chart(values)
    assert chart.beyond.tolist() == [20]
    assert chart.range_beyond.tolist() == [20, 21]
    assert BEYOND in chart.rules_broken(200)[20]


@pytest.mark.parametrize("run", [7, 8, 11])
def test_eight_in_a_row_on_one_side_are_named_from_the_eighth_on(run):
    side = np.array([1.0, -1.0] * 6 + [1.0] * run + [-1.0] * 3)
    values = side * np.linspace(1, 1.2, side.size)
    chart = control_chart(values)
    signs = np.sign(values - values.mean())
    assert signs[12 : 12 + run].min() == 1 and signs[11] == -1
    expected = [12 + i for i in range(RUN - 1, run)]
    assert chart.one_side.tolist() == expected
    assert all(
        ONE_SIDE in rules for place, rules in chart.rules_broken(200).items() if place in expected
    )


def test_points_beyond_a_limit_are_named_before_those_on_one_side():
    values = np.concatenate([np.zeros(100), np.ones(100)]) + np.tile([0.4, -0.4], 100)
    values[150] = 9.0
    chart = control_chart(values)
    few = chart.rules_broken(3)
    assert 150 in few and BEYOND in few[150] and len(few) == 3
    assert chart.broken == len(chart.rules_broken(10_000)) > 100


@given(samples(2))
def test_limits_lie_about_the_mean_and_every_value_beyond_is_named(values):
    chart = control_chart(values)
    assert chart.lower <= chart.centre <= chart.upper
    assert chart.upper - chart.centre == pytest.approx(2.66 * np.abs(np.diff(values)).mean())
    beyond = [i for i, value in enumerate(values) if not chart.lower <= value <= chart.upper]
    assert chart.beyond.tolist() == beyond


def test_one_value_has_no_control_chart():
    with pytest.raises(ValueError, match="there are 1 values; expected 2 or more"):
        control_chart(np.array([1.0]))


# --- thinning


@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.sampled_from([40, 400, 4000]))
def test_every_row_is_a_point_or_counted_in_a_cell(seed, groups, most):
    rng = np.random.default_rng(seed)
    x = np.concatenate([rng.normal(size=6000), rng.uniform(-40, 40, 12)])
    y = np.concatenate([rng.normal(size=6000), rng.uniform(-40, 40, 12)])
    group = rng.integers(0, groups, x.size)
    thinned = thin_scatter(x, y, group, most)
    drawn = np.zeros(x.size, dtype=bool)
    drawn[thinned.points] = True
    assert thinned.points.size + thinned.cells.count.sum() == x.size
    counts = np.bincount(thinned.cells.group, weights=thinned.cells.count, minlength=groups)
    np.testing.assert_array_equal(counts, np.bincount(group[~drawn], minlength=groups))
    # the mean place of all marks is that of all rows
    total = x[drawn].sum() + (thinned.cells.x * thinned.cells.count).sum()
    assert total == pytest.approx(x.sum(), abs=1e-6)
    for number in range(groups):
        own = np.flatnonzero(group == number)
        for values in (x, y):
            assert drawn[own[values[own].argmin()]] and drawn[own[values[own].argmax()]]


def test_a_lonely_point_is_drawn_whatever_else_there_is():
    rng = np.random.default_rng(3)
    x, y = rng.normal(size=(2, 100_000))
    lonely = np.array([[6.0, -6.0], [-7.0, 5.0], [0.0, 8.0]])
    x[:3], y[:3] = lonely.T
    thinned = thin_scatter(x, y, np.zeros(x.size, dtype=np.intp))
    assert {0, 1, 2} <= set(thinned.points.tolist())
    assert thinned.points.size <= MOST_POINTS + 4
    assert thinned.cells.count.size < 3000


def test_few_points_are_all_drawn():
    x = np.arange(50.0)
    thinned = thin_scatter(x, x, np.zeros(50, dtype=np.intp))
    assert thinned.points.tolist() == list(range(50)) and not thinned.cells.count.size


@given(arrays(np.float64, st.integers(1, 5000), elements=NUMBERS))
def test_a_thinned_line_keeps_both_ends_of_the_values(values):
    places = thin_line(values, 100)
    assert places.size <= max(102, min(values.size, 100))
    assert np.all(np.diff(places) > 0)
    drawn_values = values[places]
    assert (drawn_values.min(), drawn_values.max()) == (values.min(), values.max())
    furthest = values[thin_outliers(values, 10)]
    assert {values.min(), values.max()} & set(furthest.tolist())


# --- groups


def test_words_that_read_as_numbers_stay_words():
    assert Column("campaign", ["2024", "2025"]).numbers is None
    assert Column("campaign", ["2024", "2025"]).filled().all()
    assert Column("insulator", [0.002, "none"]).numbers is None


def test_few_values_are_groups_of_their_own_and_missing_ones_another():
    groups = groups_of(Column("tip_radius_m", [0.03, None, 0.06, 0.03]))
    assert groups.names == ("30 mm", "60 mm", NO_VALUE)
    assert groups.number.tolist() == [0, 2, 1, 0]


def test_many_numbers_are_five_ranges_of_equally_many_rows():
    values = [*np.random.default_rng(2).permutation(np.linspace(1000, 3000, 1000)).tolist(), None]
    groups = groups_of(Column("peak_force_n", values))
    assert groups.ordered and groups.names[0] == "1 to 1.4 kN" and groups.names[-1] == NO_VALUE
    assert np.bincount(groups.number).tolist() == [200] * 5 + [1]
    means = [
        np.mean([v for v, g in zip(values, groups.number, strict=True) if g == i]) for i in range(5)
    ]
    assert means == sorted(means)


def test_many_words_are_the_most_frequent_and_the_others():
    values = [f"word {i}" for i in range(12) for _ in range(20 - i)]
    groups = groups_of(Column("campaign", values))
    assert groups.names == (*(f"word {i}" for i in range(7)), OTHERS)
    assert np.bincount(groups.number).tolist() == [
        20,
        19,
        18,
        17,
        16,
        15,
        14,
        13 + 12 + 11 + 10 + 9,
    ]
