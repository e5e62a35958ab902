"""Both renderers draw whatever is a figure; the same figure is the same file."""

import json

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from matplotlib.figure import Figure as MatplotlibFigure
from pyroshock.app.figures.figure import (
    BandSeries,
    BarSeries,
    BoxSeries,
    ColourRole,
    LineSeries,
    Plot,
    PlotAxis,
    PlotGrid,
    PointSeries,
    ReferenceLine,
    ReferenceRegion,
)
from pyroshock.app.figures.matplotlib_renderer import (
    draw_plot,
    matplotlib_figure,
    pdf,
    png,
    svg,
    write_figure,
)
from pyroshock.app.figures.page_renderer import figure_data, short_numbers
from pyroshock.app.figures.palette import CARD, colour_of
from support.checks.well_formed import Page
from support.records.random_figures import figures, plots

FORCE, TIME = PlotAxis("force", "kN"), PlotAxis("time", "ms")
RISE = LineSeries(np.array([0.0, 1.0, 2.0]), np.array([0.0, 4.0, 9.0]), name="record")
#: A drawing takes a tenth of a second: a failing example is shown as it is.
DRAWN = settings(
    suppress_health_check=[HealthCheck.too_slow],
    phases=[Phase.explicit, Phase.reuse, Phase.generate],
)
PULSE = Plot("Pulse", TIME, FORCE, (RISE,), (ReferenceLine("x", 1.5, "end"),))


@settings(DRAWN, max_examples=50)
@given(plots)
def test_every_plot_is_plain_json_with_the_ends_of_its_axes(plot):
    data = json.loads(json.dumps(figure_data(plot), allow_nan=False))
    assert len(data["series"]) == len(plot.series) and data["title"] == plot.title
    for key in ("x", "y"):
        low, high = data[key]["limits"]
        assert low < high and (data[key]["scale"] == "linear" or low > 0)
    assert {own["role"] for own in data["series"]} <= set(ColourRole)


@settings(DRAWN, max_examples=15)
@given(figures)
@pytest.mark.filterwarnings("ignore:Glyph.*missing from font")
def test_every_figure_is_drawn_by_matplotlib(figure):
    drawn = matplotlib_figure(figure)
    shown = [axes for axes in drawn.axes if axes.get_visible() and axes.get_label() != "<colorbar>"]
    plots = list(figure.plots()) if isinstance(figure, PlotGrid) else [figure]
    assert len(shown) == len(plots)
    assert png(figure).startswith(b"\x89PNG")


@settings(DRAWN, max_examples=10)
@given(plots)
@pytest.mark.filterwarnings("ignore:Glyph.*missing from font")
def test_every_plot_is_a_well_formed_svg_and_the_same_one_again(plot):
    text = svg(plot)
    Page(text)
    assert svg(plot) == text


def test_files_hold_no_date_and_no_random_name():
    for write in (png, pdf, lambda figure: svg(figure).encode()):
        content = write(PULSE)
        assert write(PULSE) == content
        assert b"Date" not in content and b"20" + b"26-" not in content


def test_axes_have_headings_limits_and_legend():
    axes = matplotlib_figure(PULSE).axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time (ms)", "force (kN)")
    assert axes.get_ylim() == PULSE.limits("y")
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["record", "end"]


def test_a_second_plot_on_the_same_axes_has_another_colour_and_room():
    axes = MatplotlibFigure().subplots()
    higher = LineSeries(np.array([0.0, 5.0]), np.array([0.0, 90.0]))
    draw_plot(PULSE, axes)
    draw_plot(Plot("Pulse", TIME, FORCE, (higher,)), axes)
    record, _, second = axes.get_lines()
    assert record.get_color() == colour_of(ColourRole.CATEGORY_0)
    assert second.get_color() == colour_of(ColourRole.CATEGORY_1)
    assert axes.get_ylim()[1] > 90.0 and axes.get_ylim()[0] < 0.0


def test_plots_below_each_other_are_rows_of_a_page_with_one_legend():
    second = Plot("Error", TIME, PlotAxis("error", "kN"), (RISE,))
    data = figure_data(PlotGrid("Pulse and error", ((PULSE,), (second,)), share_x=True))
    assert [row["title"] for row in data["rows"]] == ["Pulse", "Error"]
    assert data["linked"] and data["legend"] == ["record", "end"]
    with pytest.raises(ValueError, match="rows of 2 plots"):
        figure_data(PlotGrid("beside", ((PULSE, second),)))


def test_equal_decades_are_equally_long_in_a_file():
    """A line of slope one in decades runs at 45 degrees of the picture."""
    x = PlotAxis("f", "1", scale="log", limits=(1.0, 1e3))
    y = PlotAxis("v", "1", scale="log", limits=(0.1, 1e1))
    slope = LineSeries(np.array([1.0, 10.0]), np.array([0.1, 1.0]))
    drawn = matplotlib_figure(Plot("paper", x, y, (slope,), equal_decades=True))
    drawn.draw_without_rendering()
    (begin, end) = drawn.axes[0].transData.transform([(1.0, 0.1), (10.0, 1.0)])
    assert end[0] - begin[0] == pytest.approx(end[1] - begin[1], rel=1e-3)


def test_few_samples_are_points_without_a_box():
    tips = PlotAxis("tip", categories=("one", "many"))
    boxes = BoxSeries(np.array([0.0, 1.0]), (np.array([3.0]), np.arange(9.0)))
    axes = matplotlib_figure(Plot("boxes", tips, FORCE, (boxes,))).axes[0]
    at_one = [line for line in axes.get_lines() if np.mean(line.get_xdata()) < 0.5]
    (points,) = at_one
    assert points.get_marker() == "o" and list(points.get_ydata()) == [3.0]


def test_a_region_says_its_sentence_on_a_page():
    region = ReferenceRegion("x", 0.5, 0.6, mark="1", text="reject, clipping: a flat top")
    (shown,) = figure_data(Plot("p", TIME, FORCE, (RISE,), regions=(region,)))["regions"]
    assert (shown["mark"], shown["text"]) == ("1", "reject, clipping: a flat top")


def test_dark_and_light_have_the_card_of_the_page():
    for scheme in ("light", "dark"):
        assert CARD[scheme] in svg(PULSE, scheme)


def test_an_unknown_suffix_is_refused_with_those_that_are_known(tmp_path):
    with pytest.raises(ValueError, match=r"'x\.bmp'; expected one of \.png, \.svg, \.pdf"):
        write_figure(PULSE, tmp_path / "x.bmp")
    for ending in ("png", "svg", "pdf"):
        write_figure(PULSE, tmp_path / "new" / f"x.{ending}")
    assert (tmp_path / "new" / "x.png").read_bytes() == png(PULSE)


def test_plots_of_a_grid_share_the_widest_limits():
    low = Plot("a", TIME, FORCE, (PointSeries(np.array([0.0, 1.0]), np.array([0.0, 1.0])),))
    high = Plot("b", TIME, FORCE, (PointSeries(np.array([0.0, 9.0]), np.array([0.0, 8.0])),))
    drawn = matplotlib_figure(PlotGrid("grid", ((low,), (high,)), share_x=True, share_y=True))
    assert drawn.axes[0].get_xlim() == pytest.approx(high.limits("x"))
    assert drawn.axes[0].get_ylim() == pytest.approx(high.limits("y"))


def test_a_band_on_a_logarithmic_axis_reaches_to_its_end_where_it_has_no_lower_edge():
    band = BandSeries(np.array([1.0, 2.0]), np.array([0.0, 0.0]), np.array([10.0, 20.0]))
    plot = Plot("t", TIME, PlotAxis("a", "g", scale="log"), (band,))
    (area,) = matplotlib_figure(plot).axes[0].collections
    assert area.get_paths()[0].vertices[:, 1].min() == pytest.approx(plot.limits("y")[0])


def test_bars_with_intervals_begin_at_zero():
    ends = np.array([2.0, -1.0])
    bars = BarSeries(np.array([0.0, 1.0]), ends, low=ends - 0.5, high=ends + 0.5)
    axes = matplotlib_figure(Plot("t", TIME, FORCE, (bars,))).axes[0]
    drawn = [(patch, patch.get_transform() - axes.transData) for patch in axes.patches]
    boxes = [patch.get_path().get_extents(inverse) for patch, inverse in drawn]
    assert [sorted((box.y0, box.y1)) for box in boxes] == [
        pytest.approx([0, 2]),
        pytest.approx([-1, 0]),
    ]


def test_numbers_are_as_short_as_a_screen_needs():
    assert short_numbers([1 / 3, np.nan, -123456.789, 0.0, 1e-30]) == [
        *(0.333333, None, -123457.0, 0.0, 1e-30),
    ]


def test_a_plot_without_a_y_axis_leaves_the_logarithmic_one_that_is_there():
    axes = MatplotlibFigure().subplots()
    curve = LineSeries(np.array([1.0, 9.0]), np.array([1.0, 90.0]))
    draw_plot(Plot("t", TIME, PlotAxis("a", "g", scale="log"), (curve,)), axes)
    row = PlotAxis("", "1", hidden=True)
    draw_plot(Plot("v", TIME, row, (PointSeries(np.array([5.0]), np.zeros(1)),)), axes)
    assert axes.get_yscale() == "log" and axes.get_ylim()[0] > 0 and axes.yaxis.get_visible()
