"""NI TDMS: channels in groups, in segments that a crash or a cut can leave unfinished."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .base import ReadingOptions, RecordingError, rate_from_step
from .contents import RATE_NAMES, Array, BoundedFile, Contents, one_line, to_python
from .recording import ArrayReader

if TYPE_CHECKING:
    import logging

    from nptdms import TdmsChannel

_LEAD_IN_BYTES = 28
_BIG_ENDIAN = 1 << 6
_UNFINISHED = 0xFFFFFFFFFFFFFFFF


class TdmsReader(ArrayReader):
    """Scaled samples where the file holds a scaling, else the raw ones. A `.tdms_index` beside it is not used."""

    format = "tdms"
    suffixes = (".tdms",)

    def contents(self, path: Path, open_files: ExitStack, _: ReadingOptions) -> Contents:
        from nptdms import TdmsFile

        refuse_unfinished(path)
        # An open file and not a path: npTDMS would believe an old index file beside it.
        stream = open_files.enter_context(BoundedFile(path.open("rb", buffering=0)))
        with _no_compromise(path):
            file = TdmsFile.open(stream)
            open_files.callback(file.close)
            channels = [(group, channel) for group in file.groups() for channel in group.channels()]
            above = [{**file.properties, **group.properties} for group, _ in channels]
            for part in (file, *file.groups(), *(channel for _, channel in channels)):
                _refuse_many_scales(path, part.properties)
            arrays = [_array(path, channel, props) for (_, channel), props in zip(channels, above, strict=True)]
        return Contents(arrays, header={key: to_python(value) for key, value in file.properties.items()})


def refuse_unfinished(path: Path) -> None:
    """Walk the segments; `RecordingError` unless each is whole and the last ends where the file does.

    Layout of a lead-in: tag `TDSm`, contents mask, version, length of the rest of the segment, length of its
    metadata (NI, "TDMS file format internal structure"). npTDMS would return fewer samples instead.
    """
    size, position = path.stat().st_size, 0
    with path.open("rb") as file:
        while position < size:
            file.seek(position)
            lead_in = file.read(_LEAD_IN_BYTES)
            if len(lead_in) < _LEAD_IN_BYTES or lead_in[:4] != b"TDSm":
                raise RecordingError(f"{path.name}: no whole TDMS segment starts at byte {position} of {size}")
            mask = int.from_bytes(lead_in[4:8], "little")
            length, metadata = struct.unpack(">QQ" if mask & _BIG_ENDIAN else "<QQ", lead_in[12:])
            if length == _UNFINISHED:
                raise RecordingError(f"{path.name}: the segment at byte {position} was never closed by its writer")
            position += _LEAD_IN_BYTES + length
            if position > size or metadata > length:
                raise RecordingError(f"{path.name}: is cut: {size} bytes, and its last segment ends at {position}")


def _refuse_many_scales(path: Path, properties: dict[str, Any]) -> None:
    """npTDMS makes room for as many scales as a property declares; each has properties of its own."""
    declared = properties.get("NI_Number_Of_Scales", 0)
    if not isinstance(declared, int) or declared > len(properties):
        raise RecordingError(f"{path.name}: NI_Number_Of_Scales is {declared!r}; the file describes fewer scales")


@contextmanager
def _no_compromise(path: Path) -> Iterator[None]:
    """npTDMS logs what it cannot do (unknown scaling, odd chunk) and goes on; here that is a refusal."""
    from nptdms.log import log_manager

    def refuse(record: logging.LogRecord) -> bool:
        raise RecordingError(f"{path.name}: {one_line(record.getMessage())}")

    log_manager.console_handler.addFilter(refuse)
    try:
        yield
    finally:
        log_manager.console_handler.removeFilter(refuse)


def _array(path: Path, channel: TdmsChannel, above: dict[str, Any]) -> Array:
    properties = channel.properties

    def take(start: int, stop: int) -> NDArray[Any]:
        with _no_compromise(path):
            return np.asarray(channel[start:stop])

    return Array(
        channel.name,
        (len(channel),),
        np.dtype(channel.dtype),
        take,
        group=channel.group_name,
        unit=properties.get("unit_string"),
        rate_hz=_rate(path, {**above, **properties}),
        start_s=float(properties.get("wf_start_offset", 0.0)),
        header={key: to_python(value) for key, value in properties.items()},
    )


def _rate(path: Path, properties: dict[str, Any]) -> float | None:
    """From the waveform's increment in seconds, or from a property called `fs` of the channel, group or file."""
    step = properties.get("wf_increment")
    if step is None:
        return next((value for key, value in properties.items() if key.lower() in RATE_NAMES), None)
    if not float(step) > 0.0:
        raise RecordingError(f"{path.name}: wf_increment is {step} s; expected a step above 0")
    return rate_from_step(float(step))
