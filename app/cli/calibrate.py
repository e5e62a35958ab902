"""`calibrate`: points of a transducer's static calibration to its sensitivity and offset, with their uncertainty."""

from __future__ import annotations

import datetime as dt
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..library.quantities import parse_quantity
from .common import errors_as_one_line, json_option, note, print_table, write_json

if TYPE_CHECKING:
    from ...ingest.calibration_points import CalibrationPoints
    from ...signals.calibration import Calibration


@click.command()
@click.argument("file", type=click.Path(dir_okay=False, path_type=Path))
@click.option("--channel", default="tank_pressure", show_default=True, help="Of campaign.toml.")
@click.option("--quantity", default="pressure", show_default=True, help="What the channel measures.")
@click.option("--unit", default="bar", show_default=True, help="Of the references.")
@click.option("--date", "day", metavar="DAY", help="Of the calibration: 2026-03-02. [today]")
@click.option("--reference-u", metavar="2mbar", help="Standard uncertainty of each reference, for all. [0]")
@click.option("--reading-u", metavar="1mV", help="Standard uncertainty of each reading, for all. [0]")
@click.option("--common-u", metavar="5mbar", help="Standard uncertainty that all references share. [0]")
@click.option("--db", hidden=True, expose_value=False, help="Taken like everywhere; nothing is looked up in it.")
@json_option
def calibrate(
    file: Path,
    channel: str,
    quantity: str,
    unit: str,
    day: str | None,
    reference_u: str | None,
    reading_u: str | None,
    common_u: str | None,
    json_to: str | None,
) -> None:
    """Sensitivity and offset of a transducer from FILE, a table of static points, with their uncertainty.

    The table has the columns reference (in the unit) and reading_v (in volt), and reference_u and reading_u_v where
    points differ in their standard uncertainty. What is printed for campaign.toml makes `ingest` apply the calibration,
    keep it with each recording and give its uncertainty to each measured tank pressure.

    \b
    Example:
        pyroshock calibrate transducer.csv --unit bar --common-u 5mbar --date 2026-03-02
    """
    with errors_as_one_line():
        from ...ingest.calibration_points import read_points
        from ...signals.channel import Sensor
        from ...signals.units import to_si

        gain = to_si(unit, quantity)[0]

        def in_unit(text: str | None, name: str) -> float:
            from ...signals.units import SI_UNITS

            return 0.0 if text is None else parse_quantity(text, SI_UNITS[quantity], name) / gain

        reading = 0.0 if reading_u is None else parse_quantity(reading_u, "V", "--reading-u")
        points = read_points(file, in_unit(reference_u, "--reference-u"), reading)
        try:
            date = dt.datetime.now().astimezone().date() if day is None else dt.date.fromisoformat(day)
        except ValueError as error:
            raise ValueError(f"--date is {day!r}; expected a day such as 2026-03-02") from error
        shared = in_unit(common_u, "--common-u")
        calibration = points.calibration(date, shared)
        sensor = Sensor(channel, quantity, unit)
    data = _data(sensor.name, unit, points, calibration)
    if json_to is not None:
        write_json(data, json_to)
        return
    line = calibration.line
    print_table(
        [
            {"figure": "sensitivity", "unit": f"V/{unit}", "value": line.sensitivity, "u": line.sensitivity_u},
            {"figure": "offset", "unit": "V", "value": line.offset, "u": line.offset_u},
        ],
        "",
    )
    click.echo()
    print_table(data["points"], "")
    note(f"{calibration.points} points, residuals {line.residual_sd:.3g} V, correlation of both {line.correlation:.3f}")
    if line.enlarged > 1:
        note(
            f"the points scatter {line.enlarged:.3g} times as much as their uncertainties say; the uncertainties of "
            "the line were enlarged by that factor"
        )
    click.echo("\nFor campaign.toml, in place of sensitivity and offset_v of the channel:\n")
    click.echo(_toml(channel, calibration, file, reference_u and data["reference_u"], reading, shared))


def _data(channel: str, unit: str, points: CalibrationPoints, calibration: Calibration) -> dict[str, Any]:
    line = calibration.line
    rows = [
        {
            "reference": reference,
            "reading_v": reading,
            "shown": (shown := (reading - line.offset) / line.sensitivity),
            "residual": shown - reference,
            "calibration_u": calibration.uncertainty(shown),
        }
        for reference, reading in zip(points.reference, points.reading_v, strict=True)
    ]
    return {
        "channel": channel,
        "unit": unit,
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
        "reference_u": points.reference_u if isinstance(points.reference_u, float) else list(points.reference_u),
        "common_u": calibration.common_u,
        "points": rows,
    }


def _toml(
    channel: str, calibration: Calibration, file: Path, reference_u: Any, reading_u_v: float, common_u: float
) -> str:
    lines = [f"[channels.{channel}.calibration]", f'file = "{file.name}"', f"date = {calibration.date}"]
    stated = {"reference_u": reference_u, "reading_u_v": reading_u_v, "common_u": common_u}
    return "\n".join([*lines, *(f"{key} = {value:.6g}" for key, value in stated.items() if value)])
