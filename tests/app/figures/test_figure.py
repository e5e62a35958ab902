"""What a figure as data refuses, masks and tells of itself."""

import numpy as np
import pytest
from pyroshock.app.figures.figure import (
    CATEGORIES,
    BandSeries,
    BarSeries,
    BoxSeries,
    ColourRole,
    HeatMap,
    LineSeries,
    Plot,
    PlotAxis,
    PlotGrid,
    PointSeries,
    ReferenceLine,
    ReferenceRegion,
    StepSeries,
    as_floats,
    category,
    curve_style,
    side_by_side,
)

FORCE, TIME = PlotAxis("force", "kN"), PlotAxis("time", "ms")
LOG_FORCE = PlotAxis("force", "kN", scale="log")
ONE, TWO, THREE = np.zeros(1), np.zeros(2), np.zeros(3)


def test_numbers_are_a_copy_that_cannot_be_written_to_with_gaps_for_none_and_infinity() -> None:
    given = np.array([1.0, 2.0])
    line = LineSeries(given, as_floats([None, np.inf]))
    given[0] = 9.0
    assert line.x.tolist() == [1.0, 2.0] and np.isnan(line.y).all()
    with pytest.raises(ValueError, match="read-only"):
        line.x[0] = 3.0


@pytest.mark.parametrize(
    "make",
    [
        lambda: LineSeries(TWO, THREE, name="curve"),
        lambda: LineSeries(TWO, TWO, labels=("one",), name="curve"),
        lambda: PointSeries(TWO, TWO, y_low=ONE, y_high=TWO, name="curve"),
        lambda: BandSeries(TWO, TWO, ONE, name="curve"),
        lambda: BarSeries(TWO, ONE, name="curve"),
        lambda: StepSeries(TWO, TWO, name="curve"),
        lambda: BoxSeries(TWO, (ONE,), name="curve"),
    ],
)
def test_series_of_different_lengths_are_refused_by_name(make) -> None:
    with pytest.raises(ValueError, match="curve: "):
        make()


def test_an_axis_without_unit_or_categories_is_refused() -> None:
    with pytest.raises(ValueError, match="'force' has no unit"):
        PlotAxis("force")
    assert PlotAxis("share", "1").heading == "share"
    assert FORCE.heading == "force (kN)"
    assert PlotAxis("tip", categories=("PLA",)).heading == "tip"


@pytest.mark.parametrize("limits", [(1.0, 1.0), (2.0, 1.0), (0.0, np.inf)])
def test_an_axis_with_impossible_ends_is_refused(limits) -> None:
    with pytest.raises(ValueError, match="cannot end"):
        PlotAxis("force", "kN", limits=limits)


def test_a_logarithmic_axis_begins_above_zero_and_has_no_categories() -> None:
    with pytest.raises(ValueError, match="cannot begin at"):
        PlotAxis("force", "kN", scale="log", limits=(0.0, 1.0))
    with pytest.raises(ValueError, match="cannot be logarithmic"):
        PlotAxis("tip", categories=("PLA",), scale="log")
    with pytest.raises(ValueError, match="not on a logarithmic axis"):
        Plot("force", TIME, LOG_FORCE, reference_lines=(ReferenceLine("y", 0.0),))


def test_a_logarithmic_axis_has_gaps_where_a_number_is_not_positive() -> None:
    curve = LineSeries(np.array([-1.0, 1.0, 2.0]), np.array([1.0, 0.0, 10.0]))
    plot = Plot("force", TIME, LOG_FORCE, (curve,))
    (masked,) = plot.series
    assert np.isnan(masked.along("y")).tolist() == [False, True, False]
    assert masked.along("x").tolist() == [-1.0, 1.0, 2.0]
    assert 0 < plot.limits("y")[0] < 1.0 and plot.limits("y")[1] > 10.0


@pytest.mark.parametrize("axis", ["x", "y"])
def test_bars_lie_along_the_axis_that_they_are_drawn_along(axis) -> None:
    bars = BarSeries(np.array([0.0, 1.0]), np.array([2.0, 5.0]), width=0.8, horizontal=axis == "x")
    other = "y" if axis == "x" else "x"
    plot = Plot("bars", TIME, FORCE, (bars,))
    assert plot.limits(axis)[0] == 0.0 and plot.limits(axis)[1] > 5.0
    assert bars.along(other).min() == -0.4 and bars.along(other).max() == 1.4


def test_a_point_outside_of_the_categories_is_refused() -> None:
    tips = PlotAxis("tip", categories=("PLA", "PEEK"))
    Plot("force", tips, FORCE, (PointSeries(np.array([1.0]), ONE),))
    with pytest.raises(ValueError, match="2 is not one of the 2 categories of 'tip'"):
        Plot("force", tips, FORCE, (PointSeries(np.array([2.0]), ONE),))


def test_series_of_one_name_share_an_entry_of_the_legend() -> None:
    series = tuple(LineSeries(TWO, TWO, name=name) for name in ("a", "b", "a", ""))
    plot = Plot("t", TIME, FORCE, series, regions=(ReferenceRegion("x", 0, 1, name="contact"),))
    assert plot.legend() == ("a", "b", "contact")
    assert PlotGrid("grid", ((plot, None, plot),)).legend() == ("a", "b", "contact")
    with pytest.raises(ValueError, match="rows of one length"):
        PlotGrid("grid", ((plot,), (plot, plot)))


def test_the_description_tells_title_axes_and_names() -> None:
    plot = Plot("Pulse", TIME, FORCE, (LineSeries(TWO, TWO, name="record"),))
    assert plot.description == "Pulse: force (kN) over time (ms) of record."


def test_a_box_has_quartiles_and_whiskers_of_tukey() -> None:
    """Of 1 to 9 the quartiles are 3, 5 and 7 (linear interpolation); 100 is beyond 1.5 ranges."""
    (box, empty) = BoxSeries(
        np.array([0.0, 1.0]), (np.array([*range(1, 10)], dtype=float), np.zeros(0))
    ).summaries()
    assert (box.lower_quartile, box.median, box.upper_quartile) == (3.0, 5.0, 7.0)
    assert (box.lower_whisker, box.upper_whisker) == (1.0, 9.0) and empty is None
    (far,) = BoxSeries(ONE, (np.array([1.0, 2.0, 3.0, 4.0, 100.0]),)).summaries()
    assert far.upper_whisker == 4.0


@pytest.mark.parametrize("count", [0, 1, 2, 4])
def test_few_samples_have_no_box(count) -> None:
    """Quartiles of one pulse are nobody's measurement: it is drawn as a point."""
    (box,) = BoxSeries(ONE, (np.arange(count, dtype=float),)).summaries()
    assert box is None


def test_curves_have_eight_colours_before_they_have_dashes() -> None:
    styles = [curve_style(i) for i in range(40)]
    assert len(set(styles)) == 40
    assert {dash for _, dash in styles[:8]} == {"solid"}
    assert len({role for role, _ in styles[:8]}) == 8


def test_equal_decades_are_of_two_logarithmic_axes() -> None:
    frequency = PlotAxis("frequency", "Hz", scale="log")
    Plot("paper", frequency, LOG_FORCE, equal_decades=True)
    with pytest.raises(ValueError, match="'paper' with equal decades has a linear and a log axis"):
        Plot("paper", TIME, LOG_FORCE, equal_decades=True)


def test_a_first_view_with_impossible_ends_is_refused() -> None:
    with pytest.raises(ValueError, match="cannot end"):
        PlotAxis("force", "kN", first_view=(2.0, 1.0))


def test_a_heat_map_has_its_own_ends_of_colours_or_those_of_its_axis() -> None:
    values = np.array([[0.0, -3.0], [np.nan, 1.0]])
    assert HeatMap(values, PlotAxis("difference", "1"), "diverging").colour_limits() == (-3.0, 3.0)
    assert HeatMap(values, PlotAxis("share", "1", limits=(0, 1))).colour_limits() == (0, 1)
    assert Plot("map", TIME, FORCE, (HeatMap(values, FORCE),)).limits("x") == (-0.5, 1.5)


def test_equal_scales_have_the_same_ends() -> None:
    plot = Plot("t", FORCE, FORCE, (PointSeries(TWO, np.array([0.0, 8.0])),), equal_scales=True)
    assert plot.limits("x") == plot.limits("y")


def test_categories_have_eight_colours_and_begin_anew() -> None:
    assert len(set(CATEGORIES)) == 8 and category(8) == category(0) == ColourRole.CATEGORY_0


def test_bars_of_groups_stand_side_by_side_within_the_width() -> None:
    offsets, widths = zip(*(side_by_side(4, group) for group in range(4)), strict=True)
    assert widths == pytest.approx((0.2,) * 4)
    assert offsets == pytest.approx((-0.3, -0.1, 0.1, 0.3))


def test_an_opacity_of_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match="opacity"):
        LineSeries(TWO, TWO, opacity=0.0)
