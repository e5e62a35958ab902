"""NI TDMS: channels in groups, in segments that a crash or a cut can leave unfinished."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .base import ReadingOptions, RecordingError, refuse_bomb
from .contents import Array, BoundedFile, Contents, is_unit, one_line, same_unit, to_python
from .field_rules import Treatment
from .file_fields import is_harmless, refuse_unread_fields, unread_field
from .recording import ArrayReader
from .tdms_axis import Stamps, WaveformAxis, WrittenStart, on_one_clock, waveform_axis, with_stamps
from .tdms_fields import TDMS_FIELDS, UNIT_NAMES

if TYPE_CHECKING:
    import logging

    from nptdms import TdmsChannel, TdmsFile

    from .tdms_changes import PropertyHistory

_LEAD_IN_BYTES = 28
_BIG_ENDIAN = 1 << 6
_UNFINISHED = 0xFFFFFFFFFFFFFFFF


class TdmsReader(ArrayReader):
    """Scaled samples where the file holds a scaling, else the raw ones. A `.tdms_index` beside it
    is not used.

    Channels start by `wf_start_time` and `wf_start_offset`, in seconds after the earliest
    `wf_start_time` of the file. A channel of time stamps is the clock of the channels of its group
    that are as long.
    """

    format = "tdms"
    suffixes = (".tdms",)
    fields = TDMS_FIELDS

    def contents(self, path: Path, open_files: ExitStack, options: ReadingOptions) -> Contents:
        from nptdms import TdmsFile

        from .tdms_changes import PropertyHistory

        refuse_unfinished(path)
        PropertyHistory.install()
        # An open file and not a path: npTDMS would believe an old index file beside it.
        stream = open_files.enter_context(BoundedFile(path.open("rb", buffering=0)))
        with _no_compromise(path):
            file = TdmsFile.open(stream)
            open_files.callback(file.close)
            channels = [channel for group in file.groups() for channel in group.channels()]
            for part in (file, *file.groups(), *channels):
                _refuse_many_scales(path, part.properties)
            writes = _written_starts(path, file._reader)
            refuse_unread_fields(path, self.fields, file.properties, "the file", options)
            arrays = _arrays(path, file, channels, writes, options)
        return Contents(
            arrays, header={key: to_python(value) for key, value in file.properties.items()}
        )


def refuse_unfinished(path: Path) -> None:
    """Walk the segments; `RecordingError` unless each is whole and the last ends where the file
    does.

    Layout of a lead-in: tag `TDSm`, contents mask, version, length of the rest of the segment,
    length of its metadata (NI, "TDMS file format internal structure"). npTDMS would return fewer
    samples instead.
    """
    size, position = path.stat().st_size, 0
    with path.open("rb") as file:
        while position < size:
            file.seek(position)
            lead_in = file.read(_LEAD_IN_BYTES)
            if len(lead_in) < _LEAD_IN_BYTES or lead_in[:4] != b"TDSm":
                raise RecordingError(
                    f"{path.name}: no whole TDMS segment starts at byte {position} of {size}"
                )
            mask = int.from_bytes(lead_in[4:8], "little")
            length, metadata = struct.unpack(">QQ" if mask & _BIG_ENDIAN else "<QQ", lead_in[12:])
            if length == _UNFINISHED:
                raise RecordingError(
                    f"{path.name}: the segment at byte {position} was never closed by its writer"
                )
            position += _LEAD_IN_BYTES + length
            if position > size or metadata > length:
                raise RecordingError(
                    f"{path.name}: is cut: {size} bytes, and its last segment ends at {position}"
                )


def _refuse_many_scales(path: Path, properties: dict[str, Any]) -> None:
    """npTDMS makes room for as many scales as a property declares; each has properties of its
    own."""
    declared = properties.get("NI_Number_Of_Scales", 0)
    if not isinstance(declared, int) or declared > len(properties):
        raise RecordingError(
            f"{path.name}: NI_Number_Of_Scales is {declared!r}; the file describes fewer scales"
        )


@contextmanager
def _no_compromise(path: Path) -> Iterator[None]:
    """npTDMS logs what it cannot do (unknown scaling, odd chunk) and goes on; here that is a
    refusal."""
    from nptdms.log import log_manager

    def refuse(record: logging.LogRecord) -> bool:
        raise RecordingError(f"{path.name}: {one_line(record.getMessage())}")

    log_manager.console_handler.addFilter(refuse)
    try:
        yield
    finally:
        log_manager.console_handler.removeFilter(refuse)


def _written_starts(path: Path, history: PropertyHistory) -> dict[str, list[WrittenStart]]:
    """Path of a channel -> its starts, one for each segment that says another than the segment
    before.

    Raises `RecordingError` for another property in use that changes within the file.
    """
    for change in history.changes:
        if any(
            rule.matches(change.name) for rule in TDMS_FIELDS if rule.treatment is Treatment.USED
        ):
            raise RecordingError(
                f"{path.name}: {change.part} has {change.name} = "
                f"{change.earlier!r} up to sample {change.samples} and "
                f"{change.later!r} from there on; save the two parts as files of their own"
            )
    writes: dict[str, list[WrittenStart]] = {}
    for part, statements in history.starts.items():
        current: dict[str, Any] = {}
        for before, name, value in statements:
            if current.get(name) == value:
                continue
            current = {**current, name: value}
            own = writes.setdefault(part, [])
            if own and own[-1].before == before:
                own[-1] = WrittenStart(before, current)
            else:
                own.append(WrittenStart(before, current))
    return writes


def _arrays(
    path: Path,
    file: TdmsFile,
    channels: list[TdmsChannel],
    writes: dict[str, list[WrittenStart]],
    options: ReadingOptions,
) -> list[Array]:
    """Every channel but time stamps, whose group and length say whose clock they are."""
    stamps = {
        (c.group_name, len(c)): _stamps(path, c)
        for c in channels
        if c.dtype.kind == "M" and len(c) > 1
    }
    samples = [channel for channel in channels if channel.dtype.kind != "M"]
    axes = []
    for channel in samples:
        properties = {
            **file.properties,
            **file[channel.group_name].properties,
            **channel.properties,
        }
        in_use = {key: value for key, value in properties.items() if not is_harmless(key, options)}
        axis = waveform_axis(
            in_use, [] if is_harmless("wf_start_time", options) else writes.get(channel.path, [])
        )
        beside = stamps.get((channel.group_name, len(channel)))
        axes.append(axis if beside is None else with_stamps(axis, beside))
    aligned = on_one_clock(axes, [channel.name for channel in samples])
    return [
        _array(path, channel, axis, file[channel.group_name].properties, options)
        for channel, axis in zip(samples, aligned, strict=True)
    ]


def _stamps(path: Path, channel: TdmsChannel) -> Stamps:
    refuse_bomb(path, channel.name, len(channel), 16)
    with _no_compromise(path):
        return Stamps(channel.name, np.asarray(channel[:]))


def _array(
    path: Path,
    channel: TdmsChannel,
    axis: WaveformAxis,
    group: dict[str, Any],
    options: ReadingOptions,
) -> Array:
    properties = channel.properties
    unit, two_units = _unit(properties)
    rate_hz = axis.rate_hz if isinstance(axis.rate_hz, float) else None
    unread = unread_field(TDMS_FIELDS, {**group, **properties}, options, unit=unit, rate_hz=rate_hz)

    def take(start: int, stop: int) -> NDArray[Any]:
        with _no_compromise(path):
            return np.asarray(channel[start:stop])

    return Array(
        channel.name,
        (len(channel),),
        np.dtype(channel.dtype),
        take,
        group=channel.group_name,
        unit=unit,
        rate_hz=axis.rate_hz,
        start_s=axis.offset_s,
        times_s=axis.times_s,
        header={**{key: to_python(value) for key, value in properties.items()}, **axis.header},
        obstacle=axis.obstacle or two_units or unread,
    )


def _unit(properties: dict[str, Any]) -> tuple[str | None, str | None]:
    """The unit, and what is wrong where two properties say different ones."""
    by_name = {key.lower(): str(value).strip() for key, value in properties.items()}
    stated = {name: by_name.get(name.lower(), "") for name in ("unit_string", *UNIT_NAMES)}
    stated = {
        name: unit for name, unit in stated.items() if unit and unit.lower() not in ("none", "-")
    }
    if not stated:
        return None, None
    (name, unit), *others = stated.items()
    for other, text in others:
        if is_unit(unit) and is_unit(text) and not same_unit(unit, text):
            return unit, f"has {name} = {unit!r} and {other} = {text!r}; expected one unit"
    return unit, None
