"""One recording, from file to everything that will be stored of it, without a database.

Pure in the file and the settings, so that it can run in any process, before any lock is taken.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..schema.series import EncodedSeries, encode_series
from .channel import Channel, Sensor
from .channel_figures import ImpactFigures, measure_channels
from .derived_force import PlateResponse, derived_force
from .gunshot import ShotMeasurement, measure_shot
from .hit_findings import hits_without_row, touches_before
from .impact_speed import ImpactSpeed, impact_speeds
from .magnitude import refuse_no_reading
from .pulses import Hits, Pulse, find_hits
from .quality import run_checks
from .quality.base import Finding
from .quality.recording import judge_together
from .readers import RecordingError, open_recording, reader_for
from .settings import ExtractionSettings
from .units import UnitError, to_si


@dataclass(frozen=True)
class StoredSeries:
    """A channel without its samples, which are heavy to hand from process to process, and their compressed frames."""

    channel: Channel  # `recorded` is empty, of the samples' dtype
    encoded: EncodedSeries

    @classmethod
    def of(cls, channel: Channel) -> StoredSeries:
        recorded = channel.recorded
        return cls(replace(channel, recorded=recorded[:0].copy()), encode_series(recorded))


@dataclass(frozen=True)
class ProcessedRecording:
    """What a file gave. `speeds` has one entry per pulse (None where no impactor acceleration was recorded), `figures`
    one per impact (of its acceleration channels), in the order of time."""

    path: str
    sha256: str
    size_bytes: int
    format: str
    series: tuple[StoredSeries, ...]
    pulses: tuple[Pulse, ...]
    speeds: tuple[ImpactSpeed | None, ...]
    shot: ShotMeasurement | None
    findings: tuple[Finding, ...]
    has_force: bool
    figures: tuple[ImpactFigures, ...] = ()

    def without_samples(self) -> ProcessedRecording:
        """The same without the frames of its series: all that a dry run writes."""
        series = (replace(each, encoded=replace(each.encoded, frames=[])) for each in self.series)
        return replace(self, series=tuple(series))


def file_hash(path: Path) -> str:
    """SHA-256 of a file, read in pieces. Raises `RecordingError` when it cannot be read."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise RecordingError(f"{path.name}: cannot be read: {error.strerror}") from error


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
    plate: PlateResponse | None = None,
) -> ProcessedRecording:
    """Read `folder`/`path`, judge it, cut out its pulses and measure its accelerations.

    `rows` of runs.csv name it; `expected`: hits of the force to keep. Raises `RecordingError` when it cannot be read
    whole. `plate`: the contact force is derived from the accelerations.
    """
    file = folder / path
    digest = sha256 or file_hash(file)
    channels, unread = read_channels(file, sensors)
    if plate is not None:
        derived, said_of_it = derived_force(channels, plate, settings)
        channels += [derived] if derived is not None else []
        unread.append(said_of_it)
    hits = hits_of(channels, settings, expected)
    pulses = hits.pulses
    force = total_force(channels)
    speeds, conditioning = impact_speeds(channels, pulses, settings, force[0] if force else None)
    shot, shot_findings = measure_shot(channels, bullet_length_m, bullet_length_u_m)
    figures = measure_channels(channels, hits, rows, settings)
    findings = judged(channels, hits) + unread + conditioning + shot_findings + list(figures.findings)
    return ProcessedRecording(
        path=path,
        sha256=digest,
        size_bytes=file.stat().st_size,
        format=reader_for(file).format,
        series=tuple(StoredSeries.of(c) for c in channels),
        pulses=pulses,
        speeds=speeds,
        shot=shot,
        findings=tuple(findings),
        has_force=any(c.quantity == "force" for c in channels),
        figures=figures.impacts,
    )


def read_channels(file: Path, sensors: Mapping[str, Sensor]) -> tuple[list[Channel], list[Finding]]:
    """The declared channels of a file, and a note for each that nobody declared."""
    with open_recording(file) as recording:
        if not sensors:
            raise RecordingError(f"{file.name}: campaign.toml declares no [channels.NAME] to read from it")
        channels = []
        for name, sensor in sensors.items():
            info = recording.info(name)
            _check_unit(file, sensor, info.unit)
            samples = recording.read(name)
            refuse_no_reading(file.name, name, samples)
            channels.append(Channel(sensor, samples, info.sampling_rate_hz, info.start_s, info.header))
        unread = [
            Finding("undeclared-channel", "note", f"channel {c.name!r} is in the file but not in campaign.toml", c.name)
            for c in recording.channels
            if c.name not in sensors
        ]
        if any(c.header.get("last_line_without_end") for c in recording.channels):
            message = "the file's last line has no line end: its last number may be cut"
            unread.append(Finding("unfinished-file", "note", message, channels[-1].name))
    return channels, unread


def _check_unit(file: Path, sensor: Sensor, written: str | None) -> None:
    """Refuse a file whose own unit contradicts campaign.toml: one of them is wrong, and we cannot know which."""
    if not written or not written.strip():
        return
    expected_unit, quantity = ("V", "voltage") if sensor.sensitivity is not None else (sensor.unit, sensor.quantity)
    try:
        declared = to_si(expected_unit, quantity)
    except UnitError:
        return
    try:
        found = to_si(written, quantity)
    except UnitError as error:
        if "unknown" in str(error) or "unreadable" in str(error):
            return  # a spelling that nobody knows contradicts nothing
        found = None
    if found is None or not np.allclose(found, declared, rtol=1e-6, atol=0):
        raise RecordingError(
            f"{file.name}: channel {sensor.name!r} is in {written!r} by the file, in {expected_unit!r} by campaign.toml"
        )


def total_force(channels: list[Channel]) -> tuple[NDArray[np.float64], Channel] | None:
    """The contact force: the force channel, or the sum of a load-cell array's (thesis, section 2.2.1)."""
    forces = [c for c in channels if c.quantity == "force"]
    if not forces:
        return None
    first = forces[0]
    if len(forces) == 1:
        return first.si, first
    for other in forces[1:]:
        if other.recorded.size != first.recorded.size or other.sampling_rate_hz != first.sampling_rate_hz:
            raise RecordingError(
                f"force channels {first.name!r} and {other.name!r} differ in length or rate; expected one array's"
            )
    return np.sum([c.si for c in forces], axis=0), first


def hits_of(channels: list[Channel], settings: ExtractionSettings, expected: int | None) -> Hits:
    """The pulses, and the hits of the same record that were left out because `expected` are fewer."""
    force = total_force(channels)
    if force is None:
        return Hits(())
    values, channel = force
    return find_hits(values, channel.sampling_rate_hz, settings, start_s=channel.start_s, expected=expected)


def judged(channels: list[Channel], hits: Hits) -> list[Finding]:
    """What the checks find on the channels of one recording and in its pulses, each event once."""
    contacts = tuple(pulse.contact for pulse in hits.pulses)
    found = [finding for channel in channels for finding in run_checks(channel, contacts)]
    return judge_together(channels, found + _pulse_findings(channels, hits))


def _pulse_findings(channels: list[Channel], hits: Hits) -> list[Finding]:
    """What the extraction itself noticed: no contact, a hit without a row or before another one, a contact cut by the
    record's end, a raised threshold."""
    name = next((c.name for c in channels if c.quantity == "force"), None)
    if name is None:
        return []
    if not hits.pulses:
        return [Finding("no-contact", "reject", "no contact rises above the noise of the force", name)]
    found = hits_without_row(hits, name)
    for i, pulse in enumerate(hits.pulses):
        found += touches_before(pulse, i, name)
        if pulse.truncated:
            message = "the record begins or ends inside the contact"
            found.append(Finding("truncated-contact", "reject", message, name, {"start_s": pulse.start_s}, i))
        if pulse.threshold_raised:
            message = "noise lies above the extraction's threshold, which was raised: the contact is cut short"
            found.append(Finding("threshold-raised", "note", message, name, {"start_s": pulse.start_s}, i))
    return found
