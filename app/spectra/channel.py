"""The acceleration in any recording alone: which channel, and in which unit. Nothing is guessed."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from ...array_types import Floats
from ...ingest.channel_mistakes import refuse_no_reading
from ...ingest.parallel import Isolation, map_ahead
from ...ingest.readers import ChannelInfo, OpenRecording, ReadingOptions, RecordingError, may_crash, open_recording
from ...ingest.readers.contents import is_unit
from ...signals.units import UnitError, to_si

#: Of a file that crashes no library and takes no processor time: a network drive that hangs.
PATIENCE_S = 120.0

#: `accel_g`, `A1x_m_s2`: names that carry their unit as ours do.
_UNIT_IN_NAME = re.compile(r"a(?:cc\w*)?\d*[xyz]?_(g|m_s2|mm_s2)", re.IGNORECASE)
_ACCELERATION_NAME = re.compile(r"acc|a\d*[xyz]?(?:_|$)", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class Acceleration:
    """One channel of a file, in m/s2, (n,)."""

    channel: str
    values_m_s2: Floats
    sampling_rate_hz: float
    start_s: float

    @property
    def duration_s(self) -> float:
        """Of as many sampling steps as there are samples."""
        return self.values_m_s2.size / self.sampling_rate_hz


def read_acceleration(
    path: Path, channel: str | None = None, unit: str | None = None, rate_hz: float | None = None
) -> Acceleration:
    """The channel, or the only one that can be an acceleration, in SI.

    Unit and sampling rate are the file's; `unit` and `rate_hz` stand in where the file tells none. Raises
    `RecordingError` or `UnitError` with what is there and what to give. A file that may crash its library is read in a
    process of its own.
    """
    if not path.is_file() or not may_crash(path):
        return _read(path, channel, unit, rate_hz)
    isolation: Isolation[Path, Acceleration] = Isolation(_lost, lambda _: PATIENCE_S, always=True)
    ((_, reading),) = map_ahead(partial(_read, channel=channel, unit=unit, rate_hz=rate_hz), [path], 1, isolation)
    return reading


def _lost(path: Path) -> Acceleration:
    raise RecordingError(f"{path.name}: the library that reads it was crashed by it, or did not end; it is damaged")


def _read(path: Path, channel: str | None, unit: str | None, rate_hz: float | None) -> Acceleration:
    with open_recording(path, ReadingOptions(sampling_rate_hz=rate_hz)) as recording:
        info = recording.info(channel) if channel is not None else _only_acceleration(path, recording)
        gain, offset = to_si(_unit(path, info, unit), "acceleration")
        samples = recording.read(info.name)
        refuse_no_reading(path.name, info.name, samples)
        values = gain * samples.astype(np.float64) + offset
    return Acceleration(info.name, values, info.sampling_rate_hz, info.start_s)


def _said_unit(info: ChannelInfo) -> str | None:
    """What file or name tell; None where they tell nothing that is a unit."""
    if info.unit is not None and is_unit(info.unit):
        return info.unit
    match = _UNIT_IN_NAME.fullmatch(info.name)
    return None if info.unit is not None or match is None else match.group(1).lower().replace("_", "/")


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
    there = ", ".join(f"{info.name} [{info.unit or 'no unit'}]" for info in accelerations or channels)
    what = (
        f"{len(accelerations)} channels can be accelerations"
        if accelerations
        else "no channel is known to be an acceleration"
    )
    raise RecordingError(f"{path.name}: {what}; choose one by --channel: {there}")


def _unit(path: Path, info: ChannelInfo, given: str | None) -> str:
    """The unit to read the channel in. The file's word and `--unit` must agree: one of them would be wrong."""
    unit_text = _said_unit(info)
    if unit_text is None:
        if given is None:
            also = f" but {info.unit!r}" if info.unit else ""
            raise UnitError(f"{path.name}: {info.name!r} tells no unit{also}; give it, such as --unit g or --unit m/s2")
        return given
    try:
        factors = to_si(unit_text, "acceleration")
    except UnitError as error:
        raise UnitError(f"{path.name}: {info.name!r} is in {unit_text!r}, which is no acceleration") from error
    if given is not None and not np.allclose(to_si(given, "acceleration"), factors, rtol=1e-6, atol=0):
        raise UnitError(f"{path.name}: {info.name!r} is in {unit_text!r} by the file, in {given!r} by --unit")
    return unit_text
