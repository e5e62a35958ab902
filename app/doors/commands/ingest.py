"""`ingest`: campaign folders into the store. `extract`: pulses extracted again from the stored
series. `calibrate`: points of a transducer's static calibration to its sensitivity and offset, with
their uncertainty."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from ....ingest.errors import enumerated
from ...common.frames import parse_quantity
from ...common.progress import progress_bar
from ..command_line.common import (
    STDOUT,
    db_option,
    errors_as_one_line,
    jobs_option,
    json_option,
    note,
    open_command_store,
    open_for_dry_run,
    print_table,
    worker_options,
    write_json,
)
from ..command_line.completion import campaign_names, plan_names
from ..command_line.next_step import suggest_next

if TYPE_CHECKING:
    from ....ingest.extraction.settings import ExtractionSettings
    from ....ingest.folder.calibration_points import CalibrationPoints
    from ....parallel.executor import ExecutorConfig
    from ....signals.calibration import Calibration


Function = TypeVar("Function", bound=Callable[..., Any])

_OPTIONS = (
    click.option(
        "--segmentation",
        type=click.Choice(["walk", "mask"]),
        help="Choose how a contact is delimited. [default: walk]",
    ),
    click.option(
        "--threshold",
        type=float,
        help="Set the share of the peak at which a contact begins and ends. [default: 0.005]",
    ),
    click.option(
        "--smoothing",
        type=float,
        help="Set the csaps parameter of the spline, on the sample index. [default: 0.99]",
    ),
    click.option(
        "--refinement",
        type=int,
        help="Set the points of the fine pulse per recorded sample. [default: 10]",
    ),
    click.option(
        "--points",
        type=int,
        help="Set the number of equidistant points of the force. [default: 20]",
    ),
    click.option(
        "--event-share",
        type=float,
        help="Take as impacts what reaches this share of the largest peak of the "
        "record. [default: 0.1]",
    ),
    click.option(
        "--separation",
        "separation_s",
        metavar="SECONDS",
        help="Join contacts that are nearer than this into one impact. [default: 100ms]",
    ),
)


def settings_options(function: Function) -> Function:
    """Add the options of the extraction; those not given keep their defaults."""
    for option in reversed(_OPTIONS):
        function = option(function)
    return function


def settings_from(given: dict[str, Any]) -> ExtractionSettings:
    """Settings from the options; `ValueError` names the one that is out of bounds."""
    from ....ingest.extraction.settings import ExtractionSettings

    chosen = {key: value for key, value in given.items() if value is not None}
    if "separation_s" in chosen:
        chosen["separation_s"] = parse_quantity(chosen["separation_s"], "s", "--separation")
    return ExtractionSettings(**chosen)


@click.command()
@click.argument("folders", nargs=-1, type=click.Path(path_type=Path), metavar="FOLDER…")
@db_option
@json_option
@jobs_option("Set the number of processes that read and extract; small files need only one.")
@click.option(
    "--plan",
    default=None,
    help="Name the plan whose runs the campaign does. [default: the plan of the "
    "campaign's name, if there is one]",
    shell_complete=plan_names,
)
@click.option(
    "--free-factor",
    "free_factors",
    multiple=True,
    metavar="COLUMN",
    help=(
        "Take this column of runs.csv as a factor of its own, although its name resembles a "
        "known column. The option can be repeated."
    ),
)
@click.option(
    "--confirm",
    "confirmed",
    multiple=True,
    metavar="RULE",
    help=(
        "Allow rows to break this rule of what a bench can have. The message that refuses a "
        "row, or the unit of a campaign, names its rule. The option can be repeated."
    ),
)
@click.option(
    "--again",
    multiple=True,
    metavar="RECORDING",
    help=(
        "Store this recording although `runs discard` removed it. Give its path as in "
        "runs.csv. The option can be repeated."
    ),
)
@click.option(
    "--velocity-target-motion",
    "target_motion",
    type=click.Choice(["none", "plate"]),
    default="none",
    show_default=True,
    help=(
        "Add the motion of the plate under the force to velocities that are integrated from "
        "the deceleration of the impactor."
    ),
)
@click.option(
    "--dry-run",
    is_flag=True,
    help="Report what would be stored, beside what is stored now, and store nothing.",
)
@settings_options
def ingest(
    folders: tuple[Path, ...],
    db: str,
    json_to: str | None,
    jobs: int | None,
    plan: str | None,
    free_factors: tuple[str, ...],
    confirmed: tuple[str, ...],
    again: tuple[str, ...],
    target_motion: str,
    dry_run: bool,
    **given: Any,
) -> None:
    """Read campaign folders into the store, which is made if there is none.

    A recording that is already stored is not stored again, so that a second call completes a
    campaign, also after the first one was killed. A damaged recording is set aside with its reason,
    and a discarded one stays out. Runs of a plan are marked as done, and what does not match the
    plan is reported.

    \b
    Example:
        pyroshock ingest results/rehearsal/ --dry-run
        pyroshock ingest results/slow-valve/ --velocity-target-motion plate --db sqlite:///lab.db
    """
    # `--json FOLDER`: the folder is the argument, not where the JSON goes.
    if json_to not in (None, STDOUT) and Path(json_to or "").is_dir():
        folders, json_to = (Path(json_to or ""), *folders), STDOUT
    if not folders:
        raise click.UsageError("no campaign folder given; try: pyroshock ingest my-campaign/")
    reports: list[dict[str, Any]] = []
    progress = progress_bar(f"Reading {folders[0].name}", "recordings")
    with open_for_dry_run(db) if dry_run else open_command_store(db, create=True) as store:
        from ...operations.ingest.service import IngestOptions, ingest_campaign

        options = IngestOptions(
            settings_from(given), jobs, plan, free_factors, confirmed, again, target_motion, dry_run
        )
        for number, folder in enumerate(folders):
            if number:
                progress = progress_bar(f"Reading {folder.name}", "recordings")
            with progress as step:
                ingested = ingest_campaign(store, folder, options, step)
            reports.append(ingested.to_json())
            _tell(ingested.report, dry_run)
            if ingested.links is not None:
                _tell_links(ingested.links)
    if json_to is not None:
        write_json(reports[0] if len(reports) == 1 else reports, json_to)
    _suggest(folders, reports, dry_run)


def _suggest(folders: tuple[Path, ...], reports: list[dict[str, Any]], dry_run: bool) -> None:
    names = [report["campaign"] for report in reports]
    if dry_run:
        suggest_next("ingest", *map(str, folders))
    elif any(report["impacts"] for report in reports):
        suggest_next("dataset", "build", names[0], "--from", ",".join(names))
    else:
        suggest_next("diagnose", names[0])


#: What is said of the campaign once, with its words.
_TOLD_WHOLE = (
    "added-facts",
    "missing-facts",
    "velocity-differs-throughout",
    "pressure-differs-throughout",
)


def _tell_links(links: Any) -> None:
    note(f"  plan {links.plan}: {links.linked} repetitions linked, {links.done} runs done")
    for item in links.mismatches:
        note(f"  not as planned: run {item['run']}: {item['reason']}")


def _tell(report: Any, dry_run: bool) -> None:
    from ....ingest.storing.report import DISCARDED

    added, totals = report.added_words, report.total_words
    if dry_run:
        note(
            f"{report.campaign}: dry run, nothing is stored; would add "
            f"{added}; the campaign would hold {totals}"
        )
    else:
        note(f"{report.campaign}: added {added}; the campaign holds {totals}")
    if report.undeclared_factors:
        note(
            f"  free factors: {', '.join(report.undeclared_factors)} (not "
            f"declared in [factors] of campaign.toml)"
        )
    for item in report.set_aside:
        note(f"  set aside {item['recording']}: {item['reason']}")
    for item in report.findings:
        if item["check"] == DISCARDED:
            note(f"  {item['message']}")
    by_check: dict[tuple[str, str], list[str | None]] = {}
    for finding in (entry for entry in report.findings if entry["check"] != DISCARDED):
        if finding["check"] in _TOLD_WHOLE:
            note(f"  {finding['severity']}: {finding['check']}: {finding['message']}")
            continue
        by_check.setdefault((finding["severity"], finding["check"]), []).append(finding["channel"])
    for (severity, check), channels in sorted(by_check.items()):
        named = sorted({channel for channel in channels if channel is not None})
        of = f" of {enumerated(named)}" if named else ""
        note(f"  {severity}: {check} ({len(channels)}){of}")


@click.command()
@click.argument("campaign", shell_complete=campaign_names)
@worker_options("Set the number of processes that extract pulses.")
@db_option
@json_option
@settings_options
def extract(
    campaign: str, executor: ExecutorConfig, db: str, json_to: str | None, **given: Any
) -> None:
    """Extract the pulses of CAMPAIGN again from the stored series, with other settings.

    The new version of the pulses is in use from then on. The old versions stay, and `pyroshock
    show` lists them. The same settings again put their version back in use.

    \b
    Example:
        pyroshock extract rehearsal --segmentation mask --threshold 0.01
    """
    progress = progress_bar(f"Extracting the pulses of {campaign}", "recordings")
    with open_command_store(db) as store:
        from ....ingest.storing.reextraction import reextract

        settings = settings_from(given)
        with progress as step:
            report = reextract(store, campaign, settings, executor=executor, progress=step)
    note(
        f"{campaign}: {report.added} pulses extracted, {report.reused} earlier ones put back in use"
    )
    for item in report.skipped:
        note(f"  left as it was: {item['recording']}: {item['reason']}")
    if json_to is not None:
        write_json(report.as_json(), json_to)
    suggest_next("dataset", "build", campaign, "--from", campaign)


@click.command()
@click.argument("file", type=click.Path(dir_okay=False, path_type=Path))
@click.option(
    "--channel",
    default="tank_pressure",
    show_default=True,
    help="Name the channel as campaign.toml does.",
)
@click.option(
    "--quantity", default="pressure", show_default=True, help="Say what the channel measures."
)
@click.option("--unit", default="bar", show_default=True, help="Give the unit of the references.")
@click.option(
    "--date",
    "day",
    metavar="DAY",
    help="Give the date of the calibration, such as 2026-03-02. [default: today]",
)
@click.option(
    "--reference-u",
    metavar="2mbar",
    help="Give the standard uncertainty of each reference, the same for all. [default: 0]",
)
@click.option(
    "--reading-u",
    metavar="1mV",
    help="Give the standard uncertainty of each reading, the same for all. [default: 0]",
)
@click.option(
    "--common-u",
    metavar="5mbar",
    help="Give the standard uncertainty that all references share. [default: 0]",
)
@click.option(
    "--db",
    hidden=True,
    expose_value=False,
    help="This option is accepted as everywhere; nothing is read from the store.",
)
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
    """Compute sensitivity and offset of a transducer from FILE, a table of static points, with
    their uncertainty.

    The table has the columns reference (in the unit of --unit) and reading_v (in volt). Where the
    standard uncertainty differs from point to point, it has the columns reference_u and
    reading_u_v, too. The command prints a table for campaign.toml. With it, `ingest` applies the
    calibration, stores it with each recording, and gives its uncertainty to each measured tank
    pressure.

    \b
    Example:
        pyroshock calibrate examples/transducer-calibration/points.csv --unit bar --common-u 5mbar
    """
    with errors_as_one_line():
        from ....ingest.folder.calibration_points import read_points
        from ....signals.channel import Sensor
        from ....signals.units import to_si

        gain = to_si(unit, quantity)[0]

        def in_unit(text: str | None, name: str) -> float:
            from ....signals.units import SI_UNITS

            return 0.0 if text is None else parse_quantity(text, SI_UNITS[quantity], name) / gain

        reading = 0.0 if reading_u is None else parse_quantity(reading_u, "V", "--reading-u")
        points = read_points(file, in_unit(reference_u, "--reference-u"), reading)
        try:
            date = (
                dt.datetime.now().astimezone().date() if day is None else dt.date.fromisoformat(day)
            )
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
            {
                "figure": "sensitivity",
                "unit": f"V/{unit}",
                "value": line.sensitivity,
                "u": line.sensitivity_u,
            },
            {"figure": "offset", "unit": "V", "value": line.offset, "u": line.offset_u},
        ],
        "",
    )
    click.echo()
    print_table(data["points"], "")
    note(
        f"{calibration.points} points, residuals {line.residual_sd:.3g} V, "
        f"correlation of both {line.correlation:.3f}"
    )
    if line.enlarged > 1:
        note(
            f"the points scatter {line.enlarged:.3g} times as much as their uncertainties say; the "
            "uncertainties of the line were enlarged by that factor"
        )
    click.echo("\nFor campaign.toml, in place of sensitivity and offset_v of the channel:\n")
    click.echo(
        _toml(channel, calibration, file, reference_u and data["reference_u"], reading, shared)
    )


def _data(
    channel: str, unit: str, points: CalibrationPoints, calibration: Calibration
) -> dict[str, Any]:
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
        "reference_u": points.reference_u
        if isinstance(points.reference_u, float)
        else list(points.reference_u),
        "common_u": calibration.common_u,
        "points": rows,
    }


def _toml(
    channel: str,
    calibration: Calibration,
    file: Path,
    reference_u: Any,
    reading_u_v: float,
    common_u: float,
) -> str:
    lines = [
        f"[channels.{channel}.calibration]",
        f'file = "{file.name}"',
        f"date = {calibration.date}",
    ]
    stated = {"reference_u": reference_u, "reading_u_v": reading_u_v, "common_u": common_u}
    return "\n".join([*lines, *(f"{key} = {value:.6g}" for key, value in stated.items() if value)])
