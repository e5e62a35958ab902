"""A figure is data: series over axes with quantity, unit and scale, and what stands beside them.

Nothing here draws. `page_renderer` draws any figure on a page, `matplotlib_renderer` on axes or
into a file. Numbers stand in the unit of their axis; who makes a figure converts them. Colours are
roles, which a renderer turns into colours of a light or a dark page.

Glossary: a `Plot` is one pair of axes, a `PlotGrid` has several of them in rows, a `Figure` is
either. Series of one name share an entry of the legend, and are shown and hidden together.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from enum import StrEnum
from typing import Any, ClassVar, Literal, Self, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ...array_types import Floats

Scale = Literal["linear", "log"]
Direction = Literal["x", "y"]
Dash = Literal["solid", "dash", "dot", "dashdot", "longdash"]
#: Beside the eight colours, where there are more curves than colours.
DASHES: tuple[Dash, ...] = ("solid", "dash", "dot", "dashdot", "longdash")
#: Unit of what has none: shares, ratios, counts.
DIMENSIONLESS = "1"


class ColourRole(StrEnum):
    """What a colour says. `category(i)` gives the colours of things that are only told apart."""

    MEASURED = "measured"
    MODEL = "model"
    #: What a value should be: nominal, prescribed, equal.
    REFERENCE = "reference"
    TOLERANCE = "tolerance"
    NOISE = "noise"
    #: The error of the model, without and with the effects that a diagnosis adds.
    BEFORE = "before"
    AFTER = "after"
    #: What a diagnosis names, and what it does not.
    CAUSE = "cause"
    OTHER = "other"
    INK = "ink"
    QUIET = "quiet"
    RULE = "rule"
    #: What a check rejects, and what it warns of.
    BAD = "bad"
    WARN = "warn"
    CATEGORY_0 = "c0"
    CATEGORY_1 = "c1"
    CATEGORY_2 = "c2"
    CATEGORY_3 = "c3"
    CATEGORY_4 = "c4"
    CATEGORY_5 = "c5"
    CATEGORY_6 = "c6"
    CATEGORY_7 = "c7"


CATEGORIES = tuple(role for role in ColourRole if role.name.startswith("CATEGORY_"))


def category(number: int) -> ColourRole:
    """The colour of the category of this number; from eight on they begin anew."""
    return CATEGORIES[number % len(CATEGORIES)]


def curve_style(number: int) -> tuple[ColourRole, Dash]:
    """Colour and dashes of the curve of this number: the first eight differ in colour, each
    further eight have the same colours with other dashes, so that 40 curves differ."""
    return category(number), DASHES[number // len(CATEGORIES) % len(DASHES)]


def as_floats(values: ArrayLike | Sequence[float | None]) -> Floats:
    """Numbers that cannot be written to, (n,); NaN, a gap, for None and for what is not finite."""
    array = np.array(values, dtype=np.float64)
    array[~np.isfinite(array)] = np.nan
    array.flags.writeable = False
    return array


@dataclass(frozen=True)
class PlotAxis:
    """`unit` is "1" for what has none. An axis of `categories` counts them from 0.

    `limits` are the ends where the values do not set them, `first_view` the ends that a page opens
    with where it does not show everything, `from_zero` keeps zero in sight, `reversed` turns the
    axis (the first category at the top), `whole` names whole numbers only, and `hidden` leaves out
    ticks and title. Raises `ValueError` for an axis without a unit or
    categories, and for ends that it cannot have.
    """

    quantity: str
    unit: str = ""
    scale: Scale = "linear"
    categories: tuple[str, ...] = ()
    limits: tuple[float, float] | None = None
    first_view: tuple[float, float] | None = None
    from_zero: bool = False
    reversed: bool = False
    whole: bool = False
    hidden: bool = False

    def __post_init__(self) -> None:
        if not self.unit and not self.categories:
            raise ValueError(
                f"axis {self.quantity!r} has no unit; give one, {DIMENSIONLESS!r} where there is "
                "none, or categories"
            )
        if self.categories and self.scale == "log":
            raise ValueError(f"axis {self.quantity!r} of categories cannot be logarithmic")
        for ends in (self.limits, self.first_view):
            if ends is None:
                continue
            low, high = ends
            if not (math.isfinite(low) and math.isfinite(high) and low < high):
                raise ValueError(
                    f"axis {self.quantity!r} cannot end at {low:g} and {high:g}; the first must be "
                    "the smaller"
                )
            if self.scale == "log" and low <= 0:
                raise ValueError(f"axis {self.quantity!r} is logarithmic and cannot begin at {low}")

    @property
    def heading(self) -> str:
        """`force (kN)`; without brackets where there is no unit."""
        return (
            self.quantity
            if self.unit in ("", DIMENSIONLESS)
            else f"{self.quantity} ({self.unit})".strip()
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class PlotSeries:
    """What all series have. `name` is the entry of the legend, "" for none; `detail` is what this
    series is called under the cursor and in tables, where that is not `name`.

    `hidden` series appear when their entry of the legend is chosen. The cursor does not read
    `silent` ones. Raises `ValueError` where arrays differ in length.
    """

    name: str = ""
    detail: str = ""
    role: ColourRole = ColourRole.CATEGORY_0
    opacity: float = 1.0
    hidden: bool = False
    silent: bool = False

    #: Fields of numbers along each axis.
    ALONG_X: ClassVar[tuple[str, ...]] = ()
    ALONG_Y: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        if not 0 < self.opacity <= 1:
            raise ValueError(f"{self.title}: an opacity of {self.opacity:g} is not within 0 and 1")
        for name in (*self.ALONG_X, *self.ALONG_Y):
            values = getattr(self, name)
            if values is not None:
                values = as_floats(values)
                if values.ndim != 1:
                    raise ValueError(f"{self.title}: {name} has {values.ndim} axes; expected one")
                object.__setattr__(self, name, values)
        self._check_lengths()

    @property
    def title(self) -> str:
        """What the series is called where it stands alone."""
        return self.detail or self.name or "series"

    def _check_lengths(self) -> None:
        names = [*self.ALONG_X, *self.ALONG_Y]
        names += ["labels"] if any(own.name == "labels" for own in fields(self)) else []
        lengths = {name: len(getattr(self, name)) for name in names if self._is_given(name)}
        if len(set(lengths.values())) > 1:
            differing = ", ".join(f"{name} {length}" for name, length in lengths.items())
            raise ValueError(f"{self.title}: lengths differ: {differing}")

    def _is_given(self, name: str) -> bool:
        value = getattr(self, name)
        return value is not None and (name != "labels" or len(value) > 0)

    def along(self, direction: Direction) -> Floats:
        """All numbers of an axis, which it must show; NaN are gaps."""
        names = self.ALONG_X if direction == "x" else self.ALONG_Y
        arrays = [getattr(self, name) for name in names if getattr(self, name) is not None]
        return np.concatenate(arrays) if arrays else np.zeros(0)

    @property
    def rises_along(self) -> Direction | None:
        """The axis at whose zero this begins, as bars do."""
        return None

    def masked(self, direction: Direction) -> Self:
        """With gaps where a number is not positive: a logarithmic axis has no zero."""
        names = self.ALONG_X if direction == "x" else self.ALONG_Y
        changes: dict[str, Any] = {}
        for name in names:
            values = getattr(self, name)
            if values is not None and np.any(values <= 0):
                changes[name] = np.where(values > 0, values, np.nan)
        return replace(self, **changes) if changes else self


@dataclass(frozen=True, eq=False)
class LineSeries(PlotSeries):
    """A curve through `x`, `y` (n,), with a mark at each point where `marks`. The cursor shows
    `labels` (n or none) beside the numbers."""

    x: Floats
    y: Floats
    dash: Dash = "solid"
    width: float = 2.0
    marks: bool = False
    labels: tuple[str, ...] = ()

    ALONG_X: ClassVar[tuple[str, ...]] = ("x",)
    ALONG_Y: ClassVar[tuple[str, ...]] = ("y",)


@dataclass(frozen=True, eq=False)
class StepSeries(PlotSeries):
    """`values` (n,) over the cells between `edges` (n + 1,), as a histogram has them; `filled` down
    to zero."""

    edges: Floats
    values: Floats
    filled: bool = False

    ALONG_X: ClassVar[tuple[str, ...]] = ("edges",)
    ALONG_Y: ClassVar[tuple[str, ...]] = ("values",)

    @property
    def rises_along(self) -> Direction | None:
        return "y" if self.filled else None

    def _check_lengths(self) -> None:
        if len(self.edges) != len(self.values) + 1:
            raise ValueError(
                f"{self.title}: {len(self.edges)} edges do not bound {len(self.values)} cells"
            )


@dataclass(frozen=True, eq=False)
class PointSeries(PlotSeries):
    """Points `x`, `y` (n,) and the intervals about them, from `x_low` to `x_high` and from `y_low`
    to `y_high`; `filled` is false for rings. `size` is the diameter in px of a page."""

    x: Floats
    y: Floats
    x_low: Floats | None = None
    x_high: Floats | None = None
    y_low: Floats | None = None
    y_high: Floats | None = None
    size: float = 7.0
    filled: bool = True
    labels: tuple[str, ...] = ()

    ALONG_X: ClassVar[tuple[str, ...]] = ("x", "x_low", "x_high")
    ALONG_Y: ClassVar[tuple[str, ...]] = ("y", "y_low", "y_high")

    def __post_init__(self) -> None:
        super().__post_init__()
        for low, high in (("x_low", "x_high"), ("y_low", "y_high")):
            if (getattr(self, low) is None) != (getattr(self, high) is None):
                raise ValueError(f"{self.title}: {low} and {high} go together")


@dataclass(frozen=True, eq=False)
class BarSeries(PlotSeries):
    """Bars at `position` from `base` (zero where None) to `end` (n,), and an interval of each from
    `low` to `high`. They lie along x where `horizontal`, and are `width` wide."""

    position: Floats
    end: Floats
    base: Floats | None = None
    low: Floats | None = None
    high: Floats | None = None
    width: float = 0.8
    horizontal: bool = False
    labels: tuple[str, ...] = ()

    ALONG_X: ClassVar[tuple[str, ...]] = ("position",)
    ALONG_Y: ClassVar[tuple[str, ...]] = ("end", "base", "low", "high")

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.low is None) != (self.high is None):
            raise ValueError(f"{self.title}: low and high go together")

    def along(self, direction: Direction) -> Floats:
        along_position = (direction == "y") == self.horizontal
        values = super().along("x" if along_position else "y")
        if along_position:
            return np.concatenate([values - self.width / 2, values + self.width / 2])
        return values

    @property
    def rises_along(self) -> Direction | None:
        return None if self.base is not None else "x" if self.horizontal else "y"

    def masked(self, direction: Direction) -> Self:
        return super().masked("x" if (direction == "y") == self.horizontal else "y")


#: A box has five numbers: of fewer samples it would show what nobody has measured.
FEWEST_IN_A_BOX = 5


@dataclass(frozen=True)
class BoxSummary:
    """Median, quartiles, and whiskers: the last samples within 1.5 quartile ranges (Tukey)."""

    lower_whisker: float
    lower_quartile: float
    median: float
    upper_quartile: float
    upper_whisker: float


@dataclass(frozen=True, eq=False)
class BoxSeries(PlotSeries):
    """A box of the `samples` (any number each) at each `position` (n,), and the samples as points
    beside it."""

    position: Floats
    samples: tuple[Floats, ...]
    width: float = 0.6

    ALONG_X: ClassVar[tuple[str, ...]] = ("position",)

    def __post_init__(self) -> None:
        object.__setattr__(self, "samples", tuple(as_floats(values) for values in self.samples))
        super().__post_init__()
        if len(self.samples) != len(self.position):
            raise ValueError(
                f"{self.title}: {len(self.samples)} samples at {len(self.position)} positions"
            )

    def along(self, direction: Direction) -> Floats:
        if direction == "y":
            return np.concatenate(self.samples) if self.samples else np.zeros(0)
        return np.concatenate([self.position - self.width / 2, self.position + self.width / 2])

    def masked(self, direction: Direction) -> Self:
        if direction == "x":
            return super().masked("x")
        masked = tuple(np.where(values > 0, values, np.nan) for values in self.samples)
        return replace(self, samples=masked)

    def summaries(self) -> tuple[BoxSummary | None, ...]:
        """A box for each position, None where it has fewer samples than `FEWEST_IN_A_BOX`: those
        are drawn as points alone."""
        return tuple(_summary(values[np.isfinite(values)]) for values in self.samples)


def _summary(values: Floats) -> BoxSummary | None:
    if values.size < FEWEST_IN_A_BOX:
        return None
    lower, median, upper = (float(value) for value in np.quantile(values, [0.25, 0.5, 0.75]))
    reach = 1.5 * (upper - lower)
    inside = values[(values >= lower - reach) & (values <= upper + reach)]
    return BoxSummary(float(inside.min()), lower, median, upper, float(inside.max()))


@dataclass(frozen=True, eq=False)
class BandSeries(PlotSeries):
    """The area between `low` and `high` over `x` (n,)."""

    x: Floats
    low: Floats
    high: Floats
    opacity: float = field(default=0.22, kw_only=True)

    ALONG_X: ClassVar[tuple[str, ...]] = ("x",)
    ALONG_Y: ClassVar[tuple[str, ...]] = ("low", "high")


@dataclass(frozen=True, eq=False)
class HeatMap(PlotSeries):
    """`values` (rows, columns) as colours; the cell of row i and column j is about y = i, x = j.

    `colour` is the axis of the colours with its ends. "rising" goes from none to all, "diverging"
    from low over none to high.
    """

    values: Floats
    colour: PlotAxis
    palette: Literal["rising", "diverging"] = "rising"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "values", as_floats(self.values))
        if self.values.ndim != 2:
            raise ValueError(f"{self.title}: values have {self.values.ndim} axes; expected two")
        if self.colour.scale == "log":
            object.__setattr__(
                self, "values", as_floats(np.where(self.values > 0, self.values, np.nan))
            )

    def along(self, direction: Direction) -> Floats:
        count = self.values.shape[1 if direction == "x" else 0]
        return np.array([-0.5, count - 0.5]) if self.values.size else np.zeros(0)

    def masked(self, direction: Direction) -> Self:
        raise ValueError(
            f"{self.title}: the cells of a heat map are counted, {direction} is linear"
        )

    def colour_limits(self) -> tuple[float, float]:
        """Ends of the colours, of the values where the axis names none."""
        if self.colour.limits is not None:
            return self.colour.limits
        finite = self.values[np.isfinite(self.values)]
        if not finite.size:
            return (1.0, 10.0) if self.colour.scale == "log" else (0.0, 1.0)
        low, high = float(finite.min()), float(finite.max())
        if self.palette == "diverging":
            low, high = -max(abs(low), abs(high)), max(abs(low), abs(high))
        if low == high:
            return (low / 2, low * 2) if self.colour.scale == "log" else (low - 0.5, high + 0.5)
        return low, high


@dataclass(frozen=True)
class ReferenceLine:
    """A line across the axes where the axis `along` has the value `at`; `name` is an entry of the
    legend, "" for none."""

    along: Direction
    at: float
    name: str = ""
    role: ColourRole = ColourRole.REFERENCE
    dash: Dash = "dash"
    width: float = 1.0


@dataclass(frozen=True)
class ReferenceRegion:
    """All between two values of the axis `along`, shaded.

    `mark` is a number or a word that stands at its upper end, and `text` the sentence that the
    cursor says within it. On a page it is always wide enough to be seen.
    """

    along: Direction
    start: float
    stop: float
    name: str = ""
    role: ColourRole = ColourRole.TOLERANCE
    opacity: float = 0.15
    mark: str = ""
    text: str = ""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.start) and math.isfinite(self.stop) and self.start < self.stop):
            raise ValueError(
                f"region {self.name!r} cannot reach from {self.start:g} to {self.stop:g}"
            )


@dataclass(frozen=True)
class TextLabel:
    """Words at a place of the axes: `anchor` is the side of the words that is there, `above` tells
    whether they stand above or below it (None: on it)."""

    text: str
    x: float
    y: float
    anchor: Literal["start", "middle", "end"] = "middle"
    above: bool | None = None
    role: ColourRole = ColourRole.QUIET


@dataclass(frozen=True)
class Plot:
    """One pair of axes. Raises `ValueError` for numbers that its axes cannot hold; on a logarithmic
    axis, numbers that are not positive become gaps.

    `notes` are sentences that stand below it. `equal_scales`: one unit is as long on both axes;
    `equal_decades`: one decade is, on two logarithmic axes. `cursor` "column" reads all curves at
    one x, "nearest" the nearest point. `height` is in px of a page, None for the usual one.
    """

    title: str
    x: PlotAxis
    y: PlotAxis
    series: tuple[PlotSeries, ...] = ()
    reference_lines: tuple[ReferenceLine, ...] = ()
    regions: tuple[ReferenceRegion, ...] = ()
    labels: tuple[TextLabel, ...] = ()
    notes: tuple[str, ...] = ()
    equal_scales: bool = False
    equal_decades: bool = False
    cursor: Literal["nearest", "column"] = "nearest"
    height: float | None = None

    def __post_init__(self) -> None:
        series = tuple(self.series)
        if self.equal_decades and not self.x.scale == self.y.scale == "log":
            raise ValueError(
                f"plot {self.title!r} with equal decades has a {self.x.scale} and a {self.y.scale} "
                "axis; both must be logarithmic"
            )
        for direction, axis in self.axes():
            if axis.scale == "log":
                series = tuple(own.masked(direction) for own in series)
                self._check_positive(direction, axis)
            if axis.categories:
                _check_categories(series, direction, axis)
        object.__setattr__(self, "series", series)

    def axes(self) -> tuple[tuple[Direction, PlotAxis], tuple[Direction, PlotAxis]]:
        """Both axes with their directions."""
        return ("x", self.x), ("y", self.y)

    def axis(self, direction: Direction) -> PlotAxis:
        """The axis of a direction."""
        return self.x if direction == "x" else self.y

    def _check_positive(self, direction: Direction, axis: PlotAxis) -> None:
        places = [line.at for line in self.reference_lines if line.along == direction]
        places += [region.start for region in self.regions if region.along == direction]
        places += [getattr(label, direction) for label in self.labels]
        for place in places:
            if not place > 0:
                raise ValueError(f"{axis.quantity} = {place:g} is not on a logarithmic axis")

    def limits(self, direction: Direction) -> tuple[float, float]:
        """Ends of an axis: its own, or with some room about all that it must show."""
        axis = self.axis(direction)
        if axis.limits is not None:
            return axis.limits
        if axis.categories:
            return -0.5, len(axis.categories) - 0.5
        values = [own.along(direction) for own in self.series]
        values.append(
            np.array([line.at for line in self.reference_lines if line.along == direction])
        )
        values += [
            np.array([region.start, region.stop])
            for region in self.regions
            if region.along == direction
        ]
        exact = any(isinstance(own, HeatMap) for own in self.series)
        from_zero = axis.from_zero or any(own.rises_along == direction for own in self.series)
        if self.equal_scales:
            other: Direction = "y" if direction == "x" else "x"
            values += [own.along(other) for own in self.series]
        return _limits(np.concatenate(values), replace(axis, from_zero=from_zero), exact)

    def legend(self) -> tuple[str, ...]:
        """Entries of the legend, each once, in order."""
        names = [own.name for own in self.series]
        names += [line.name for line in self.reference_lines]
        names += [region.name for region in self.regions]
        return tuple(dict.fromkeys(name for name in names if name))

    @property
    def description(self) -> str:
        """The figure in a sentence, for those who do not see it."""
        axes = f"{self.y.heading or 'rows'} over {self.x.heading or 'columns'}"
        shown = [own for own in self.series if not own.silent]
        names = list(dict.fromkeys(own.name or own.detail for own in shown))
        words = ", ".join(name for name in names if name)
        return f"{self.title}: {axes}" + (f" of {words}." if words else ".")


@dataclass(frozen=True)
class PlotGrid:
    """Plots in rows of one length, None for an empty place. Plots of one column share their x axis
    where `share_x`, all share their y axis where `share_y`.

    Raises `ValueError` for rows of different lengths.
    """

    title: str
    rows: tuple[tuple[Plot | None, ...], ...]
    share_x: bool = False
    share_y: bool = False
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.rows or len({len(row) for row in self.rows}) != 1 or not self.rows[0]:
            raise ValueError(f"grid {self.title!r}: expected rows of one length")

    def plots(self) -> Iterator[Plot]:
        """From the upper left to the lower right one."""
        return (plot for row in self.rows for plot in row if plot is not None)

    def legend(self) -> tuple[str, ...]:
        """Entries of the common legend."""
        return tuple(dict.fromkeys(name for plot in self.plots() for name in plot.legend()))

    @property
    def description(self) -> str:
        """The figure in sentences, for those who do not see it."""
        return " ".join([f"{self.title}:", *(plot.description for plot in self.plots())])


Figure: TypeAlias = Plot | PlotGrid


def _check_categories(series: Sequence[PlotSeries], direction: Direction, axis: PlotAxis) -> None:
    for own in series:
        values = own.along(direction)
        outside = values[(values < -0.5) | (values > len(axis.categories) - 0.5)]
        if outside.size:
            raise ValueError(
                f"{own.title}: {outside[0]:g} is not one of the {len(axis.categories)} categories "
                f"of {axis.quantity!r}"
            )


def _limits(values: Floats, axis: PlotAxis, exact: bool) -> tuple[float, float]:
    logarithmic = axis.scale == "log"
    values = values[np.isfinite(values) & ((values > 0) | (not logarithmic))]
    if not values.size:
        return (1.0, 10.0) if logarithmic else (0.0, 1.0)
    low, high = float(values.min()), float(values.max())
    if exact:
        return low, high
    if logarithmic:
        return max(low / 1.15, np.finfo(float).tiny), high * 1.15
    if axis.from_zero:
        low, high = min(low, 0.0), max(high, 0.0)
    room = 0.04 * (high - low) or abs(high) / 2 or 0.5
    keep_low, keep_high = axis.from_zero and low == 0, axis.from_zero and low < high == 0
    return low - (0.0 if keep_low else room), high + (0.0 if keep_high else room)


def side_by_side(groups: int, group: int, width: float = 0.8) -> tuple[float, float]:
    """Offset from the category and width of the bars of a group, where several share the
    categories."""
    own = width / groups
    return (group + 0.5) * own - width / 2, own


def equal_line(name: str, *values: Floats) -> LineSeries:
    """The line on which both axes are equal, as far as these values reach."""
    finite = np.concatenate([own[np.isfinite(own)] for own in values])
    ends = as_floats([finite.min(), finite.max()] if finite.size else [])
    return LineSeries(ends, ends, "dash", 1.2, name=name, role=ColourRole.REFERENCE)
