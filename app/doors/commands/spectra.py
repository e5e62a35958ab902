"""`srs`: the shock response spectrum of any recording alone, without a store."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...common.progress import progress_bar
from ..command_line.common import (
    errors_as_one_line,
    json_option,
    note,
    print_facts,
    print_table,
    write_json,
)

if TYPE_CHECKING:
    from ....twin.srs.target import Target
    from ...operations.impacts.spectra import MeasuredSpectrum

#: As `uneven_time` of campaign.toml has them.
REFUSE, RESAMPLE = UNEVEN_TIME = ("refuse", "resample")
_FILE = click.Path(dir_okay=False, path_type=Path)
_RATIO = click.FloatRange(0, 1, min_open=True, max_open=True)


@click.command()
@click.argument("file", type=_FILE)
@click.option(
    "--channel", metavar="NAME", help="Name the channel. [default: the only acceleration]"
)
@click.option(
    "--unit", metavar="UNIT", help="Give the unit if the file has none: g, m/s2 and so on."
)
@click.option(
    "--rate",
    metavar="HZ",
    help="Give the sampling rate if the file has neither rate nor time, such as 51200 or 51.2kHz.",
)
@click.option(
    "--uneven-time",
    type=click.Choice(UNEVEN_TIME),
    default=REFUSE,
    show_default=True,
    help="Refuse a record whose time steps are uneven, or resample it and state the error.",
)
@click.option(
    "--harmless-field",
    "harmless_fields",
    multiple=True,
    metavar="NAME",
    help="Name a field of the file that changes no number (a pattern such as "
    "'Trigger*'; give it several times).",
)
@click.option(
    "--frequencies",
    metavar="LINES",
    help="Set the frequencies in Hz: 100,200,500 or low:high:per_octave. [default: 6 per octave]",
)
@click.option(
    "--q",
    type=click.FloatRange(0.5, min_open=True),
    help="Set Q of the oscillators of the spectrum. [default: 10]",
)
@click.option("--damping", type=_RATIO, help="Give the damping ratio in place of Q, such as 0.05.")
@click.option(
    "--target",
    type=_FILE,
    metavar="SPEC.csv",
    help="Compare with the spectrum of a CSV file, with columns frequency_hz and "
    "level_g or level_m_s2.",
)
@click.option(
    "--tolerance",
    metavar="BAND",
    help=(
        "Set the tolerance: 6dB, +9/-6dB, or the whole rule of a standard: nasa-std-7003, "
        "mil-std-810h-517, ecss-e-hb-32-25a. [default: that of the target, else nasa-std-7003]"
    ),
)
@click.option(
    "--resample/--no-resample",
    default=True,
    show_default=True,
    help="Resample the record band-limited where its content requires it, or take it as it is.",
)
@click.option(
    "--rest",
    metavar="none|FROM:TO",
    help=(
        "Take the mean between two times (0ms:5ms) for the zero of the record, or zero as it was "
        "recorded (none). [default: the rest before the shock, where there is one]"
    ),
)
@click.option(
    "--hit",
    metavar="N|whole",
    help="Choose one hit of a record that holds several, or take the record as one shock (whole).",
)
@click.option(
    "--range",
    "full_scale",
    metavar="VALUE",
    help="Give the full scale of the sensor, such as 5000g, so that clipping is detected.",
)
@click.option("--plot", type=_FILE, help="Draw spectrum and record into FILE (.png, .svg, .pdf).")
@click.option(
    "--out",
    type=_FILE,
    metavar="FILE.csv",
    help="Write the spectrum to FILE, which `tune` can take as a target.",
)
@click.option(
    "--db",
    hidden=True,
    expose_value=False,
    help="This option is accepted as everywhere; nothing is read from the store.",
)
@json_option
def srs(
    file: Path,
    channel: str | None,
    unit: str | None,
    rate: str | None,
    uneven_time: str,
    harmless_fields: tuple[str, ...],
    frequencies: str | None,
    q: float | None,
    damping: float | None,
    target: Path | None,
    tolerance: str | None,
    resample: bool,
    rest: str | None,
    hit: str | None,
    full_scale: str | None,
    plot: Path | None,
    out: Path | None,
    json_to: str | None,
) -> None:
    """Compute the shock response spectrum of FILE, with checks and moments.

    FILE is a recording (.mat .csv .txt .parquet .tdms .uff .lvm .h5 .npz .npy .wav). The exit code
    is 1 if the target is missed: a line outside of its tolerance, or another rule of the standard
    that is not met.

    \b
    Example:
        pyroshock srs results/rehearsal/recordings/0001-01.npz --channel acceleration_1 --unit g
        --out spec.csv \\
            --plot shot.png
    """
    progress = progress_bar(f"Computing the spectrum of {file.name}")
    with errors_as_one_line():
        with progress:
            from ....ingest.readers import ReadingOptions
            from ...operations.impacts.record_choice import parse_rest
            from ...operations.impacts.spectra import measure, parse_lines, read_acceleration
            from ...operations.impacts.spectrum_tables import as_json, write_spectrum

            specified = _target(target, tolerance)
            reading = ReadingOptions(
                sampling_rate_hz=_rate_hz(rate),
                harmless_fields=harmless_fields,
                resample_uneven_time=uneven_time == RESAMPLE,
            )
            measured = measure(
                read_acceleration(file, channel, unit, reading),
                None if frequencies is None else parse_lines(frequencies, "--frequencies"),
                _damping_ratio(q, damping),
                target=specified,
                resample=resample,
                range_m_s2=_full_scale(full_scale),
                rest=parse_rest(rest, "--rest"),
                hit=hit,
            )
        _tell_coverage(measured, specified)
        if out is not None:
            write_spectrum(measured, out)
            note(f"spectrum: {out}")
        if plot is not None:
            from ...figures.matplotlib_renderer import write_figure
            from ...operations.impacts.spectrum_tables import spectrum_figure

            write_figure(spectrum_figure(measured), plot)
            note(f"plot: {plot}")
        if json_to is not None:
            write_json(as_json(measured), json_to)
        else:
            _print(measured)
    if measured.comparison is not None and not measured.comparison.met:
        raise click.exceptions.Exit(1)


def _damping_ratio(q: float | None, damping: float | None) -> float:
    if q is not None and damping is not None:
        raise ValueError("--q and --damping say the same thing; expected one of them")
    return damping if damping is not None else 1 / (2 * (q or 10.0))


def _target(path: Path | None, tolerance: str | None) -> Target | None:
    from ....twin.srs.standards import parse_tolerance
    from ....twin.srs.target_csv import read_target

    if path is None:
        if tolerance is not None:
            raise ValueError("--tolerance goes with --target SPEC.csv")
        return None
    return read_target(path, None if tolerance is None else parse_tolerance(tolerance))


def _tell_coverage(measured: MeasuredSpectrum, target: Target | None) -> None:
    """A verdict on half of a specification says so."""
    if measured.comparison is None or target is None:
        return
    lines, own = measured.comparison.frequency_hz, target.frequency_hz
    if lines.min() > own[0] * 1.13 or lines.max() < own[-1] / 1.13:  # a sixth of an octave
        note(
            f"compared from {lines.min():g} to {lines.max():g} Hz only; the "
            f"target: {own[0]:g} to {own[-1]:g} Hz"
        )


def _rate_hz(text: str | None) -> float | None:
    from ...common.frames import parse_quantity

    if text is None:
        return None
    try:
        rate_hz = float(text)
    except ValueError:
        rate_hz = parse_quantity(text, "Hz", "--rate")
    if not 0.0 < rate_hz < float("inf"):
        raise ValueError(f"--rate is {text!r}; expected a number above zero, in hertz")
    return rate_hz


def _full_scale(text: str | None) -> float | None:
    from ...common.frames import parse_quantity

    return None if text is None else parse_quantity(text, "m/s**2", "--range")


def _print(measured: MeasuredSpectrum) -> None:
    from ...operations.impacts.spectrum_tables import rows_of, summary

    print_facts(summary(measured))
    click.echo("")
    print_table(rows_of(measured), "no lines")
    click.echo("\nchecks")
    findings: list[dict[str, Any]] = [
        {"check": finding.check, "severity": finding.severity, "finding": finding.message}
        for finding in measured.findings
    ]
    print_table(findings, "  no findings")
