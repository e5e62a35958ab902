"""The shock response spectrum of any recording alone, without a store: of a file, or of a series of
numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, model_validator

from ....schema.person_roles import READER
from ...common.frames import parse_quantity
from ..fields import Names, Presentation, Recorded, quantity, request_field, text_file
from ..laboratory import Laboratory
from ..operation import Operation, Output, PlainData, Progress, Request, Result, ResultTable

if TYPE_CHECKING:
    from ....twin.srs.target import Target
    from ...figures.figure import Figure
    from .spectra import MeasuredSpectrum

_Q = Annotated[float, Field(gt=0.5)]


def _rate(value: Any, info: ValidationInfo) -> Any:
    """Hertz of a number, or of a text with or without a unit."""
    if value is None:
        return None
    try:
        rate_hz = float(value)
    except (TypeError, ValueError):
        rate_hz = parse_quantity(str(value), "Hz", str(info.field_name))
    if not 0.0 < rate_hz < math.inf:
        raise ValueError(f"{info.field_name} is {value!r}; expected a number above zero, in hertz")
    return rate_hz


def _lines(text: str, info: ValidationInfo) -> str:
    from .spectra import parse_lines

    parse_lines(text, str(info.field_name))
    return text


def _rest(text: str, info: ValidationInfo) -> str:
    from .record_choice import parse_rest

    parse_rest(text, str(info.field_name))
    return text


class SpectrumChoice(Request):
    """The channel, the oscillators, and what spectra are held against."""

    channel: str | None = request_field(
        None,
        max_length=1000,
        help="Name the channel. [default: every acceleration; of a file, the only one]",
        presentation=Presentation(metavar="NAME"),
    )
    q: _Q | None = request_field(
        None, help="Set Q of the oscillators of the spectrum. [default: 10]"
    )
    specification: text_file(262_144) | None = request_field(  # type: ignore[valid-type]
        None,
        help="Compare with the spectrum of a CSV file, with columns frequency_hz and level_g or "
        "level_m_s2.",
        presentation=Presentation(metavar="SPEC.csv", lines=8, option="target"),
    )
    tolerance: str | None = request_field(
        None,
        max_length=100,
        help="Set the tolerance: 6dB, +9/-6dB, or the whole rule of a standard: nasa-std-7003, "
        "mil-std-810h-517, ecss-e-hb-32-25a. [default: that of the target, else nasa-std-7003]",
        presentation=Presentation(metavar="BAND"),
    )

    def target(self) -> Target | None:
        """The specification. Raises `ValueError` for one that cannot be used."""
        from .spectra import target_of_file

        text = self.specification
        return None if text is None else target_of_file(text, self.tolerance)


class RecordPart(Request):
    """What of a record a spectrum is made of."""

    rest: Annotated[str, Field(max_length=60), AfterValidator(_rest)] | None = request_field(
        None,
        help="Take the mean between two times (0ms:5ms) for the zero of the record, or zero as it "
        "was recorded (none). [default: the rest before the shock, where there is one]",
        presentation=Presentation(metavar="none|FROM:TO"),
    )
    hit: str | None = request_field(
        None,
        max_length=20,
        help="Choose one hit of a record that holds several, or take the record as one shock "
        "(whole).",
        presentation=Presentation(metavar="N|whole"),
    )


class RecordingSpectrum(SpectrumChoice, RecordPart):
    """A recording in a file, and how its spectrum is computed."""

    file: Recorded = request_field(
        help="Give the recording; a text is that of a CSV file.",
        presentation=Presentation(positional=True, metavar="FILE", label="Recording"),
    )
    unit: str | None = request_field(
        None,
        max_length=200,
        help="Give the unit if the file has none: g, m/s2 and so on.",
        presentation=Presentation(metavar="UNIT"),
    )
    rate: Annotated[float, BeforeValidator(_rate)] | None = request_field(
        None,
        help="Give the sampling rate if the file has neither rate nor time, such as 51200 or "
        "51.2kHz.",
        presentation=Presentation(metavar="HZ"),
    )
    uneven_time: Literal["refuse", "resample"] = request_field(
        "refuse",
        help="Refuse a record whose time steps are uneven, or resample it and state the error.",
    )
    harmless_fields: Names = request_field(
        (),
        max_length=1000,
        help="Name a field of the file that changes no number (a pattern such as 'Trigger*'; give "
        "it several times).",
        presentation=Presentation(metavar="NAME", option="harmless-field"),
    )
    frequencies: Annotated[str, AfterValidator(_lines)] | None = request_field(
        None,
        max_length=20_000,
        help="Set the frequencies in Hz: 100,200,500 or low:high:per_octave. [default: 6 per "
        "octave]",
        presentation=Presentation(metavar="LINES"),
    )
    damping: Annotated[float, Field(gt=0, lt=1)] | None = request_field(
        None, help="Give the damping ratio in place of Q, such as 0.05."
    )
    resample: bool = request_field(
        True,
        help="Resample the record band-limited where its content requires it, or take it as it is.",
    )
    full_scale: quantity("m/s**2") | None = request_field(  # type: ignore[valid-type]
        None,
        help="Give the full scale of the sensor, such as 5000g, so that clipping is detected.",
        example="5000g",
        presentation=Presentation(metavar="VALUE", option="range"),
    )

    @model_validator(mode="after")
    def _agrees(self) -> RecordingSpectrum:
        if self.q is not None and self.damping is not None:
            raise ValueError("--q and --damping say the same thing; expected one of them")
        if self.tolerance is not None and self.specification is None:
            raise ValueError("--tolerance goes with --target SPEC.csv")
        return self

    def damping_ratio(self) -> float:
        """Of the oscillators."""
        return self.damping if self.damping is not None else 1 / (2 * (self.q or 10.0))


@dataclass(frozen=True, eq=False)
class MeasuredRecording(Result):
    """The spectrum of a recording, and the specification that it is held against."""

    measured: MeasuredSpectrum
    specification: Target | None

    @property
    def exit_code(self) -> int:
        """1 where the specification is missed."""
        comparison = self.measured.comparison
        return 0 if comparison is None or comparison.met else 1

    def notes(self) -> Sequence[str]:
        """That a verdict is one on part of a specification."""
        if self.measured.comparison is None or self.specification is None:
            return ()
        lines, specified = self.measured.comparison.frequency_hz, self.specification.frequency_hz
        sixth_of_octave = 1.13
        if (
            lines.min() <= specified[0] * sixth_of_octave
            and lines.max() >= specified[-1] / sixth_of_octave
        ):
            return ()
        return (
            f"compared from {lines.min():g} to {lines.max():g} Hz only; the "
            f"target: {specified[0]:g} to {specified[-1]:g} Hz",
        )

    def tables(self) -> Sequence[ResultTable]:
        """Channel, moments and verdict; a row for each line; findings."""
        from .spectrum_tables import rows_of, summary

        findings = [
            {"check": finding.check, "severity": finding.severity, "finding": finding.message}
            for finding in self.measured.findings
        ]
        return (
            ResultTable("", [summary(self.measured)], upright=True),
            ResultTable("", rows_of(self.measured), "no lines"),
            ResultTable("checks", findings, "  no findings"),
        )

    def figures(self) -> Sequence[Figure]:
        """Spectrum and record."""
        from .spectrum_tables import spectrum_figure

        return (spectrum_figure(self.measured),)

    def to_json(self) -> Any:
        """In SI, with checks, moments and verdict."""
        from .spectrum_tables import as_json

        return as_json(self.measured)


def _measure(request: RecordingSpectrum, _: Laboratory, __: Progress) -> MeasuredRecording:
    from ....ingest.readers import ReadingOptions
    from .record_choice import parse_rest
    from .spectra import measure, parse_lines, read_acceleration

    specification = request.target()
    reading = ReadingOptions(
        sampling_rate_hz=request.rate,
        harmless_fields=request.harmless_fields,
        resample_uneven_time=request.uneven_time == "resample",
    )
    with request.file.as_path() as path:
        acceleration = read_acceleration(path, request.channel, request.unit, reading)
    lines = request.frequencies
    measured = measure(
        acceleration,
        None if lines is None else parse_lines(lines, "--frequencies"),
        request.damping_ratio(),
        target=specification,
        resample=request.resample,
        range_m_s2=request.full_scale,
        rest=parse_rest(request.rest, "--rest"),
        hit=request.hit,
    )
    return MeasuredRecording(measured, specification)


def _write(result: MeasuredRecording, path: Path) -> None:
    from .spectrum_tables import write_spectrum

    write_spectrum(result.measured, path)


SRS: Operation[RecordingSpectrum, MeasuredRecording] = Operation(
    name="srs",
    request=RecordingSpectrum,
    run=_measure,
    help="""Compute the shock response spectrum of FILE, with checks and moments.

FILE is a recording (.mat .csv .txt .parquet .tdms .uff .lvm .h5 .npz .npy .wav). The exit code is 1
if the target is missed: a line outside of its tolerance, or another rule of the standard that is
not met.""",
    example="""pyroshock srs examples/rehearsal/recordings/0001-01.h5 --channel acceleration_1 \\
    --unit g --out spec.csv --plot shot.png""",
    route=("POST", "/srs/recording"),
    outputs=(
        Output(
            "plot", "Draw spectrum and record into FILE (.png, .svg, .pdf).", Result.write_figure
        ),
        Output(
            "out",
            "Write the spectrum to FILE, which `tune` can take as a target.",
            _write,
            (".csv",),
        ),
    ),
    uses_store=False,
    answered_here=True,
    label=lambda request: f"of {request.file.name}",
)


#: What a spectrum has beside its frequencies.
SIDES = ("maximax", "positive", "negative", "primary", "residual", "pseudo_velocity_m_s")
_Reading = Annotated[float, Field(ge=-1e12, le=1e12)]


class SeriesSpectrum(RecordPart):
    """An acceleration in m/s2 at a constant rate."""

    acceleration_m_s2: tuple[_Reading, ...] = request_field(
        min_length=2, max_length=50_000, help="Give the acceleration in m/s2."
    )
    sampling_rate_hz: Annotated[float, Field(ge=1e-3, le=1e9)] = request_field(
        help="Give the sampling rate."
    )
    frequency_hz: tuple[Annotated[float, Field(ge=1e-6, le=1e9)], ...] = request_field(
        min_length=1, max_length=1000, help="Give the frequencies of the spectrum."
    )
    q: Annotated[_Q, Field(le=1000)] = request_field(
        10.0, help="Set Q of the oscillators of the spectrum."
    )


def _of_series(request: SeriesSpectrum, _: Laboratory, __: Progress) -> PlainData:
    import numpy as np

    from ....signals.record_rest import without_rest
    from ....signals.srs.spectrum import shock_response_spectrum
    from .record_choice import chosen_part, parse_rest

    record = np.asarray(request.acceleration_m_s2, dtype=np.float64)
    rate_hz = request.sampling_rate_hz
    lines = np.asarray(request.frequency_hz, dtype=np.float64)
    samples, part = chosen_part(record, rate_hz, 0.0, request.hit, "hit")
    shock, removed = without_rest(
        record[samples], rate_hz, samples.start / rate_hz, parse_rest(request.rest, "rest")
    )
    spectrum = shock_response_spectrum(shock, rate_hz, lines, q=request.q)
    return PlainData(
        {
            "unit": "m/s2",
            "frequency_hz": lines.tolist(),
            **{name: getattr(spectrum, name).tolist() for name in (*SIDES, "sampling_error")},
            "part": part,
            "rest": vars(removed),
        }
    )


SERIES_SPECTRUM: Operation[SeriesSpectrum, PlainData] = Operation(
    name="series-spectrum",
    role=READER,
    unrecorded=True,
    request=SeriesSpectrum,
    run=_of_series,
    help="The spectrum of a series, in the form of `pyroshock srs --json` without its checks.",
    route=("POST", "/srs"),
    uses_store=False,
    absent={
        "command": "`pyroshock srs` takes a file.",
        "form": "A page takes a file: /ask/srs.",
        "python": "`pyroshock.srs` takes arrays, Series and DataFrames.",
    },
)
