"""A selection as conditions, which lists, comparisons and further charts take."""

from __future__ import annotations

from ....schema.value_columns import KINDS
from .columns import Column
from .request import ends_of
from .result import Explored
from .rows import BEFORE_SHOT, ORDER, PREDICTED

#: Numbers that no list can be filtered by.
_UNFILTERED = (ORDER, PREDICTED, *BEFORE_SHOT, "findings")


def conditions_of_selection(explored: Explored) -> list[str] | None:
    """The conditions `FIELD>=LOW` and `FIELD<=HIGH` of a selection; None where a stretch of levels
    or of an order is selected, which no condition says."""
    request, data = explored.request, explored.data
    conditions: list[str] = []
    for text, column, in_units in (
        (request.select_x, data.x, data.kind in ("scatter", "distribution")),
        (request.select_y, data.y, True),
    ):
        if text is None or column is None:
            continue
        if not in_units or not _is_filtered(column):
            return None
        low, high = ends_of(text)
        conditions += [f"{column.key}>={low!r}", f"{column.key}<={high!r}"]
    return conditions


def _is_filtered(column: Column) -> bool:
    return column.key not in _UNFILTERED and column.numbers is not None


def is_listed(explored: Explored) -> bool:
    """Whether the lists of impacts know every quantity that the selection is on."""
    from ....schema.conditions import IMPACT_COLUMNS

    if explored.request.subject != "impacts":
        return False
    own = KINDS["impacts"].numbers
    columns = [column for column in (explored.data.x, explored.data.y) if column is not None]
    return all(column.key in IMPACT_COLUMNS or column.key not in own for column in columns)
