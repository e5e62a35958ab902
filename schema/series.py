"""Raw series in the store: exact, compressed, read by slice.

A series is cut into chunks of equal length; each chunk is one Blosc frame (bits or bytes
transposed, then packed), and a slice fetches and decodes only the chunks that it touches. Frames
tell their own packing and length; what else it takes to read them, the `SeriesLayout`, stands in
the channel's row.

Floats that are whole multiples of one step are kept as the counts of their converter (`counts`): a
third less room, and four times faster either way (benchmarks.md). Transposed bits pack better than
bytes where noise is of a few steps, and bytes where it uses every bit of a mantissa; where noise is
all there is to pack, as of 24 bits, lz4 takes a third of zstd's time for a hundredth more room:
hence a look at some samples before one of `PACKINGS` is chosen. Higher levels of zstd save 1 to 5 %
of room for two to three times the time.

Blosc decodes a frame with a changed byte to other numbers without a word, so each frame ends with
its CRC-32, and every reading looks at it: a slice is whole or names its chunk. Frames that were
stored before have none; their series' SHA-256 tells (`care.checks.series`).
"""

from __future__ import annotations

import hashlib
import zlib
from collections.abc import Container, Generator, Iterable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from functools import cache
from struct import Struct
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, Table, insert
from sqlalchemy.orm import Session

from .counts import as_counts, from_counts
from .recordings import RecordedChannel, SeriesChunk
from .row_hashes import ROW_SHA256, hash_of_new

#: A chunk is this share of its series: shorter ones decode slower (15 µs each), longer ones make
#: short slices dear.
CHUNKS_PER_SERIES = 16
SHORTEST_CHUNK, LONGEST_CHUNK = 16_384, 262_144
#: As many samples, from the middle of a series, decide on its packing.
_PROBE_SAMPLES = 16_384
_CHUNKS = cast("Table", SeriesChunk.__table__)
#: Of Blosc's header (README_CHUNK_FORMAT.rst, version 1): length of the content and of the frame,
#: little-endian.
_CONTENT_BYTES, _FRAME_BYTES_AT = slice(4, 8), 12
_NUMBER = Struct("<I")
_HEADER_BYTES, _CHECKSUM_BYTES = 16, 4


@dataclass(frozen=True)
class Packing:
    """How the numbers of a frame are packed: by which of Blosc's codecs, after their bits are
    transposed or bytes."""

    codec: bytes
    level: int
    by_bits: bool


#: The quickest first.
PACKINGS = (Packing(b"lz4", 5, True), Packing(b"zstd", 1, True), Packing(b"zstd", 2, False))
#: Of pulses, which are short and read by the hundred: decoded in a fifth of the time that the
#: closest takes, in 3 % more room.
PULSE_PACKING = Packing(b"lz4", 5, False)
#: In the third byte of a frame: Blosc's number of the codec of the closest packing.
_ZSTD = 4
#: What a quicker one may cost of room.
_WORTH_THE_TIME = 1.02


@dataclass(frozen=True)
class SeriesLayout:
    """What a reader must know of a stored series: dtype and chunk length of its samples, and the
    step of its counts.

    Without a step the frames hold the samples themselves.
    """

    dtype: str
    chunk_samples: int
    step: float | None = None


@dataclass(frozen=True)
class EncodedSeries:
    """A series as it is stored: frames of consecutive chunks."""

    layout: SeriesLayout
    samples: int
    sha256: str
    frames: list[bytes]


class SeriesError(ValueError):
    """A stored series is missing a chunk or cannot be decoded; the message names channel and
    chunk."""


def layout_of(row: RecordedChannel) -> SeriesLayout:
    """The layout that a channel's row tells.

    Parameters:
        row: The row of the stored channel.
    """
    return SeriesLayout(row.dtype, row.chunk_samples, row.step)


def series_hash(samples: NDArray[Any]) -> str:
    """SHA-256 of dtype, length and bytes: equal exactly when the series is.

    Parameters:
        samples: The samples (n,), of any dtype.

    Returns:
        The hash in hexadecimal digits.
    """
    digest = SeriesHash(samples.dtype, samples.size)
    digest.update(samples)
    return digest.hex


class SeriesHash:
    """`series_hash` of a series that comes in parts."""

    def __init__(self, dtype: np.dtype[Any], samples: int) -> None:
        self._digest = hashlib.sha256(f"{dtype.str}:{samples}:".encode())

    def update(self, part: NDArray[Any]) -> None:
        """Take up the next part of the series.

        Parameters:
            part: The samples (m,) that follow those of the call before, of the dtype of the series.
        """
        self._digest.update(np.ascontiguousarray(part).view(np.uint8).data)

    @property
    def hex(self) -> str:
        return self._digest.hexdigest()


def chunk_length(samples: int) -> int:
    """Samples per chunk of a series.

    Parameters:
        samples: The number of samples of the whole series.
    """
    return min(max(samples // CHUNKS_PER_SERIES // 1024 * 1024, SHORTEST_CHUNK), LONGEST_CHUNK)


def encode(samples: NDArray[Any], packing: Packing = PULSE_PACKING) -> bytes:
    """One Blosc frame of samples and its checksum.

    Parameters:
        samples: The samples (n,) of the chunk.
        packing: How the frame is packed; by default as a pulse is.
    """
    frame = _packed(samples, packing)
    return frame + zlib.crc32(frame).to_bytes(_CHECKSUM_BYTES, "little")


def _packed(samples: NDArray[Any], packing: Packing) -> bytes:
    blosc = _blosc()
    shuffle = blosc.BITSHUFFLE if packing.by_bits else blosc.SHUFFLE
    # One block: Blosc's threads share out the blocks of a frame, and where cores are busy lose by
    # it.
    return bytes(
        blosc.compress(
            np.ascontiguousarray(samples), packing.codec, packing.level, shuffle, samples.nbytes
        )
    )


def decode(frame: bytes, dtype: str) -> NDArray[Any]:
    """The samples of a frame, writable.

    Parameters:
        frame: The frame with its checksum, or without one as earlier versions stored it.
        dtype: The dtype string of numpy of the samples, such as "<f4".

    Raises:
        ValueError: For a damaged frame.
        RuntimeError: For a damaged frame that Blosc itself refuses.
    """
    # A copy of the few bytes takes less time than numcodecs' look at an array to decode into.
    return np.frombuffer(_blosc().decompress(_verified(frame)), dtype=dtype).copy()


@cache
def _blosc() -> Any:
    """Looked up once, for an import takes a fifth of the time of a pulse's frame; and not with the
    module, for numcodecs takes long to import."""
    from numcodecs import blosc

    blosc.use_threads = False  # a frame of one block leaves them nothing to do
    return blosc


def encode_series(samples: NDArray[Any], chunk_samples: int | None = None) -> EncodedSeries:
    """A series in frames of consecutive chunks.

    Parameters:
        samples: The samples (n,), of any dtype.
        chunk_samples: The number of samples in a chunk; by default `chunk_length`.
    """
    length = chunk_samples or chunk_length(samples.size)
    counts = as_counts(samples)
    content, step = counts if counts else (samples, None)
    packing = _packing(content)
    frames = [encode(content[i : i + length], packing) for i in range(0, samples.size, length)]
    return EncodedSeries(
        SeriesLayout(samples.dtype.str, length, step), samples.size, series_hash(samples), frames
    )


def _packing(samples: NDArray[Any]) -> Packing:
    """The quickest that takes little more room than the closest, as the record's middle shows."""
    middle = max(0, (samples.size - _PROBE_SAMPLES) // 2)
    probe = samples[middle : middle + _PROBE_SAMPLES]
    room = {packing: len(_packed(probe, packing)) for packing in PACKINGS}
    return next(
        packing for packing, size in room.items() if size <= _WORTH_THE_TIME * min(room.values())
    )


def write_series(
    session: Session,
    frames: Mapping[int, list[bytes]],
    written_by_id: int,
    without: Container[int] = (),
) -> None:
    """Insert the frames of channels within the caller's transaction.

    Parameters:
        session: A session that writes to the store.
        frames: All frames of each series, in their order, by the key of the channel's row.
        written_by_id: The key of the provenance row of the program that writes.
        without: The numbers of the chunks that are not inserted, counted from 0; by default none.
    """
    rows: list[dict[str, Any]] = [
        {"channel_id": channel_id, "number": number, "frame": frame, "written_by_id": written_by_id}
        for channel_id, of_channel in frames.items()
        for number, frame in enumerate(of_channel)
        if number not in without
    ]
    if rows:
        session.flush()
        connection = session.connection()
        for row in rows:
            row[ROW_SHA256] = hash_of_new(connection, _CHUNKS, row)
        connection.execute(insert(_CHUNKS), rows)


#: In the drivers' two ways to mark a value's place: neither takes the other's.
_SELECT = (
    "SELECT number, frame FROM series_chunks WHERE channel_id = ? AND number "
    "BETWEEN ? AND ? ORDER BY number"
)
_SELECT_POSTGRESQL = _SELECT.replace("?", "%s")


def read_slice(
    connection: Connection, channel_id: int, layout: SeriesLayout, start: int, stop: int
) -> NDArray[Any]:
    """Samples of a stored channel, exactly as recorded.

    Parameters:
        connection: A connection to the store.
        channel_id: The key of the channel's row.
        layout: The layout of the series, as `layout_of` gives it.
        start: The first sample. Callers resolve open ends: 0 <= start <= stop <= samples.
        stop: The sample before which the slice ends.

    Returns:
        The samples (stop - start,) in the dtype of the series.

    Raises:
        SeriesError: When a chunk is missing, damaged, or cannot be fetched.
    """
    length = layout.chunk_samples
    chunks = range(start // length, -(-stop // length)) if stop > start else range(0)
    with closing(
        _frames(connection, channel_id, chunks)
    ) as frames:  # its cursor ends with a damaged frame, too
        return _gather(frames, chunks, layout, start, stop, f"channel {channel_id}")


def samples_of(encoded: EncodedSeries) -> NDArray[Any]:
    """The samples of a series that is not stored yet.

    Parameters:
        encoded: The series as `encode_series` gives it.

    Raises:
        SeriesError: When the series is damaged.
    """
    chunks = range(len(encoded.frames))
    return _gather(enumerate(encoded.frames), chunks, encoded.layout, 0, encoded.samples, "series")


def _gather(
    frames: Iterable[tuple[int, bytes]],
    chunks: range,
    layout: SeriesLayout,
    start: int,
    stop: int,
    name: str,
) -> NDArray[Any]:
    """Samples `start:stop` out of the numbered frames of `chunks`."""
    out = np.empty(stop - start, dtype=np.dtype(layout.dtype))
    expected = chunks.start
    for number, frame in frames:
        if number != expected:
            break
        expected += 1
        origin = number * layout.chunk_samples
        low, high = max(start, origin), min(stop, origin + layout.chunk_samples)
        try:
            _decode_into(frame, out[low - start : high - start], low - origin, layout)
        except (RuntimeError, ValueError) as error:
            raise SeriesError(f"{name}: chunk {number} is damaged ({error})") from error
    if expected != chunks.stop:
        raise SeriesError(f"{name}: chunk {expected} is missing")
    return out


def _frames(
    connection: Connection, channel_id: int, chunks: range
) -> Generator[tuple[int, bytes], None, None]:
    """Numbers and frames of `chunks`, by the driver's own cursor.

    SQLAlchemy's result costs as much as decoding a short slice, and psycopg sends bytes as
    hexadecimal text unless told otherwise.
    """
    if not chunks:
        return
    is_postgres = connection.dialect.name == "postgresql"
    driver: Any = connection.connection  # the pool's proxy passes the driver's arguments on
    try:
        cursor = driver.cursor(binary=True) if is_postgres else driver.cursor()
        try:
            cursor.execute(
                _SELECT_POSTGRESQL if is_postgres else _SELECT,
                (channel_id, chunks.start, chunks.stop - 1),
            )
            yield from cursor
        finally:
            cursor.close()
    except connection.dialect.loaded_dbapi.Error as error:
        raise SeriesError(
            f"channel {channel_id}: chunks {chunks.start} to "
            f"{chunks.stop - 1} cannot be fetched ({error})"
        ) from error


def _decode_into(frame: bytes, target: NDArray[Any], skip: int, layout: SeriesLayout) -> None:
    """Samples of a frame from `skip` on, into `target`."""
    decompress, step = _blosc().decompress, layout.step
    stored = target.dtype if step is None else np.dtype(np.int16)
    packed, content = _verified(frame), content_bytes(frame)
    least, most = (skip + target.size) * stored.itemsize, layout.chunk_samples * stored.itemsize
    if not least <= content <= most:  # a few bytes may declare gigabytes
        raise ValueError(f"{content} bytes; expected {least} to {most}")
    if step is None and content == target.nbytes:
        decompress(packed, target)
        return
    part = np.frombuffer(decompress(packed), dtype=stored)[skip : skip + target.size]
    if step is None:
        target[:] = part
    else:
        from_counts(part, step, target)


def content_bytes(frame: bytes) -> int:
    """Bytes that a frame declares to hold: what decoding it takes of memory.

    Parameters:
        frame: A frame with its header.
    """
    return int.from_bytes(frame[_CONTENT_BYTES], "little")


def _verified(frame: bytes) -> memoryview:
    """The frame without its checksum. Raises `ValueError` when it is not as long as it says, nor
    what was written."""
    size = len(frame)
    declared = _NUMBER.unpack_from(frame, _FRAME_BYTES_AT)[0] if size >= _HEADER_BYTES else 0
    trailing_bytes = size - declared
    if declared < _HEADER_BYTES or trailing_bytes not in (0, _CHECKSUM_BYTES):
        raise ValueError(f"a frame of {size} bytes that declares {declared}")
    packed = memoryview(frame)[:declared]
    if trailing_bytes and zlib.crc32(packed) != _NUMBER.unpack_from(frame, declared)[0]:
        raise ValueError("its checksum is another: bytes of it have changed since it was written")
    return packed


def iter_chunks(samples: int, chunk_samples: int) -> Iterator[tuple[int, int]]:
    """(start, stop) of each chunk of a series.

    Parameters:
        samples: The number of samples of the series.
        chunk_samples: The number of samples in a chunk.
    """
    for start in range(0, samples, chunk_samples):
        yield start, min(start + chunk_samples, samples)


def resolve(start: int | None, stop: int | None, samples: int) -> tuple[int, int]:
    """Python slice bounds (negative and open ends) as 0 <= start <= stop <= samples.

    Parameters:
        start: The first sample. A negative one counts from the end; None is the first of the
            series.
        stop: The sample before which the slice ends. A negative one counts from the end; None is
            the end of the series.
        samples: The number of samples of the series.
    """
    first, last, _ = slice(start, stop).indices(samples)
    return first, max(first, last)


def as_floats(frame: bytes, name: str) -> NDArray[np.float64]:
    """A float64 frame, such as a pulse's fine force.

    Parameters:
        frame: The frame as it is stored.
        name: What the frame holds, for the message of the error.

    Raises:
        SeriesError: When the frame is damaged.
    """
    try:
        return cast(
            "NDArray[np.float64]", decode(frame, "<f8")
        )  # as a word: the type itself takes 7 µs to make
    except (RuntimeError, ValueError) as error:
        raise SeriesError(f"{name} is damaged ({error})") from error


def in_closest_packing(frame: bytes) -> bytes:
    """A pulse's frame as the closest packing has it: by its hash, content is known again whatever
    packed it.

    Parameters:
        frame: The frame as it is stored.

    Returns:
        The frame in the last of `PACKINGS`; a damaged one as it is.
    """
    if len(frame) < _HEADER_BYTES or frame[2] >> 5 == _ZSTD:
        return frame  # too short to be a frame, hence damaged; or in the closest packing already
    try:
        return encode(as_floats(frame, "pulse"), PACKINGS[-1])
    except SeriesError:  # damaged content is another content, and is known by its own bytes
        return frame
