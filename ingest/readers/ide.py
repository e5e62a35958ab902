"""enDAQ and Slam Stick recorders' `.ide`, through the maker's own library, which is installed with
`pyroshock[ide]`."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .base import MAX_EXPANSION, ReadingOptions, RecordingError
from .contents import Array, BoundedFile, Contents, lazy_array, one_line
from .file_fields import refuse_unread_fields
from .ide_fields import IDE_FIELDS
from .recording import ArrayReader

_EBML = b"\x1a\x45\xdf\xa3"
_MICROSECOND = 1e-6
_RATIO = re.compile(
    r"(\d{1,20}(?:\.\d{0,20})?(?:e-?\d{1,2})?)(?:\s*/\s*(\d{1,20}(?:\.\d{0,20})?(?:e-?\d{1,2})?))?"
)
#: Bytes of one sample as the library hands it on, with its time; a file stores one in two or three
#: bytes.
_SAMPLE_BYTES = 16


class IdeReader(ArrayReader):
    """Calibrated samples in the recorder's units; a channel has the recorder's label,
    `Acceleration: X (100g)`.

    Where two sensors have one label, the channel's number stands before it: `84/Rotation: X`.
    """

    format = "ide"
    suffixes = (".ide",)
    fields = IDE_FIELDS

    def contents(self, path: Path, open_files: ExitStack, options: ReadingOptions) -> Contents:
        refuse_cut(path)
        with _no_compromise(path) as importer:
            stream = open_files.enter_context(BoundedFile(path.open("rb", buffering=0)))
            dataset = open_files.enter_context(
                importer.openFile(stream, name=path.stem, quiet=True)
            )
            importer.readData(dataset)
            if dataset.fileDamaged or len(dataset.sessions) != 1:
                raise RecordingError(
                    f"{path.name}: is damaged, or has {len(dataset.sessions)} "
                    f"sessions; expected one whole session"
                )
            parts = [part for channel in dataset.channels.values() for part in channel.subchannels]
            arrays = [array for part in parts if (array := _array(path, part)) is not None]
            recorder = {
                key: value
                for key, value in dataset.recorderInfo.items()
                if isinstance(value, int | float | str)
            }
        refuse_unread_fields(path, self.fields, recorder, "the recorder", options)
        return Contents(arrays, header=recorder)


@contextmanager
def _no_compromise(path: Path) -> Iterator[Any]:
    """The library logs an element that it cannot read and goes on; here that is a refusal."""
    try:
        from idelib import importer, parsers
    except ImportError:
        raise RecordingError(
            f"{path.name}: .ide files are read by idelib, which is not "
            f"installed; pip install 'pyroshock[ide]'"
        ) from None

    parsers.valEval = _ratio  # its own hands the file's text to `eval`: 9**9**9**9 would never end
    logger, handler = logging.getLogger("idelib"), _Refusal(path)
    logger.addHandler(handler)
    try:
        yield importer
    finally:
        logger.removeHandler(handler)


def _ratio(text: str | bytes) -> float:
    """The unit of a channel's times, `1.0/32768` or a number. Raises `ValueError` for anything
    else."""
    words = text.decode("ascii") if isinstance(text, bytes | bytearray) else text
    match = _RATIO.fullmatch(words.strip())
    if match is None or float(match.group(2) or 1.0) == 0.0:
        raise ValueError(f"{words!r} is no number and no ratio of two; it is damaged")
    return float(match.group(1)) / float(match.group(2) or 1.0)


class _Refusal(logging.Handler):
    """Errors that are logged are raised; what is less is dropped."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._path = path

    def emit(self, record: logging.LogRecord) -> None:
        if record.levelno >= logging.ERROR:
            raise RecordingError(f"{self._path.name}: {one_line(record.getMessage())}")


def _array(path: Path, part: Any) -> Array | None:
    """The samples of one subchannel; None where it recorded none."""
    events = part.getSession()
    samples = len(events)
    if samples == 0:
        return None
    if samples * _SAMPLE_BYTES > MAX_EXPANSION * path.stat().st_size:
        raise RecordingError(
            f"{path.name}: {part.displayName!r} declares {samples} samples, "
            f"more than the file can hold"
        )
    return Array(
        part.displayName,
        (samples,),
        np.dtype(np.float64),
        lazy_array(partial(_values, path, events)),
        group=str(part.parent.id),
        unit=part.units[1] or None,
        times_s=np.asarray(events.arraySlice()[0], dtype=np.float64) * _MICROSECOND,
        header={"sensor": str(getattr(part.sensor, "name", None))},
    )


def _values(path: Path, events: Any) -> NDArray[np.float64]:
    with _no_compromise(path):
        return np.asarray(events.arraySlice()[1], dtype=np.float64)


def refuse_cut(path: Path) -> None:
    """Walk the top elements; `RecordingError` unless the last one ends where the file does.

    An element is an identifier and a length, each of one byte more than the zeros that its first
    byte starts with (EBML, RFC 8794). The library would take a shorter file.
    """
    size, position = path.stat().st_size, 0
    with path.open("rb") as file:
        if file.read(4) != _EBML:
            raise RecordingError(
                f"{path.name}: does not start as an EBML file; it is no .ide recording"
            )
        while position < size:
            file.seek(position)
            head = file.read(12)
            id_bytes = _width(head, 0)
            length_bytes = _width(head, id_bytes)
            start = position + id_bytes + length_bytes
            if id_bytes > 4 or len(head) < id_bytes + length_bytes:
                raise RecordingError(
                    f"{path.name}: no whole element starts at byte {position}; it is damaged"
                )
            coded = int.from_bytes(head[id_bytes : id_bytes + length_bytes], "big")
            position = start + coded - (1 << 7 * length_bytes)
            if position > size:
                raise RecordingError(
                    f"{path.name}: is cut: {size} bytes, and an element ends at byte {position}"
                )


def _width(head: bytes, at: int) -> int:
    """Bytes of the number that starts at `at`; 9, which is none, at the end or for a zero."""
    return 9 - head[at].bit_length() if at < len(head) else 9
