"""A plot as an SVG element within a page: small, its colours and its font those of the page, its
words as text, and the names of its points on pointing at them.

matplotlib draws it. The page gives the colours of the roles as custom properties (`--c0`, `--ink`),
and writes title and legend itself.
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Iterable
from dataclasses import replace
from io import BytesIO
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np

from ...array_types import Floats
from ..common.number_format import format_number
from .figure import ColourRole, HeatMap, Plot, PointSeries
from .matplotlib_renderer import FILE_SETTINGS, SETTINGS_LOCK, draw_plot
from .palette import ALIASES, CARD, colour_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Inches of a chart, of which two or three stand beside each other, and of a category along y.
_WIDTH, _HEIGHT, _CATEGORY = 3.75, 2.3, 0.34
#: Inches from the edges to the axes, where ticks and titles stand.
_LEFT, _RIGHT, _TOP, _BOTTOM = 0.62, 0.1, 0.08, 0.44
#: Most numbers of an axis less one.
_TICKS = 5
#: A logarithmic axis of fewer decades has further numbers than the powers of ten, at least so many.
_FULL_DECADES, _LEAST_TICKS = 2, 3
#: In points of a chart, whose width on paper is half or a third of a page.
_FONT_SIZE, _LABEL_SIZE = 10.0, 8.25
_SETTINGS = {
    **FILE_SETTINGS,
    "font.size": _FONT_SIZE,
    "axes.linewidth": 0.6,
    "lines.linewidth": 1.5,
}
_SVG, _LINK = "{http://www.w3.org/2000/svg}", "{http://www.w3.org/1999/xlink}href"
_POINTS = "points-"
#: Hundredths of a point are finer than any print.
_DECIMALS = re.compile(r"(\.\d\d)\d+")
_FONT = re.compile(r"font-family: [^;]*;? ?")
#: An element that is transparent as a whole becomes a picture of pixels in a PDF.
_OPACITY = re.compile(r"(?<![\w-])opacity: ([\d.]+)")
#: Colour -> the custom property that a page has for it.
_PROPERTIES = {
    CARD["light"]: "card",
    **{colour_of(role): role.value for role in reversed(ColourRole) if role not in ALIASES},
}
_COLOUR = re.compile("|".join(_PROPERTIES))


def inline_svg(plot: Plot) -> str:
    """The plot without title and legend; the same plot gives the same text."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    heat_map = next((own for own in plot.series if isinstance(own, HeatMap)), None)
    if heat_map is not None:
        return _map_svg(plot, heat_map)
    has_names = not plot.y.hidden
    height = _HEIGHT if not plot.y.categories else _BOTTOM + _CATEGORY * len(plot.y.categories)
    left_margin = _LEFT if has_names else _RIGHT
    into = BytesIO()
    # the settings are global to matplotlib
    with SETTINGS_LOCK, mpl.rc_context(_SETTINGS), warnings.catch_warnings():
        # the page has the letters that matplotlib's font lacks
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        canvas = Figure(figsize=(_WIDTH, height), frameon=False)
        axes = canvas.add_axes(
            (
                left_margin / _WIDTH,
                _BOTTOM / height,
                1 - (left_margin + _RIGHT) / _WIDTH,
                1 - (_TOP + _BOTTOM) / height,
            )
        )
        drawn = draw_plot(_without_names(plot), axes)
        _set_ticks(axes, plot)
        _fit_words(axes)
        for number, artists in enumerate(drawn):
            for artist in artists:
                artist.set_gid(f"{_POINTS}{number}")
        canvas.savefig(into, format="svg", metadata=dict.fromkeys(_METADATA))
    return _element(into.getvalue(), plot)


#: Of a map, which stands alone in its row: inches of its width, of a row of cells, of letters of
#: its small names, of the key of its colours, and cells of that key.
_MAP_WIDTH, _ROW, _LETTER, _KEY, _KEY_CELLS = 7.2, 0.17, 0.06, 0.3, 24
_NAME_SIZE = 8.25
_LEAST_OPACITY = 0.06


def _map_svg(plot: Plot, heat_map: HeatMap) -> str:
    """Cells of the colour of their role, the less transparent the larger their value, so that they
    are those of any page; below, a key of the colours with numbers."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    rows, columns = plot.y.categories, plot.x.categories
    left_margin, below = (
        _LETTER * max(map(len, names), default=0) + 0.1 for names in (rows, columns)
    )
    height = _TOP + _ROW * len(rows) + below + _KEY + _BOTTOM
    across = 1 - (left_margin + _RIGHT) / _MAP_WIDTH
    into = BytesIO()
    # the settings are global to matplotlib
    with SETTINGS_LOCK, mpl.rc_context(_SETTINGS), warnings.catch_warnings():
        # the page has the letters that matplotlib's font lacks
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        canvas = Figure(figsize=(_MAP_WIDTH, height), frameon=False)
        share = _ROW * len(rows) / height
        axes = canvas.add_axes((left_margin / _MAP_WIDTH, 1 - _TOP / height - share, across, share))
        low, high = heat_map.colour_limits()
        scale = np.log10 if heat_map.colour.scale == "log" else np.asarray
        start, stop = (float(scale(end)) for end in (low, high))
        with np.errstate(divide="ignore", invalid="ignore"):
            places = (scale(heat_map.values) - start) / (stop - start)
        _draw_cells(axes, places, heat_map.role)
        axes.set_xlim(-0.5, len(columns) - 0.5)
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.set_xticks(range(len(columns)), labels=columns, rotation=90, fontsize=_NAME_SIZE)
        axes.set_yticks(range(len(rows)), labels=rows, fontsize=_NAME_SIZE)
        key = canvas.add_axes(
            (left_margin / _MAP_WIDTH, _BOTTOM / height, across / 2, _ROW / height)
        )
        _draw_cells(key, np.linspace(0, 1, _KEY_CELLS)[np.newaxis], heat_map.role)
        ticks = _within((1, 2, 5, 10, 20, 50, 100, 200, 500, 1000), low, high)
        numbers = ticks if heat_map.colour.scale == "log" and len(ticks) > 1 else (low, high)
        key.set_xlim(-0.5, _KEY_CELLS - 0.5)
        key.set_ylim(-0.5, 0.5)
        key.set_xticks(
            [_KEY_CELLS * (float(scale(n)) - start) / (stop - start) - 0.5 for n in numbers],
            labels=[format_number(n, 3) for n in numbers],
            fontsize=_NAME_SIZE,
        )
        key.set_yticks([])
        key.set_xlabel(heat_map.colour.heading, fontsize=_NAME_SIZE)
        for own in (axes, key):
            for part in (own.xaxis.label, *own.get_xticklabels(), *own.get_yticklabels()):
                part.set_color(colour_of(ColourRole.INK))
            for spine in own.spines.values():
                spine.set_color(colour_of(ColourRole.RULE))
            own.tick_params(length=0)
        canvas.savefig(into, format="svg", metadata=dict.fromkeys(_METADATA))
    return _element(into.getvalue(), plot)


def _draw_cells(axes: Axes, places: Floats, role: ColourRole) -> None:
    """Cells of places (rows, columns) on the scale of colours from 0 to 1; none of what lies below
    it or is no number."""
    from matplotlib.patches import Rectangle

    for (row, column), place in np.ndenumerate(places):
        if np.isfinite(place) and place >= 0:
            opacity = _LEAST_OPACITY + (1 - _LEAST_OPACITY) * min(float(place), 1.0)
            cell = Rectangle((column - 0.5, row - 0.5), 1, 1, lw=0, alpha=opacity)
            cell.set_facecolor(colour_of(role))
            axes.add_patch(cell)


_METADATA = ("Date", "Creator", "Format", "Type")


def _set_ticks(axes: Axes, plot: Plot) -> None:
    """Few of them, with plain numbers, and at least three on a logarithmic axis however little of
    a decade it shows."""
    from matplotlib.ticker import FixedLocator, MaxNLocator

    axes.minorticks_off()
    for direction, axis in plot.axes():
        own = axes.xaxis if direction == "x" else axes.yaxis
        if axis.scale == "log":
            low, high = sorted(own.get_view_interval())
            if high < low * 10**_FULL_DECADES:
                decades = 10.0 ** np.arange(math.floor(math.log10(low)), math.log10(high))
                inside = _within(np.outer(decades, (1, 2, 5)).ravel().tolist(), low, high)
                if len(inside) < _LEAST_TICKS:
                    inside = _within(MaxNLocator(_TICKS).tick_values(low, high), low, high)
                own.set_major_locator(FixedLocator(inside))
            own.set_major_formatter(lambda value, _: format_number(value))
        elif not (axis.categories or axis.hidden or axis.whole):
            axes.locator_params(direction, nbins=_TICKS)


def _within(values: Iterable[float], low: float, high: float) -> list[float]:
    return [value for value in values if low <= value <= high]


def _fit_words(axes: Axes) -> None:
    """Titles of axes are no longer than their axis, and labels are as large as can be read."""
    from matplotlib.textpath import text_to_path

    for label in axes.texts:
        label.set_fontsize(_LABEL_SIZE)
    box = axes.get_window_extent()
    for title, length in ((axes.xaxis.label, box.width), (axes.yaxis.label, box.height)):
        points = length * 72 / axes.figure.dpi
        font = title.get_fontproperties()
        width = text_to_path.get_text_width_height_descent(title.get_text() or " ", font, False)[0]
        if width > points:
            title.set_fontsize(_FONT_SIZE * points / width)


def _without_names(plot: Plot) -> Plot:
    """Without entries of the legend."""
    return replace(
        plot,
        series=tuple(replace(own, name="") for own in plot.series),
        reference_lines=tuple(replace(line, name="") for line in plot.reference_lines),
        regions=tuple(replace(region, name="") for region in plot.regions),
    )


def _element(svg: bytes, plot: Plot) -> str:
    root = ElementTree.fromstring(svg)  # noqa: S314  # written a moment ago
    for number, own in enumerate(plot.series):
        if isinstance(own, PointSeries) and own.labels:
            marks = root.find(f".//*[@id='{_POINTS}{number}']")
            if marks is not None:
                _name_points(marks, own)
    used = {name.decode() for name in re.findall(rb"#(\w+)", svg)}
    _strip(root, used)
    root.attrib = {
        "viewBox": root.attrib["viewBox"],
        "role": "img",
        "aria-label": plot.description,
    }
    return ElementTree.tostring(root, encoding="unicode")


def _name_points(marks: ElementTree.Element, own: PointSeries) -> None:
    """The name and the value of each point that is drawn."""
    drawn = np.flatnonzero(np.isfinite(own.x) & np.isfinite(own.y))
    uses = list(marks.iter(f"{_SVG}use"))
    for use, i in zip(uses, drawn, strict=len(uses) == len(drawn)):
        title = ElementTree.SubElement(use, "title")
        title.text = f"{own.labels[i]}: {format_number(float(own.y[i]), 3)}"


def _strip(root: ElementTree.Element, used: set[str]) -> None:
    """Leaves what is drawn, in as few letters as a page needs."""
    for parent in root.iter():
        for child in [
            child for child in parent if child.tag in (f"{_SVG}metadata", f"{_SVG}style")
        ]:
            parent.remove(child)
    for element in root.iter():
        element.tag = element.tag.removeprefix(_SVG)
        if element.text is not None and not element.text.strip():
            element.text = None
        element.tail = None
        kept = dict(element.attrib)
        if kept.get("id") not in used:
            kept.pop("id", None)
        if _LINK in kept:
            kept["xlink:href"] = kept.pop(_LINK)
        if "d" in kept:
            kept["d"] = _DECIMALS.sub(r"\1", " ".join(kept["d"].split()))
        for name in ("x", "y", "transform"):
            if name in kept:
                kept[name] = _DECIMALS.sub(r"\1", kept[name])
        if "style" in kept:
            style = _OPACITY.sub(
                r"fill-opacity: \1; stroke-opacity: \1", _FONT.sub("", kept["style"])
            )
            kept["style"] = _COLOUR.sub(lambda colour: f"var(--{_PROPERTIES[colour[0]]})", style)
        element.attrib = kept
