"""The channels of one recording, in the units that campaign.toml declares: read, refused where the
file contradicts the declaration, and its force cells added up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...signals.channel import Channel, Sensor
from ...signals.checks.base import Finding
from ...signals.units import UnitError, to_si
from ..folder.column_names import resembled_channel
from ..readers import AS_IN_FILE, OpenRecording, ReadingOptions, RecordingError
from ..readers.recording_files import RecordingFiles
from .common_grid import GridError, on_one_grid

#: A channel that a recording does without; it has no row, so that the finding's evidence names it.
MISSING = "missing-channel"


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


#: Beyond it products of three samples overflow, and every figure after them.
LARGEST = 1e100


def refuse_no_reading(file: str, channel: str, samples: NDArray[Any]) -> None:
    """Raises `RecordingError` for a finite sample beyond `LARGEST`: the file is damaged, or has
    another type."""
    if samples.dtype.kind != "f" or samples.dtype.itemsize < 8:
        return
    beyond = (np.abs(samples) > LARGEST) & np.isfinite(samples)
    if beyond.any():
        at = int(np.argmax(beyond))
        raise RecordingError(
            f"{file}: channel {channel!r} holds {samples[at]:.3g} at sample {at}; no sensor gives "
            "such a number, the file is damaged or has another type of number"
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
