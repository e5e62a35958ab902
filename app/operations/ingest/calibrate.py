"""Sensitivity and offset of a transducer from a table of static points, with their uncertainty."""

from __future__ import annotations

import datetime as dt
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BeforeValidator, Field, ValidationInfo

from ....signals.units import SI_UNITS, to_si
from ...common.frames import si
from ..fields import Presentation, Unit, quantity, request_field, text_file
from ..laboratory import Laboratory
from ..operation import Lines, Operation, Progress, Request, Result, ResultTable

if TYPE_CHECKING:
    from ....ingest.folder.calibration_points import CalibrationPoints
    from ....signals.calibration import Calibration


def _known(name: str) -> str:
    if name not in SI_UNITS:
        raise ValueError(f"quantity is {name!r}; expected one of {', '.join(SI_UNITS)}")
    return name


def _day(value: Any) -> Any:
    if value is None or isinstance(value, dt.date):
        return value
    try:
        return dt.date.fromisoformat(value)
    except (TypeError, ValueError) as error:
        raise ValueError(f"date is {value!r}; expected a day such as 2026-03-02") from error


def _of_the_quantity(value: Any, info: ValidationInfo) -> Any:
    """A value in the SI unit of what the channel measures."""
    unit = SI_UNITS.get(info.data.get("quantity", ""))
    return value if value is None or unit is None else si(value, unit, str(info.field_name))


#: A standard uncertainty of references: a number in the SI unit of the quantity, or with its unit.
_ReferenceU = Annotated[float, BeforeValidator(_of_the_quantity), Unit("SI"), Field(ge=0)]


_ReadingU: Any = Annotated[quantity("V"), Field(ge=0)]


class TransducerPoints(Request):
    """Static points of a transducer, and what is known of them."""

    file: text_file(2_000_000) = request_field(  # type: ignore[valid-type]
        help="Read the points from this table (CSV): reference, reading_v, and where they differ "
        "from point to point reference_u and reading_u_v.",
        presentation=Presentation(positional=True, metavar="FILE", lines=10),
    )
    channel: str = request_field(
        "tank_pressure",
        min_length=1,
        max_length=200,
        help="Name the channel as campaign.toml does.",
    )
    quantity: Annotated[str, BeforeValidator(_known)] = request_field(
        "pressure", max_length=200, help="Say what the channel measures."
    )
    unit: str = request_field("bar", max_length=200, help="Give the unit of the references.")
    date: Annotated[dt.date, BeforeValidator(_day)] | None = request_field(
        None,
        help="Give the date of the calibration, such as 2026-03-02. [default: today]",
        presentation=Presentation(metavar="DAY"),
    )
    reference_u: _ReferenceU | None = request_field(
        None,
        help="Give the standard uncertainty of each reference, the same for all. [default: 0]",
        example="2mbar",
        presentation=Presentation(metavar="2mbar"),
    )
    reading_u: _ReadingU | None = request_field(
        None,
        help="Give the standard uncertainty of each reading, the same for all. [default: 0]",
        example="1mV",
        presentation=Presentation(metavar="1mV"),
    )
    common_u: _ReferenceU | None = request_field(
        None,
        help="Give the standard uncertainty that all references share. [default: 0]",
        example="5mbar",
        presentation=Presentation(metavar="5mbar"),
    )


@dataclass(frozen=True)
class CalibratedTransducer(Result):
    """The line through the points. Uncertainties stated for all references are in the channel's
    unit."""

    channel: str
    unit: str
    file: str
    points: CalibrationPoints
    calibration: Calibration
    stated_reference_u: float
    stated_reading_u_v: float

    def notes(self) -> Sequence[str]:
        """How well the points lie on the line."""
        line = self.calibration.line
        words = [
            f"{self.calibration.points} points, residuals {line.residual_sd:.3g} V, "
            f"correlation of both {line.correlation:.3f}"
        ]
        if line.enlarged > 1:
            words.append(
                f"the points scatter {line.enlarged:.3g} times as much as their uncertainties say; "
                "the uncertainties of the line were enlarged by that factor"
            )
        return words

    def tables(self) -> Sequence[ResultTable | Lines]:
        """Sensitivity and offset, the points, and the table for campaign.toml."""
        line = self.calibration.line
        figures = [
            {
                "figure": "sensitivity",
                "unit": f"V/{self.unit}",
                "value": line.sensitivity,
                "u": line.sensitivity_u,
            },
            {"figure": "offset", "unit": "V", "value": line.offset, "u": line.offset_u},
        ]
        title = "For campaign.toml, in place of sensitivity and offset_v of the channel:"
        return (
            ResultTable("", figures),
            ResultTable("points", self._point_rows()),
            Lines(title, self.campaign_lines()),
        )

    def campaign_lines(self) -> list[str]:
        """The table that campaign.toml takes."""
        stated = {
            "reference_u": self.stated_reference_u,
            "reading_u_v": self.stated_reading_u_v,
            "common_u": self.calibration.common_u,
        }
        return [
            f"[channels.{self.channel}.calibration]",
            f'file = "{self.file}"',
            f"date = {self.calibration.date}",
            *(f"{key} = {value:.6g}" for key, value in stated.items() if value),
        ]

    def to_json(self) -> dict[str, Any]:
        """The line with its uncertainties, and the points beside it."""
        calibration, line, points = self.calibration, self.calibration.line, self.points
        return {
            "channel": self.channel,
            "unit": self.unit,
            "date": calibration.date.isoformat(),
            "sensitivity_v_per_unit": line.sensitivity,
            "sensitivity_u_v_per_unit": line.sensitivity_u,
            "offset_v": line.offset,
            "offset_u_v": line.offset_u,
            "correlation": line.correlation,
            "residual_sd_v": line.residual_sd,
            "degrees_of_freedom": line.degrees_of_freedom,
            "chi_square": line.chi_square,
            "enlarged": line.enlarged,
            "reference_u": points.reference_u
            if isinstance(points.reference_u, float)
            else list(points.reference_u),
            "common_u": calibration.common_u,
            "points": self._point_rows(),
        }

    def _point_rows(self) -> list[dict[str, float]]:
        line = self.calibration.line
        return [
            {
                "reference": reference,
                "reading_v": reading,
                "shown": (shown := (reading - line.offset) / line.sensitivity),
                "residual": shown - reference,
                "calibration_u": self.calibration.uncertainty(shown),
            }
            for reference, reading in zip(self.points.reference, self.points.reading_v, strict=True)
        ]


def _calibrate(request: TransducerPoints, _: Laboratory, __: Progress) -> CalibratedTransducer:
    from ....ingest.folder.calibration_points import read_points
    from ....signals.channel import Sensor

    gain = to_si(request.unit, request.quantity)[0]
    reference_u = (request.reference_u or 0.0) / gain
    reading_u = request.reading_u or 0.0
    with request.file.as_path() as path:
        points = read_points(path, reference_u, reading_u)
    date = request.date or dt.datetime.now().astimezone().date()
    calibration = points.calibration(date, (request.common_u or 0.0) / gain)
    sensor = Sensor(request.channel, request.quantity, request.unit)
    stated = 0.0 if request.reference_u is None else _single(points.reference_u)
    name = "points.csv" if request.file.path is None else Path(request.file.path).name
    return CalibratedTransducer(
        sensor.name, request.unit, name, points, calibration, stated, reading_u
    )


def _single(uncertainty: Sequence[float] | float) -> float:
    """One that is stated for all; those of a column stand in the table already."""
    return uncertainty if isinstance(uncertainty, float) else 0.0


CALIBRATE: Operation[TransducerPoints, CalibratedTransducer] = Operation(
    name="calibrate",
    request=TransducerPoints,
    run=_calibrate,
    help="""Compute sensitivity and offset of a transducer from a table of static points, with their
uncertainty.

The table has the columns reference (in the unit of the references) and reading_v (in volt). Where
the standard uncertainty differs from point to point, it has the columns reference_u and
reading_u_v, too. The answer has a table for campaign.toml. With it, `ingest` applies the
calibration, stores it with each recording, and gives its uncertainty to each measured tank
pressure.""",
    example="pyroshock calibrate examples/transducer-calibration/points.csv --unit bar "
    "--common-u 5mbar",
    route=("POST", "/calibrate"),
    uses_store=False,
    label=lambda request: request.channel,
    answered_here=True,
)
