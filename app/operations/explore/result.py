"""The answer of an exploration: its chart, what may be said of it, its numbers, and the selected
rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...common.number_format import finite, number
from ...common.unit_endings import unit_ending
from ...figures.figure import Plot, PlotGrid
from ..operation import Result, ResultTable
from ..sentence import Sentence
from .chart import ChartData
from .figures import DrawnChart, draw
from .request import Exploration
from .rows import SubjectRows
from .sentences import facts_of, sentences_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from ...figures.figure import Figure

#: Rows that break a rule of a control chart and are listed.
MOST_NAMED = 200
#: Shown as sizes with three digits, as sentences have them.
_SIZES = ("correlation", "correlation_low", "correlation_high")


@dataclass(frozen=True, eq=False)
class Explored(Result):
    """A chart of stored rows. `request` is what was asked, with the fields of its view; `rows` are
    all that match, `data` what is drawn of them."""

    request: Exploration
    rows: SubjectRows
    data: ChartData

    @cached_property
    def drawn(self) -> DrawnChart:
        """The plots."""
        request = self.request
        return draw(self.data, self.rows, log_x=request.log_x, log_y=request.log_y)

    @cached_property
    def selected(self) -> Sequence[int]:
        """Places of all selected rows, in the order of the chart; none where nothing is
        selected."""
        if not self.request.has_selection:
            return ()
        return list(map(int, self.data.selected(self.request)))

    @cached_property
    def facts(self) -> dict[str, Any]:
        """The counted and the computed numbers."""
        selected = len(self.selected) if self.request.has_selection else None
        return facts_of(self.rows.count, self.data, self.drawn, selected)

    def sentences(self) -> Sequence[Sentence]:
        """How many rows there are, what is not drawn, and the trend or the broken rules."""
        return tuple(sentences_of(self.request.subject, self.facts, self.data))

    def tables(self) -> Sequence[ResultTable]:
        """The numbers, the groups, the rows that break a rule, and the selected rows."""
        facts = {
            key: number(value) if key in _SIZES else value for key, value in self.facts.items()
        }
        tables = [ResultTable("", [facts], upright=True)]
        if self.summaries:
            tables.append(ResultTable("Groups", self.summaries))
        if self.data.control is not None:
            tables.append(ResultTable("Limits", [self.limits]))
            tables.append(ResultTable(self.broken_title, self.broken_rules()))
        if self.request.has_selection:
            tables.append(ResultTable("Selected rows", self.selected_rows()))
        return tables

    @cached_property
    def summaries(self) -> Sequence[dict[str, Any]]:
        """A row for each group, with quantiles in the unit of the quantity."""
        column = self.data.y if self.data.y is not None else self.data.x
        ending = _ending(column.key)
        names = {
            "q05": "percentile_5", "q25": "lower_quartile", "q75": "upper_quartile",
            "q95": "percentile_95", "deviation": "standard_deviation",
        }  # fmt: skip
        return [
            {
                key if key in ("group", "count") else f"{names.get(key, key)}{ending}": value
                for key, value in summary.as_row().items()
            }
            | {"group": summary.group or "all"}
            for summary in self.data.summaries
        ]

    @cached_property
    def limits(self) -> dict[str, float]:
        """Centre line and limits of the control chart. Raises `ValueError` where there is none."""
        chart, y = self.data.control, self.data.y
        if chart is None or y is None:
            raise ValueError("there is no control chart; expected kind control and two values")
        ending = _ending(y.key)
        return {
            f"centre{ending}": chart.centre,
            f"lower_limit{ending}": chart.lower,
            f"upper_limit{ending}": chart.upper,
            f"mean_moving_range{ending}": chart.mean_range,
            f"limit_of_ranges{ending}": chart.range_limit,
        }

    @property
    def broken_title(self) -> str:
        """What heads the rows that break a rule."""
        count = 0 if self.data.control is None else self.data.control.broken
        title = "Points that break a rule"
        return title if count <= MOST_NAMED else f"{title} (the first {MOST_NAMED} of {count})"

    @cached_property
    def _broken(self) -> dict[int, list[str]]:
        return {} if self.data.control is None else self.data.control.rules_broken(MOST_NAMED)

    def broken_rules(self) -> list[dict[str, Any]]:
        """The rows that break a rule of the control chart, with their value and the rules: of more
        than `MOST_NAMED` those beyond a limit first."""
        chart, y = self.data.control, self.data.y
        if chart is None or y is None:
            return []
        return [
            {
                "row": self.rows.label(int(self.data.rows[place])),
                "recording_order": place + 1,
                y.key: float(chart.values[place]),
                "rule": "; ".join(rules),
            }
            for place, rules in self._broken.items()
        ]

    def broken_addresses(self) -> list[str]:
        """The page of each row of `broken_rules`."""
        return [self.rows.address(int(self.data.rows[place])) for place in self._broken]

    def selected_rows(self) -> list[dict[str, Any]]:
        """As many of the selected rows as are asked for, with what the chart shows of them."""
        return [self._row(row) for row in self.listed]

    @property
    def listed(self) -> Sequence[int]:
        """Places of the selected rows that are listed."""
        return self.selected[: self.request.limit]

    def _row(self, row: int) -> dict[str, Any]:
        word = {"shots": "shot", "models": "version_of_model"}.get(self.request.subject, "impact")
        channel = {"channel": self.rows.channels[row]} if self.rows.channels else {}
        columns = {key: column.values[row] for key, column in self.rows.columns.items()}
        return {word: self.rows.keys[row], **channel, **columns}

    def selected_impacts(self, most: int) -> list[int]:
        """The first impacts of the selected rows, each once."""
        impacts = (self.rows.impacts[row] for row in self.selected)
        return list(dict.fromkeys(impact for impact in impacts if impact is not None))[:most]

    def figures(self) -> Sequence[Figure]:
        """The chart."""
        return (self.drawn.figure(),)

    def figure(self) -> Plot | PlotGrid:
        """The chart."""
        return self.drawn.figure()

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the chart; of a control chart its individual values.

        Parameters:
            ax: Axes of matplotlib; by default those of a new figure.
        """
        from ...figures.matplotlib_renderer import plot_on

        return plot_on(self.drawn.plots[0], ax)

    def to_frame(self) -> pd.DataFrame:
        """All drawn rows as a pandas DataFrame, or the selected ones where some are selected."""
        from ...common.frames import frame_of

        places = self.selected if self.request.has_selection else self.data.rows.tolist()
        return frame_of([self._row(row) for row in places], list(self.rows.columns))

    def to_json(self) -> dict[str, Any]:
        """The quantities, the numbers, and the selected rows."""
        data = self.data
        axes = {
            name: None if column is None else column.key
            for name, column in (("x", data.x), ("y", data.y), ("colour", data.colour))
        }
        answer: dict[str, Any] = {
            "subject": self.request.subject,
            "kind": data.kind,
            **axes,
            **self.facts,
            "groups": [dict(row) for row in self.summaries],
            "levels": list(data.levels),
        }
        if data.control is not None:
            answer |= {"limits": dict(self.limits), "broken_rules": self.broken_rules()}
        if self.request.has_selection:
            answer["selected_rows"] = self.selected_rows()
        plain: dict[str, Any] = finite(answer)
        return plain

    def write_figure(self, path: Path) -> None:
        """Draw the chart into a file of the format that its ending says."""
        from ...figures.matplotlib_renderer import write_figure

        write_figure(self.figure(), path)


def _ending(key: str) -> str:
    """The unit at the end of a quantity's key, of which other numbers in its unit take it."""
    entry = unit_ending(key)
    return "" if entry is None else entry.ending
