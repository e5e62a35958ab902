"""One recording, from file to everything that will be stored of it, without a database.

Pure in the file and the settings, so that it can run in any process, before any lock is taken.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..schema.series import EncodedSeries, encode_series
from ..signals.channel import Channel, Sensor
from ..signals.checks import run_checks
from ..signals.checks.base import Finding
from ..signals.checks.recording import check_recording_channels
from ..signals.units import UnitError, to_si
from .channel_figures import ImpactFigures, measure_channels
from .channel_mistakes import check_force_sign, refuse_no_reading
from .column_names import resembled_channel
from .common_grid import GridError, contacts_on, on_one_grid, with_numbers
from .derived_force import TransferFunctions, derived_force
from .gunshot import ShotMeasurement, laser_channel, measure_shot
from .impact_speed import ImpactSpeed, impact_speeds
from .pulses import ExtractedPulse, Hits, find_hits
from .readers import AS_IN_FILE, OpenRecording, ReadingOptions, RecordingError
from .recording_files import RecordingFiles
from .runs import hits_without_row, touches_before
from .settings import ExtractionSettings

#: A channel that a recording does without; it has no row, so that the finding's evidence names it.
MISSING = "missing-channel"
#: The key of a stored header of the tank's pressure; no instrument writes it.
VALVE_OPENING = "pyroshock_valve_opening"
#: The key of a stored header of the laser.
MUZZLE_VELOCITY = "pyroshock_muzzle_velocity"


@dataclass(frozen=True)
class StoredSeries:
    """A channel without its samples, which are heavy to hand from process to process, and their
    compressed frames."""

    channel: Channel  # `recorded` is empty, of the samples' dtype
    encoded: EncodedSeries

    @classmethod
    def of(cls, channel: Channel) -> StoredSeries:
        recorded = channel.recorded
        return cls(replace(channel, recorded=recorded[:0].copy()), encode_series(recorded))


@dataclass(frozen=True)
class ProcessedRecording:
    """What a file gave. `speeds` has one entry per pulse (None where no impactor acceleration was
    recorded), `figures` one per impact (of its acceleration channels), in the order of time."""

    path: str
    sha256: str
    size_bytes: int
    format: str
    series: tuple[StoredSeries, ...]
    pulses: tuple[ExtractedPulse, ...]
    speeds: tuple[ImpactSpeed | None, ...]
    shot: ShotMeasurement | None
    findings: tuple[Finding, ...]
    has_force: bool
    figures: tuple[ImpactFigures, ...] = ()

    def without_samples(self) -> ProcessedRecording:
        """The same without the frames of its series: all that a dry run writes."""
        series = (
            replace(stored, encoded=replace(stored.encoded, frames=[])) for stored in self.series
        )
        return replace(self, series=tuple(series))


def process_recording(
    folder: Path,
    path: str,
    sensors: Mapping[str, Sensor],
    settings: ExtractionSettings,
    *,
    expected: int | None = None,
    rows: int = 1,
    bullet_length_m: float | None = None,
    bullet_length_u_m: float | None = None,
    sha256: str | None = None,
    reading: ReadingOptions = AS_IN_FILE,
    plate: TransferFunctions | None = None,
) -> ProcessedRecording:
    """Read the files of `path` in `folder`, judge them, cut out their pulses and measure their
    accelerations.

    `rows` of runs.csv name it; `expected`: hits of the force to keep. `plate`: the contact force is
    derived from the accelerations. Raises `RecordingError` when one of the files cannot be read
    whole.
    """
    files = RecordingFiles(folder, path, reading)
    digest = sha256 or files.sha256()
    channels, unread = read_recording(files, sensors)
    if plate is not None:
        derived, remark = derived_force(channels, plate, settings)
        channels += [derived] if derived is not None else []
        unread.append(remark)
    hits = hits_of(channels, settings, expected)
    pulses = hits.pulses
    force = total_force(channels)
    speeds, conditioning = impact_speeds(channels, pulses, settings, force)
    shot, shot_findings = measure_shot(channels, bullet_length_m, bullet_length_u_m)
    figures = measure_channels(channels, hits, rows, settings)
    findings = (
        check_recording(channels, hits)
        + unread
        + conditioning
        + shot_findings
        + list(figures.findings)
    )
    return ProcessedRecording(
        path=path,
        sha256=digest,
        size_bytes=files.size_bytes,
        format=files.format,
        series=tuple(StoredSeries.of(c) for c in _with_readings(channels, shot)),
        pulses=pulses,
        speeds=speeds,
        shot=shot,
        findings=tuple(findings),
        has_force=any(c.quantity == "force" for c in channels),
        figures=figures.impacts,
    )


def _with_readings(channels: Sequence[Channel], shot: ShotMeasurement | None) -> list[Channel]:
    """The channels as they are stored: the header of the tank's pressure says when the valve
    opened, and the laser's which velocity it shows, which a row of runs.csv may state otherwise."""
    if shot is None:
        return list(channels)
    added: dict[str, dict[str, object]] = {}
    if shot.valve_opening is not None:
        tank = next(channel.name for channel in channels if channel.quantity == "pressure")
        added[tank] = {VALVE_OPENING: asdict(shot.valve_opening)}
    laser = laser_channel(list(channels))
    if laser is not None and shot.velocity_m_s is not None:
        velocity = {"velocity_m_s": shot.velocity_m_s, "velocity_u_m_s": shot.velocity_u_m_s}
        added.setdefault(laser.name, {})[MUZZLE_VELOCITY] = velocity
    return [
        replace(c, header={**c.header, **added[c.name]}) if c.name in added else c for c in channels
    ]


def read_channels(
    file: Path, sensors: Mapping[str, Sensor], reading: ReadingOptions = AS_IN_FILE
) -> tuple[list[Channel], list[Finding]]:
    """The declared channels of a file, a warning for each that it lacks, and a note for each that
    nobody declared.

    Raises `RecordingError` for a file that has none of them, lacks a force channel, or has one in
    another spelling.
    """
    return read_recording(RecordingFiles(file.parent, file.name, reading), sensors)


def read_recording(
    files: RecordingFiles, sensors: Mapping[str, Sensor]
) -> tuple[list[Channel], list[Finding]]:
    """`read_channels` of a recording's files together."""
    file = files.name
    with files.open() as recording:
        if not sensors:
            raise RecordingError(
                f"{file}: campaign.toml declares no [channels.NAME] to read from it"
            )
        declared = {recording.info(name).name for name in sensors if recording.names(name)}
        undeclared = [
            channel.name for channel in recording.channels if channel.name not in declared
        ]
        missing = _missing_channels(recording, sensors, undeclared)
        channels = []
        for name, sensor in sensors.items():
            if name in missing:
                continue
            info = recording.info(name)
            _check_unit(file, sensor, info.unit)
            samples = recording.read(name)
            refuse_no_reading(file, name, samples)
            channels.append(
                Channel(sensor, samples, info.sampling_rate_hz, info.start_s, info.header)
            )
        remarks = list(missing.values())
        remarks += [
            Finding(
                "undeclared-channel",
                "note",
                f"channel {name!r} is in the file but not in campaign.toml",
                name,
            )
            for name in undeclared
        ]
        if any(c.header.get("last_line_without_end") for c in recording.channels):
            message = "the file's last line has no line end: its last number may be cut"
            remarks.append(Finding("unfinished-file", "note", message, channels[-1].name))
    return channels, remarks


def _missing_channels(
    recording: OpenRecording, sensors: Mapping[str, Sensor], undeclared: Sequence[str]
) -> dict[str, Finding]:
    """Declared channels that a recording can do without, by name, each with its warning.

    Raises `RecordingError` where the recording cannot: its hits are found in the force, and a
    channel in another spelling would be lost without need.
    """
    missing = [name for name in sensors if not recording.names(name)]
    for name in missing:
        if len(missing) == len(sensors) or sensors[name].quantity == "force":
            recording.info(name)  # raises, and names the channels that there are
        if other := resembled_channel(name, undeclared):
            raise RecordingError(
                f"no channel {name!r}, but {other!r}, which resembles it and is not declared; "
                "correct the name in campaign.toml or in the file, or declare both"
            )
    there = ", ".join(channel.name for channel in recording.channels)
    return {
        name: Finding(
            MISSING,
            "warning",
            f"no channel {name!r}; the recording has: {there}",
            name,
            {"channel": name},
        )
        for name in missing
    }


def _check_unit(file: str, sensor: Sensor, written: str | None) -> None:
    """Refuse a file whose own unit contradicts campaign.toml: one of them is wrong, and we cannot
    know which."""
    if not written or not written.strip():
        return
    expected_unit, quantity = (
        ("V", "voltage") if sensor.sensitivity is not None else (sensor.unit, sensor.quantity)
    )
    try:
        declared = to_si(expected_unit, quantity)
    except UnitError:
        return
    try:
        written_unit = to_si(written, quantity)
    except UnitError as error:
        if "unknown" in str(error) or "unreadable" in str(error):
            return  # a spelling that nobody knows contradicts nothing
        written_unit = None
    if written_unit is None or not np.allclose(written_unit, declared, rtol=1e-6, atol=0):
        raise RecordingError(
            f"{file}: channel {sensor.name!r} is in {written!r} by the file, "
            f"in {expected_unit!r} by campaign.toml"
        )


def total_force(channels: list[Channel]) -> tuple[NDArray[np.float64], Channel] | None:
    """The contact force: the force channel, or the sum of a load-cell array's (thesis, section
    2.2.1).

    With it a channel on whose clock its samples are: the first of an array, as far as all of its
    cells were recorded.
    """
    forces = [c for c in channels if c.quantity == "force"]
    if not forces:
        return None
    first = forces[0]
    if len(forces) == 1:
        return first.readings, first
    try:
        grid = on_one_grid(forces)
    except GridError as error:
        raise RecordingError(f"force channels cannot be added: {error}") from error
    recorded = first.recorded[grid.first : grid.first + grid.values.shape[1]]
    return grid.values.sum(axis=0), replace(first, recorded=recorded, start_s=grid.start_s)


def hits_of(channels: list[Channel], settings: ExtractionSettings, expected: int | None) -> Hits:
    """The pulses, and the hits of the same record that were left out because `expected` are
    fewer."""
    force = total_force(channels)
    if force is None:
        return Hits(())
    values, channel = force
    return find_hits(
        values, channel.sampling_rate_hz, settings, start_s=channel.start_s, expected=expected
    )


def check_recording(channels: list[Channel], hits: Hits) -> list[Finding]:
    """What the checks find on the channels of one recording and in its pulses, each event once."""
    contacts = tuple(pulse.contact for pulse in hits.pulses)
    force = total_force(channels)
    findings: list[Finding] = []
    for channel in channels:
        moved = contacts_on(channel, force[1] if force else channel, contacts)
        on_channel = run_checks(channel, tuple(contact for _, contact in moved))
        findings += with_numbers(on_channel, [number for number, _ in moved])
    return check_recording_channels(channels, findings + _pulse_findings(channels, hits))


def _pulse_findings(channels: list[Channel], hits: Hits) -> list[Finding]:
    """What the extraction itself noticed: no contact, a hit without a row or before another one, a
    contact cut by the record's end, a raised threshold."""
    name = next((c.name for c in channels if c.quantity == "force"), None)
    if name is None:
        return []
    if not hits.pulses:
        return [
            Finding("no-contact", "reject", "no contact rises above the noise of the force", name)
        ]
    findings = hits_without_row(hits, name) + check_force_sign(hits.pulses, name)
    for i, pulse in enumerate(hits.pulses):
        findings += touches_before(pulse, i, name)
        if pulse.truncated:
            message = "the record begins or ends inside the contact"
            findings.append(
                Finding("truncated-contact", "reject", message, name, {"start_s": pulse.start_s}, i)
            )
        if pulse.threshold_raised:
            message = (
                "noise lies above the extraction's threshold, which was raised: "
                "the contact is cut short"
            )
            findings.append(
                Finding("threshold-raised", "note", message, name, {"start_s": pulse.start_s}, i)
            )
    return findings
