"""What is asked of the store to draw one quantity against another."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, ValidationInfo, field_validator

from ..fields import Presentation, request_field, row_limit
from ..impacts.listing import Selection

Subject = Literal["impacts", "shots", "channels", "models"]
ChartKind = Literal["scatter", "distribution", "levels", "control"]
#: Selected rows that are listed, where nobody says how many, and at most.
USUAL_ROWS, MOST_ROWS = 100, 2_000
_ENDS = "two numbers with a colon between them, the smaller first, such as 0.0002:0.0005"


def ends_of(text: str) -> tuple[float, float]:
    """The two ends of a stretch of an axis: `0.0002:0.0005`. Raises `ValueError`."""
    try:
        low, high = (float(part) for part in text.split(":"))
    except ValueError as error:
        raise ValueError(f"{text!r} is no stretch of an axis; expected {_ENDS}") from error
    if not (math.isfinite(low) and math.isfinite(high) and low <= high):
        raise ValueError(f"{text!r} is no stretch of an axis; expected {_ENDS}")
    return low, high


def stretch_text(low: float, high: float) -> str:
    """Two ends as a request has them; `ends_of` reads the same numbers back."""
    return f"{float(low)!r}:{float(high)!r}"


def _stretch(value: Any, info: ValidationInfo) -> Any:
    if value is None or value == "":
        return None
    if isinstance(value, tuple | list) and len(value) == 2:
        value = f"{value[0]}:{value[1]}"
    try:
        return stretch_text(*ends_of(value if isinstance(value, str) else repr(value)))
    except ValueError as error:
        raise ValueError(f"{info.field_name} is {value!r:.80}; expected {_ENDS}") from error


#: A stretch of an axis in SI, as text, or as two numbers.
Stretch = Annotated[str, BeforeValidator(_stretch)]
_QUANTITY = Presentation(metavar="QUANTITY")


class Exploration(Selection):
    """A chart of stored rows: of what, in which way, and which of its rows are selected."""

    subject: Subject = request_field(
        "impacts",
        help="Choose the rows: impacts, shots of the gun, what acceleration channels recorded of "
        "impacts, or versions of models.",
    )
    kind: ChartKind = request_field(
        "scatter",
        help="Choose the chart: a scatter of y over x, the distribution of x, y by the levels of "
        "x, or a control chart of y in the order of recording.",
    )
    x: str | None = request_field(
        None,
        max_length=200,
        help="Give the quantity along x, such as impact_velocity_m_s. [default: depends on the "
        "rows]",
        presentation=_QUANTITY,
    )
    y: str | None = request_field(
        None,
        max_length=200,
        help="Give the quantity along y, such as peak_force_n. [default: depends on the rows]",
        presentation=_QUANTITY,
    )
    colour: str | None = request_field(
        None,
        max_length=200,
        help="Colour by this factor or quantity; a quantity of many values is divided into five "
        "ranges of equally many rows.",
        presentation=_QUANTITY,
    )
    channel: str | None = request_field(
        None,
        max_length=1000,
        help="Take the rows of this channel only, where the rows are channels.",
        presentation=Presentation(metavar="NAME"),
    )
    log_x: bool = request_field(False, help="Draw a logarithmic x axis.")
    log_y: bool = request_field(False, help="Draw a logarithmic y axis.")
    select_x: Stretch | None = request_field(
        None,
        help="Select the rows between two values on x, in SI, such as 0.5:1.2. Levels and the "
        "order of recording count: levels from 0, rows from 1.",
        presentation=Presentation(metavar="LOW:HIGH"),
    )
    select_y: Stretch | None = request_field(
        None,
        help="Select the rows between two values on y, in SI.",
        presentation=Presentation(metavar="LOW:HIGH"),
    )
    limit: row_limit(USUAL_ROWS, MOST_ROWS) = request_field(  # type: ignore[valid-type]
        USUAL_ROWS,
        validate_default=True,
        help="List at most this number of selected rows.",
    )
    view: str | None = request_field(
        None,
        max_length=200,
        help="Draw the saved view of this name; other options change it.",
        presentation=Presentation(metavar="NAME", completion="view_names"),
    )

    @field_validator("campaign", "x", "y", "colour", "channel", "view")
    @classmethod
    def _blank_is_none(cls, name: str | None) -> str | None:
        return name or None

    @property
    def has_selection(self) -> bool:
        """Whether some rows are selected."""
        return self.select_x is not None or self.select_y is not None
