"""Any figure by matplotlib: on axes that are given, or as PNG, SVG or PDF.

The same figure gives the same bytes: files hold no date and no random names. matplotlib is imported
in the functions that draw, so that commands without a picture start without it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import singledispatch
from io import BytesIO
from pathlib import Path
from textwrap import fill
from threading import Lock
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np

from ...files.atomic_write import atomic_file
from .figure import (
    CATEGORIES,
    BandSeries,
    BarSeries,
    BoxSeries,
    ColourRole,
    Direction,
    Figure,
    HeatMap,
    LineSeries,
    Plot,
    PlotAxis,
    PlotGrid,
    PlotSeries,
    PointSeries,
    ReferenceLine,
    ReferenceRegion,
    StepSeries,
    TextLabel,
    category,
)
from .palette import CARD, Scheme, colour_of

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as MatplotlibFigure

#: A px of a page in points of paper, and in inches.
_POINT, _INCH = 0.75, 1 / 96
_DASHES: dict[str, Any] = {
    "solid": "-",
    "dash": (0, (5, 3)),
    "dot": (0, (1, 2)),
    "dashdot": (0, (5, 2, 1, 2)),
    "longdash": (0, (9, 3)),
}
#: Inches of a plot without a height of its own, and of a category along y.
_WIDTH, _HEIGHT, _CATEGORY = 7.0, 4.0, 0.3
#: Letters of all categories along x, beyond which they are turned.
_LETTERS = 70
#: How files are written, whatever the machine's settings are. They are global to matplotlib.
FILE_SETTINGS: dict[Any, Any] = {
    "svg.hashsalt": "pyroshock",
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
}
SETTINGS_LOCK = Lock()
_METADATA: dict[str, dict[str, None]] = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}


class _Ink:
    """The colours of a scheme, categories shifted by `shift`."""

    def __init__(self, scheme: Scheme, shift: int = 0) -> None:
        self.scheme, self.shift = scheme, shift

    def __call__(self, role: ColourRole) -> str:
        if role in CATEGORIES:
            role = category(CATEGORIES.index(role) + self.shift)
        return colour_of(role, self.scheme)


@dataclass(frozen=True, eq=False)
class _Target:
    """Where a series is drawn."""

    axes: Axes
    plot: Plot
    ink: _Ink


#: How many colours of categories are in use on axes that are drawn on more than once.
_COLOURS_USED: WeakKeyDictionary[Axes, int] = WeakKeyDictionary()


def draw_plot(plot: Plot, axes: Axes, scheme: Scheme = "light") -> list[list[Artist]]:
    """Draw a plot on axes, with its legend; gives what was drawn for each series.

    Axes that hold something already are extended by it, in further colours.
    """
    further, shift = axes.has_data(), _COLOURS_USED.get(axes, 0)
    ends = {"x": axes.get_xlim(), "y": axes.get_ylim()}
    ink = _Ink(scheme, shift)
    entries: dict[str, Artist] = {}
    for region in plot.regions:
        _enter(entries, region.name, _region(region, axes, ink))
    drawn = []
    for own in plot.series:
        artists = [] if own.hidden else _draw(own, _Target(axes, plot, ink))
        drawn.append(artists)
        if artists:
            _enter(entries, own.name, artists[0])
    for line in plot.reference_lines:
        _enter(entries, line.name, _reference(line, axes, ink))
    _COLOURS_USED[axes] = shift + _colours_of(plot)
    for direction, axis in plot.axes():
        _set_axis(axes, direction, axis, plot, ends[direction] if further else None)
    for label in plot.labels:
        if _is_within(label, axes):
            _text(label, axes, ink)
    _style(axes, plot, ink)
    if entries and not further:
        axes.legend(entries.values(), map(_plain, entries), frameon=False, fontsize="small")
    return drawn


def _enter(entries: dict[str, Artist], name: str, artist: Artist) -> None:
    if name and name not in entries:
        entries[name] = artist


def _colours_of(plot: Plot) -> int:
    roles = [CATEGORIES.index(own.role) for own in plot.series if own.role in CATEGORIES]
    return max(roles, default=-1) + 1


def _region(region: ReferenceRegion, axes: Axes, ink: _Ink) -> Artist:
    span = axes.axvspan if region.along == "x" else axes.axhspan
    colour = ink(region.role)
    if region.mark and region.along == "x":
        axes.annotate(
            _plain(region.mark),
            (region.start, 1.0),
            xycoords=("data", "axes fraction"),
            va="top",
            color=colour,
            fontsize="x-small",
            annotation_clip=True,
        )
    return span(region.start, region.stop, color=colour, alpha=region.opacity, lw=0)


def _reference(line: ReferenceLine, axes: Axes, ink: _Ink) -> Artist:
    draw = axes.axvline if line.along == "x" else axes.axhline
    width = line.width * _POINT
    return draw(line.at, color=ink(line.role), ls=_DASHES[line.dash], lw=width)


def _is_within(label: TextLabel, axes: Axes) -> bool:
    """matplotlib renders letters outside of the axes as well, and fails where they are too far."""
    (x_low, x_high), (y_low, y_high) = sorted(axes.get_xlim()), sorted(axes.get_ylim())
    return x_low <= label.x <= x_high and y_low <= label.y <= y_high


def _text(label: TextLabel, axes: Axes, ink: _Ink) -> None:
    side = {"start": "left", "middle": "center", "end": "right"}[label.anchor]
    vertical = "center" if label.above is None else "bottom" if label.above else "top"
    axes.text(
        *(label.x, label.y, _plain(label.text)),
        ha=side,
        va=vertical,
        color=ink(label.role),
        fontsize="x-small",
        clip_on=True,
    )


@singledispatch
def _draw(own: PlotSeries, _: _Target) -> list[Artist]:
    raise TypeError(f"no way to draw {type(own).__name__} by matplotlib")


@_draw.register(LineSeries)
def _(own: LineSeries, target: _Target) -> list[Artist]:
    style: dict[str, Any] = {
        "color": target.ink(own.role),
        "alpha": own.opacity,
        "lw": own.width * _POINT,
    }
    marks: dict[str, Any] = {"marker": "o", "ms": 7 * _POINT} if own.marks else {}
    return list(target.axes.plot(own.x, own.y, ls=_DASHES[own.dash], **style, **marks))


@_draw.register(PointSeries)
def _(own: PointSeries, target: _Target) -> list[Artist]:
    colour = target.ink(own.role)
    style: dict[str, Any] = {"color": colour, "alpha": own.opacity, "ms": own.size * _POINT}
    # many of them stand beside each other: an edge would change the size
    style |= {"mew": 0.0} if own.filled else {"mfc": "none", "mew": 1.5}
    points = target.axes.plot(own.x, own.y, "o", **style)
    whiskers: dict[str, Any] = {"colors": colour, "alpha": 0.6 * own.opacity, "lw": 1.2}
    if own.y_low is not None and own.y_high is not None:
        target.axes.vlines(own.x, own.y_low, own.y_high, **whiskers)
    if own.x_low is not None and own.x_high is not None:
        target.axes.hlines(own.y, own.x_low, own.x_high, **whiskers)
    return list(points)


@_draw.register(StepSeries)
def _(own: StepSeries, target: _Target) -> list[Artist]:
    style: dict[str, Any] = {
        "color": target.ink(own.role),
        "alpha": own.opacity * (0.6 if own.filled else 1.0),
    }
    baseline = target.plot.limits("y")[0] if target.plot.y.scale == "log" else 0.0
    # without a cell there is nothing to draw, which matplotlib takes for an error
    if not len(own.values):
        return []
    heights = np.where(np.isnan(own.values), baseline, own.values)
    return [target.axes.stairs(heights, own.edges, baseline=baseline, fill=own.filled, **style)]


@_draw.register(BarSeries)
def _(own: BarSeries, target: _Target) -> list[Artist]:
    along = target.plot.x if own.horizontal else target.plot.y
    zero = target.plot.limits("x" if own.horizontal else "y")[0] if along.scale == "log" else 0.0
    base = np.full(len(own.end), zero) if own.base is None else own.base
    base = np.where(np.isnan(base), zero, base)
    style: dict[str, Any] = {"color": target.ink(own.role), "alpha": own.opacity}
    if own.horizontal:
        bars = target.axes.barh(own.position, own.end - base, own.width, left=base, **style)
    else:
        bars = target.axes.bar(own.position, own.end - base, own.width, bottom=base, **style)
    if own.low is not None and own.high is not None:
        lines = target.axes.hlines if own.horizontal else target.axes.vlines
        lines(own.position, own.low, own.high, colors=target.ink(ColourRole.INK), lw=1.2)
    return list(bars.patches)


@_draw.register(BoxSeries)
def _(own: BoxSeries, target: _Target) -> list[Artist]:
    colour = target.ink(own.role)
    artists: list[Artist] = []
    line: dict[str, Any] = {"color": colour, "lw": 1.2, "alpha": own.opacity}
    for position, box, samples in zip(own.position, own.summaries(), own.samples, strict=True):
        beside = position + 0.8 * own.width * ((0.618 * np.arange(len(samples))) % 1 - 0.5)
        points = target.axes.plot(
            beside, samples, "o", ms=3, mew=0, color=colour, alpha=0.5 * own.opacity
        )
        if box is None:
            artists += points
            continue
        near, far = position - own.width / 2, position + own.width / 2
        lower, upper = box.lower_quartile, box.upper_quartile
        artists += target.axes.plot(
            [near, far, far, near, near], [lower, lower, upper, upper, lower], **line
        )
        target.axes.plot([near, far], [box.median, box.median], **line)
        target.axes.plot([position, position], [box.lower_whisker, lower], **line)
        target.axes.plot([position, position], [upper, box.upper_whisker], **line)
    return artists


@_draw.register(BandSeries)
def _(own: BandSeries, target: _Target) -> list[Artist]:
    # on a logarithmic axis a lower edge of zero reaches to its end
    floor = target.plot.limits("y")[0] if target.plot.y.scale == "log" else np.nan
    low = np.where(np.isnan(own.low), floor, own.low)
    drawable = np.isfinite(own.x) & np.isfinite(low) & np.isfinite(own.high)
    style: dict[str, Any] = {"color": target.ink(own.role), "alpha": own.opacity, "lw": 0}
    return [target.axes.fill_between(own.x, low, own.high, where=drawable, **style)]


@_draw.register(HeatMap)
def _(own: HeatMap, target: _Target) -> list[Artist]:
    from matplotlib.colors import LinearSegmentedColormap, LogNorm, Normalize

    if not own.values.size:
        return []
    low, none, high = (
        colour_of(CATEGORIES[0], target.ink.scheme),
        CARD[target.ink.scheme],
        target.ink(CATEGORIES[1]),
    )
    colours = [low, none, high] if own.palette == "diverging" else [none, low]
    colour_map = LinearSegmentedColormap.from_list(own.palette, colours).with_extremes(
        bad=target.ink(ColourRole.RULE)
    )
    norm = LogNorm if own.colour.scale == "log" else Normalize
    rows, columns = own.values.shape
    picture = target.axes.imshow(
        np.ma.masked_invalid(own.values),
        cmap=colour_map,
        norm=norm(*own.colour_limits()),
        extent=(-0.5, columns - 0.5, -0.5, rows - 0.5),
        origin="lower",
        aspect="auto",
        interpolation="nearest",
    )
    bar = target.axes.figure.colorbar(picture, ax=target.axes)
    bar.set_label(_plain(own.colour.heading), color=target.ink(ColourRole.INK))
    bar.ax.tick_params(colors=target.ink(ColourRole.QUIET), labelsize="small")
    bar.outline.set_visible(False)
    return [picture]


def _set_axis(
    axes: Axes,
    direction: Direction,
    axis: PlotAxis,
    plot: Plot,
    present: tuple[float, float] | None,
) -> None:
    own = axes.xaxis if direction == "x" else axes.yaxis
    if axis.scale == "log":
        (axes.set_xscale if direction == "x" else axes.set_yscale)("log")
    low, high = plot.limits(direction)
    if present is not None:
        # a logarithmic axis of what is there already has no zero
        values = [end for end in (low, high) if end > 0 or own.get_scale() != "log"]
        low, high = min(*values, *present), max(*values, *present)
    ends = (high, low) if axis.reversed else (low, high)
    (axes.set_xlim if direction == "x" else axes.set_ylim)(*ends)
    if axis.hidden:
        own.set_visible(present is not None)
        return
    own.set_label_text(_plain(axis.heading))
    if axis.categories:
        names = [_plain(name) for name in axis.categories]
        turned = direction == "x" and sum(map(len, names)) > _LETTERS
        own.set_ticks(
            range(len(names)),
            labels=names,
            rotation=90 if turned else 0,
            fontsize="small" if len(names) <= 20 else "xx-small",
        )
    elif axis.whole:
        from matplotlib.ticker import MaxNLocator

        own.set_major_locator(MaxNLocator(integer=True))


def _plain(text: str) -> str:
    """Words as they are: matplotlib takes what stands between two dollars for mathematics."""
    return text.replace("$", r"\$")


def _style(axes: Axes, plot: Plot, ink: _Ink) -> None:
    axes.set_facecolor(CARD[ink.scheme])
    quiet, words = ink(ColourRole.QUIET), ink(ColourRole.INK)
    axes.tick_params(colors=quiet, which="both")
    for side, spine in axes.spines.items():
        spine.set_color(quiet)
        spine.set_visible(side in ("left", "bottom"))
    for label in (axes.xaxis.label, axes.yaxis.label, axes.title):
        label.set_color(words)
    if not any(isinstance(own, HeatMap) for own in plot.series):
        axes.grid(visible=True, color=ink(ColourRole.RULE), lw=0.5)
    axes.set_axisbelow(True)
    if plot.equal_scales and plot.x.scale == plot.y.scale:
        axes.set_box_aspect(1)
    if plot.equal_decades:
        axes.set_aspect("equal", adjustable="box")


def new_figure(width: float, height: float) -> MatplotlibFigure:
    """An empty figure, in inches, that needs no display and no global state."""
    from matplotlib.figure import Figure as NewFigure

    return NewFigure(figsize=(width, height), layout="constrained", dpi=150)


def matplotlib_figure(figure: Figure, scheme: Scheme = "light") -> MatplotlibFigure:
    """The figure as one of matplotlib."""
    canvas = new_figure(*size_of(figure))
    canvas.set_facecolor(CARD[scheme])
    if isinstance(figure, PlotGrid):
        _draw_grid(figure, canvas, scheme)
    else:
        axes = canvas.subplots()
        draw_plot(figure, axes, scheme)
        words: dict[str, Any] = {"fontsize": "medium", "color": colour_of(ColourRole.INK, scheme)}
        axes.set_title(_plain(_with_notes(figure)), **words)
    return canvas


def _with_notes(figure: Figure) -> str:
    """Title and notes in lines that are no longer than the figure is wide."""
    letters = int(16 * size_of(figure)[0])
    return "\n".join([figure.title, *(fill(note, letters) for note in figure.notes)])


def size_of(figure: Figure) -> tuple[float, float]:
    """Width and height in inches."""
    if isinstance(figure, PlotGrid):
        sizes = [
            max((size_of(plot)[1] for plot in row if plot is not None), default=1.0)
            for row in figure.rows
        ]
        columns = len(figure.rows[0])
        width = _WIDTH if columns == 1 else min(4.5 * columns, 14.0)
        return width, 0.8 * sum(sizes) + 0.6
    if figure.height is not None:
        return _WIDTH, figure.height * _INCH
    return _WIDTH, max(_HEIGHT, 1.2 + _CATEGORY * len(figure.y.categories))


def _draw_grid(grid: PlotGrid, canvas: MatplotlibFigure, scheme: Scheme) -> None:
    heights = [
        max((size_of(plot)[1] for plot in row if plot is not None), default=1.0)
        for row in grid.rows
    ]
    places = canvas.subplots(
        len(grid.rows),
        len(grid.rows[0]),
        squeeze=False,
        sharex="col" if grid.share_x else False,
        sharey=grid.share_y,
        height_ratios=heights,
    )
    entries: dict[str, Artist] = {}
    for axes, plot in zip(places.ravel(), [plot for row in grid.rows for plot in row], strict=True):
        if plot is None:
            axes.set_visible(False)
            continue
        draw_plot(plot, axes, scheme)
        axes.set_title(_plain(plot.title), fontsize="small")
        legend = axes.get_legend()
        if legend is not None:
            for handle, text in zip(legend.legend_handles, legend.get_texts(), strict=True):
                _enter(entries, text.get_text(), handle)
            legend.remove()
    _share_limits(grid, places)
    ink = _Ink(scheme)
    canvas.suptitle(_plain(_with_notes(grid)), color=ink(ColourRole.INK), fontsize="medium")
    if entries:
        canvas.legend(
            *(list(entries.values()), list(entries)),
            loc="outside lower center",
            ncols=min(len(entries), 4),
            frameon=False,
            fontsize="small",
        )


def _share_limits(grid: PlotGrid, places: Any) -> None:
    """Shared axes reach as far as the widest of them: each plot has set its own ends."""

    def widest(plots: Sequence[Plot | None], direction: Direction) -> tuple[float, float] | None:
        ends = [plot.limits(direction) for plot in plots if plot is not None]
        return (min(low for low, _ in ends), max(high for _, high in ends)) if ends else None

    if grid.share_x:
        for column, plots in enumerate(zip(*grid.rows, strict=True)):
            if (ends := widest(plots, "x")) is not None:
                reverse = next(plot for plot in plots if plot is not None).x.reversed
                places[0, column].set_xlim(*(ends[::-1] if reverse else ends))
    ends = widest(tuple(grid.plots()), "y")
    if grid.share_y and ends is not None:
        reverse = next(grid.plots()).y.reversed
        places[0, 0].set_ylim(*(ends[::-1] if reverse else ends))


def plot_on(plot: Plot, axes: Axes | None = None) -> Axes:
    """Draw on the axes that are given, or on those of a new figure that a notebook shows."""
    axes = axes_or_new(axes, size_of(plot))
    draw_plot(plot, axes)
    return axes


def axes_or_new(axes: Axes | None, size: tuple[float, float] = (_WIDTH, _HEIGHT)) -> Axes:
    """The axes that were given, or those of a new figure of this size (inches) that a notebook
    shows."""
    if axes is not None:
        return axes
    import matplotlib.pyplot as plt

    return plt.subplots(figsize=size, layout="constrained")[1]


def plot_rows(grid: PlotGrid) -> list[Axes]:
    """Plots below each other with a common x axis in a new figure that a notebook shows."""
    import matplotlib.pyplot as plt

    width, height = size_of(grid)
    figure = plt.figure(figsize=(width, height), layout="constrained")
    _draw_grid(grid, figure, "light")
    return [axes for axes in figure.axes if axes.get_label() != "<colorbar>"]


def png(figure: Figure, scheme: Scheme = "light") -> bytes:
    """The figure as PNG."""
    return _file(figure, "png", scheme)


def pdf(figure: Figure) -> bytes:
    """The figure as PDF, on white."""
    return _file(figure, "pdf", "light")


def svg(figure: Figure, scheme: Scheme = "light") -> str:
    """The figure as SVG, its words as text."""
    return _file(figure, "svg", scheme).decode()


def _file(figure: Figure, ending: str, scheme: Scheme) -> bytes:
    import matplotlib as mpl

    buffer = BytesIO()
    canvas = matplotlib_figure(figure, scheme)
    with SETTINGS_LOCK, mpl.rc_context(FILE_SETTINGS):
        canvas.savefig(buffer, format=ending, metadata=_METADATA[ending])
    return buffer.getvalue()


_WRITERS: dict[str, Callable[[Figure], bytes]] = {
    ".png": png,
    ".svg": lambda figure: svg(figure).encode(),
    ".pdf": pdf,
}


def write_figure(figure: Figure, path: Path) -> None:
    """Write a figure; the suffix decides the format. `ValueError` for one that cannot be drawn."""
    writer = _WRITERS.get(path.suffix.lower())
    if writer is None:
        raise ValueError(f"cannot draw {path.name!r}; expected one of {', '.join(_WRITERS)}")
    content = writer(figure)
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_file(path) as partial:
        partial.write_bytes(content)
