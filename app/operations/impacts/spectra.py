"""Shock response spectra of any recording alone: from a file to spectrum, moments, findings and
comparison with a target. Which channel is the acceleration, and in which unit, is never guessed."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path, PurePath
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ....array_types import Floats
from ....ingest.extraction.channels import refuse_no_reading
from ....ingest.readers import (
    AS_IN_FILE,
    ChannelInfo,
    OpenRecording,
    ReadingOptions,
    RecordingError,
    may_crash,
    open_recording,
)
from ....ingest.readers.contents import is_unit, reading_apart
from ....parallel.read_ahead import map_ahead
from ....signals.channel import Channel, Sensor
from ....signals.checks import Finding, run_checks, run_spectrum_checks
from ....signals.checks.recording import check_recording_channels
from ....signals.record_rest import BEFORE_SHOCK, RemovedRest, RestChoice, without_rest
from ....signals.srs.moments import Moments, temporal_moments
from ....signals.srs.spectrum import (
    RESAMPLED_WITHIN,
    Spectrum,
    octave_grid,
    shock_response_spectrum,
)
from ....signals.units import UnitError, to_si
from ....twin.srs.standards import parse_tolerance
from ....twin.srs.target import SpectrumComparison, Target, compare
from ....twin.srs.target_csv import target_of_csv
from ..fields import TextFile
from .record_choice import chosen_part

#: Of a file that crashes no library and takes no processor time: a network drive that hangs.
PATIENCE_S = 120.0

#: `accel_g`, `A1x_m_s2`: names that carry their unit as ours do.
_UNIT_IN_NAME = re.compile(r"a(?:cc\w*)?\d*[xyz]?_(g|m_s2|mm_s2)", re.IGNORECASE)
_ACCELERATION_NAME = re.compile(r"acc|a\d*[xyz]?(?:_|$)", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class Acceleration:
    """One channel of a file, in m/s2, (n,); `header` is what else the file says, gaps of its time
    among it."""

    channel: str
    values_m_s2: Floats
    sampling_rate_hz: float
    start_s: float
    header: dict[str, Any] = field(default_factory=dict)

    @property
    def duration_s(self) -> float:
        """Of as many sampling steps as there are samples."""
        return self.values_m_s2.size / self.sampling_rate_hz


def read_acceleration(
    path: Path,
    channel: str | None = None,
    unit: str | None = None,
    reading: ReadingOptions = AS_IN_FILE,
) -> Acceleration:
    """The channel, or the only one that can be an acceleration, in SI.

    Unit and sampling rate are the file's; `unit` and `reading` stand in where the file tells none.
    Raises `RecordingError` or `UnitError` with what is there and what to give. A file that may
    crash its library is read in a process of its own.
    """
    if not path.is_file() or not may_crash(path):
        return _read(path, channel, unit, reading)
    isolation = reading_apart(_unreadable, lambda _: PATIENCE_S, always=True)
    read = partial(_read, channel=channel, unit=unit, reading=reading)
    ((_, acceleration),) = map_ahead(read, [path], 1, isolation)
    return acceleration


def _unreadable(path: Path) -> Acceleration:
    raise RecordingError(
        f"{path.name}: the library that reads it was crashed by it, or did not end; it is damaged"
    )


def _read(
    path: Path, channel: str | None, unit: str | None, reading: ReadingOptions
) -> Acceleration:
    with open_recording(path, reading) as recording:
        info = (
            recording.info(channel) if channel is not None else _only_acceleration(path, recording)
        )
        gain, offset = to_si(_unit(path, info, unit), "acceleration")
        samples = recording.read(info.name)
        refuse_no_reading(path.name, info.name, samples)
        values = gain * samples.astype(np.float64) + offset
    return Acceleration(info.name, values, info.sampling_rate_hz, info.start_s, info.header)


def _said_unit(info: ChannelInfo) -> str | None:
    """What file or name tell; None where they tell nothing that is a unit."""
    if info.unit is not None and is_unit(info.unit):
        return info.unit
    match = _UNIT_IN_NAME.fullmatch(info.name)
    return (
        None if info.unit is not None or match is None else match.group(1).lower().replace("_", "/")
    )


def _is_acceleration(info: ChannelInfo, alone: bool) -> bool:
    unit_text = _said_unit(info)
    if unit_text is None:
        return alone or _ACCELERATION_NAME.match(info.name) is not None
    try:
        to_si(unit_text, "acceleration")
    except UnitError:
        return False
    return True


def _only_acceleration(path: Path, recording: OpenRecording) -> ChannelInfo:
    channels = recording.channels
    accelerations = [info for info in channels if _is_acceleration(info, alone=len(channels) == 1)]
    if len(accelerations) == 1:
        return accelerations[0]
    there = ", ".join(
        f"{info.name} [{info.unit or 'no unit'}]" for info in accelerations or channels
    )
    what = (
        f"{len(accelerations)} channels can be accelerations"
        if accelerations
        else "no channel is known to be an acceleration"
    )
    raise RecordingError(f"{path.name}: {what}; choose one by --channel: {there}")


def _unit(path: Path, info: ChannelInfo, given: str | None) -> str:
    """The unit to read the channel in. The file's word and `--unit` must agree: one of them would
    be wrong."""
    unit_text = _said_unit(info)
    if unit_text is None:
        if given is None:
            also = f" but {info.unit!r}" if info.unit else ""
            raise UnitError(
                f"{path.name}: {info.name!r} tells no unit{also}; give it, "
                f"such as --unit g or --unit m/s2"
            )
        return given
    try:
        factors = to_si(unit_text, "acceleration")
    except UnitError as error:
        raise UnitError(
            f"{path.name}: {info.name!r} is in {unit_text!r}, which is no acceleration"
        ) from error
    if given is not None and not np.allclose(
        to_si(given, "acceleration"), factors, rtol=1e-6, atol=0
    ):
        raise UnitError(
            f"{path.name}: {info.name!r} is in {unit_text!r} by the file, in {given!r} by --unit"
        )
    return unit_text


@dataclass(frozen=True, eq=False)
class MeasuredSpectrum:
    """All that a recording alone tells; `comparison` where there is a target.

    `acceleration` is the part that was taken, as recorded; `part` says which, `rest` what was taken
    for its zero.
    """

    acceleration: Acceleration
    part: str
    rest: RemovedRest
    spectrum: Spectrum
    moments: Moments
    findings: tuple[Finding, ...]
    comparison: SpectrumComparison | None


def measure(
    acceleration: Acceleration,
    frequency_hz: Floats | None,
    damping_ratio: float,
    *,
    target: Target | None = None,
    resample: bool = True,
    range_m_s2: float | None = None,
    rest: RestChoice = BEFORE_SHOCK,
    hit: str | None = None,
) -> MeasuredSpectrum:
    """Spectrum, moments, checks, comparison. Lines that are not given are the target's, else the
    record's own grid.

    The checks see the record as it is, spectrum and moments its part less its rest
    (`record_choice`).
    """
    values, rate, start_s = (
        acceleration.values_m_s2,
        acceleration.sampling_rate_hz,
        acceleration.start_s,
    )
    sensor = Sensor(acceleration.channel, "acceleration", "m/s2", range=range_m_s2)
    # Hits are those of the readings: a placeholder is none.
    taken, part = chosen_part(
        Channel(sensor, values, rate, start_s).readings, rate, start_s, hit, "--hit"
    )
    acceleration = replace(
        acceleration,
        values_m_s2=values[taken],
        start_s=start_s + taken.start / rate,
        header=_header_of(acceleration.header, taken),
    )
    channel = Channel(
        sensor,
        acceleration.values_m_s2,
        acceleration.sampling_rate_hz,
        acceleration.start_s,
        acceleration.header,
    )
    if frequency_hz is None and target is not None:
        frequency_hz = target.lines()
    shock, removed = without_rest(channel.readings, rate, acceleration.start_s, rest)
    spectrum = shock_response_spectrum(
        shock,
        channel.sampling_rate_hz,
        frequency_hz,
        damping_ratio=damping_ratio,
        resample_within=RESAMPLED_WITHIN if resample else None,
    )
    return MeasuredSpectrum(
        acceleration,
        part,
        removed,
        spectrum,
        temporal_moments(shock, rate, acceleration.start_s),
        tuple(
            check_recording_channels(
                [channel], run_checks(channel, ()) + run_spectrum_checks(channel, spectrum)
            )
        ),
        None if target is None else compare(spectrum.maximax, spectrum.frequency_hz, target),
    )


def _header_of(header: dict[str, Any], part: slice) -> dict[str, Any]:
    """What a file says of part of a record: its gaps are counted from the part's first sample."""
    gaps = [
        [at - part.start, lost]
        for at, lost in header.get("time_gaps", [])
        if part.start < at < part.stop
    ]
    return {**header, "time_gaps": gaps} if "time_gaps" in header else header


def parse_lines(text: str, name: str) -> NDArray[np.float64]:
    """`100,200,500` or `100:10000:6` (low:high:lines per octave, 6 by default), in Hz.

    Raises `ValueError` that says `name`, the argument or option.
    """
    try:
        if ":" in text:
            low, high, *per_octave = text.split(":")
            return octave_grid(float(low), float(high), *(int(number) for number in per_octave))
        lines = np.asarray([float(number) for number in text.split(",")])
    except (ValueError, TypeError) as error:
        reason = f" ({error})" if "expected" in str(error) else ""
        raise ValueError(
            f"{name} is {text!r}{reason}; expected Hz as 100,200,500 or "
            f"low:high:per_octave as 100:10000:6"
        ) from error
    return checked_lines(lines, name)


def checked_lines(lines: ArrayLike, name: str) -> NDArray[np.float64]:
    """The lines in Hz, rising, each once. Raises `ValueError` that says `name` for what is not
    positive."""
    values = np.asarray(lines, dtype=np.float64)
    if values.ndim != 1 or not np.all(np.isfinite(values) & (values > 0)):
        raise ValueError(f"{name} is {values.tolist()}; expected positive numbers, in Hz")
    return np.unique(values)


#: A specification has tens of break points; a measured spectrum as one has a few hundred lines.
MOST_BYTES, MOST_POINTS = 262_144, 2_000
#: Beyond these no oscillator of a bench lies, and sums over octaves have no end.
LOWEST_HZ, HIGHEST_HZ = 1e-2, 1e6
_LONGEST_NAME = 80


def target_from_upload(content: bytes | str, name: str, tolerance: str | None = None) -> Target:
    """The target in a CSV's content; `name` is what errors call it, `tolerance` such as 6dB goes
    before the file's.

    Raises `ValueError` naming file, line and value of what is wrong, and for content that is too
    large: more than `MOST_BYTES` or `MOST_POINTS`, or a frequency that is none of a bench.
    """
    source = source_name(name)
    raw = content.encode("utf-8", "replace") if isinstance(content, str) else content
    if len(raw) > MOST_BYTES:
        raise ValueError(
            f"{source}: {len(raw)} bytes; expected a specification of at most {MOST_BYTES}"
        )
    wanted = parse_tolerance(tolerance) if tolerance else None
    target = target_of_csv(raw, source, wanted)
    if target.frequency_hz.size > MOST_POINTS:
        raise ValueError(
            f"{source}: {target.frequency_hz.size} points; expected at most {MOST_POINTS}"
        )
    for hz in (float(target.frequency_hz[0]), float(target.frequency_hz[-1])):
        if not LOWEST_HZ <= hz <= HIGHEST_HZ:
            raise ValueError(
                f"{source}: frequency_hz is {hz:g}; expected {LOWEST_HZ:g} to {HIGHEST_HZ:g} Hz"
            )
    return target


def target_of_file(file: TextFile, tolerance: str | None = None) -> Target:
    """The target in a specification that a request holds; raises as `target_from_upload`."""
    return target_from_upload(file.text, Path(file.name).name, tolerance or None)


def source_name(name: str) -> str:
    """The last part of an upload's name, on one line and short: it stands in errors, and nowhere in
    a path."""
    last = PurePath(name.replace("\\", "/")).name
    return "".join(sign for sign in last if sign.isprintable())[:_LONGEST_NAME] or "specification"
