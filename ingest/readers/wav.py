"""WAV: sound cards and recorders with audio inputs write it; integers are shares of the full
scale."""

from __future__ import annotations

import struct
import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from .base import ReadingOptions, RecordingError
from .contents import Array, Contents, name_and_unit
from .file_fields import refuse_unread_fields
from .recording import MAX_COLUMNS, ArrayReader
from .wav_fields import WAV_FIELDS

_PCM, _FLOAT, _EXTENSIBLE = 1, 3, 0xFFFE
#: Of integers, by bits: the zero and the full scale, as scipy hands them on (24 bits as the upper
#: ones of 32).
_SCALES = {8: (128.0, 2.0**7), 16: (0.0, 2.0**15), 24: (0.0, 2.0**31), 32: (0.0, 2.0**31)}


@dataclass(frozen=True)
class _Form:
    """What the file says of its samples before they come."""

    kind: int
    channels: int
    rate_hz: int
    bits: int
    samples: int

    @property
    def dtype(self) -> np.dtype[Any]:
        """The smallest float that holds the samples exactly."""
        return np.dtype("f8" if (self.kind, self.bits) in {(_PCM, 32), (_FLOAT, 64)} else "f4")


class WavReader(ArrayReader):
    """PCM of 8, 16, 24 or 32 bits and floats of 32 or 64. The channels are `ch1`, `ch2`, unless
    columns are named.

    Integers become shares of the full scale, -1 to 1, in float32 (float64 for 32 bits), which hold
    them exactly; floats stay. The file has no unit: `sensitivity` in campaign.toml is then full
    scales per unit.
    """

    format = "wav"
    suffixes = (".wav",)
    fields = WAV_FIELDS

    def contents(self, path: Path, _: ExitStack, options: ReadingOptions) -> Contents:
        form = _form(path)
        refuse_unread_fields(path, self.fields, _stated(path), "the file", options)
        labels = options.columns or tuple(f"ch{number + 1}" for number in range(form.channels))
        if len(labels) != form.channels:
            raise RecordingError(
                f"{path.name}: has {form.channels} channels, and "
                f"{len(labels)} columns are named ({', '.join(labels)})"
            )
        whole = cache(partial(_load, path, form))
        arrays = []
        for number, label in enumerate(labels):
            if not label:
                continue
            name, unit = name_and_unit(label)
            take = partial(_take, whole, number)
            arrays.append(Array(name, (form.samples,), form.dtype, take, unit=unit))
        return Contents(arrays, form.rate_hz)


def _stated(path: Path) -> dict[str, str]:
    """Names of the chunks and the size of each."""
    with path.open("rb") as file:
        return {
            name.decode("latin-1"): f"a chunk of {size} bytes"
            for name, _, size in _chunks(path, file)
        }


def _take(whole: Callable[[], NDArray[Any]], number: int, start: int, stop: int) -> NDArray[Any]:
    return whole()[number, start:stop].copy()


def _load(path: Path, form: _Form) -> NDArray[Any]:
    """All samples, one row a channel, in the dtype of `form`."""
    from scipy.io import wavfile

    with warnings.catch_warnings():
        warnings.simplefilter(
            "ignore", wavfile.WavFileWarning
        )  # of a chunk that it does not know; `fields` do
        _, values = wavfile.read(path)
    if values.size != form.samples * form.channels:
        raise RecordingError(
            f"{path.name}: declares {form.samples} samples and holds {values.shape}; it is damaged"
        )
    columns = values.reshape(form.samples, form.channels).T
    if form.kind == _FLOAT:
        return np.ascontiguousarray(columns, form.dtype)
    zero, full_scale = _SCALES[form.bits]
    return np.ascontiguousarray((columns.astype(np.float64) - zero) / full_scale, form.dtype)


def _form(path: Path) -> _Form:
    """Format and length. Raises `RecordingError` unless the chunks lie whole in the file, one of
    them the samples'."""
    with path.open("rb") as file:
        chunks = {name: (start, size) for name, start, size in _chunks(path, file)}
        order = _order(path, file)
        if not {b"fmt ", b"data"} <= chunks.keys() or chunks[b"fmt "][1] < 16:
            raise RecordingError(
                f"{path.name}: has no chunks 'fmt ' and 'data'; it is cut, or not WAV"
            )
        start, size = chunks[b"fmt "]
        file.seek(start)
        head = file.read(min(size, 40))
    kind, channels, rate, _, block, bits = struct.unpack(f"{order}HHIIHH", head[:16])
    if kind == _EXTENSIBLE and len(head) >= 26:
        kind = struct.unpack(f"{order}H", head[24:26])[0]
    if (kind, bits) not in {
        (_PCM, 8),
        (_PCM, 16),
        (_PCM, 24),
        (_PCM, 32),
        (_FLOAT, 32),
        (_FLOAT, 64),
    }:
        raise RecordingError(
            f"{path.name}: has samples of format {kind} with {bits} bits; "
            f"expected PCM of 8 to 32 bits, or floats"
        )
    if (
        not 0 < channels <= MAX_COLUMNS
        or block != channels * bits // 8
        or chunks[b"data"][1] % block
    ):
        raise RecordingError(
            f"{path.name}: {channels} channels of {bits} bits do not go into {chunks[b'data'][1]} "
            f"bytes in blocks of {block}; it is cut or damaged"
        )
    return _Form(kind, channels, rate, bits, chunks[b"data"][1] // block)


def _order(path: Path, file: BinaryIO) -> str:
    file.seek(0)
    riff, _, wave = struct.unpack("4s4s4s", file.read(12).ljust(12))
    if riff not in (b"RIFF", b"RIFX") or wave != b"WAVE":
        raise RecordingError(
            f"{path.name}: does not start as a WAV file ('RIFF', 'WAVE'); RF64 is not read"
        )
    return "<" if riff == b"RIFF" else ">"


def _chunks(path: Path, file: BinaryIO) -> Iterator[tuple[bytes, int, int]]:
    """(name, first byte, byte count) of every chunk. A recorder that was switched off leaves wrong
    counts."""
    order, size, position = _order(path, file), path.stat().st_size, 12
    while position < size:
        file.seek(position)
        head = file.read(8)
        name, count = struct.unpack(f"{order}4sI", head) if len(head) == 8 else (b"", 0)
        if position + 8 + count > size or len(head) < 8:
            raise RecordingError(
                f"{path.name}: is cut: a part of it ends at byte {position + 8 + count} of {size}"
            )
        yield name, position + 8, count
        position += 8 + count + count % 2
