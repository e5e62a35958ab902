"""How a series is cut and packed: chunks that suit its length, the filter that suits its numbers."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.schema.series import PACKINGS, SeriesError, chunk_length, decode, encode, encode_series, samples_of

_FLAGS = 2  # byte of Blosc's header: the filter, and from the sixth bit on the codec
_BYTES, _BITS, _LZ4, _ZSTD = 0b001, 0b100, 1 << 5, 4 << 5


@pytest.mark.parametrize("samples", [1, 16_384, 100_000, 512_000, 3_000_001, 10_000_000, 2**31])
def test_chunks_are_a_sixteenth_within_bounds(samples):
    length = chunk_length(samples)
    assert 16_384 <= length <= 262_144
    assert length <= max(16_384, samples / 16)


def _no_counts(noise_steps, samples):
    """Noise of a converter with a gap at its end, so that it is kept as floats."""
    codes = np.random.default_rng(1).normal(0, noise_steps, samples).round()
    codes[-1] = np.nan
    return (codes * 0.152587890625).astype(np.float32)


@pytest.mark.parametrize(
    ("noise_steps", "expected"), [(1.0, _BITS | _ZSTD), (10.0, _BYTES | _ZSTD), (30_000.0, _BITS | _LZ4)]
)
def test_packing_follows_the_noise(noise_steps, expected):
    frames = encode_series(_no_counts(noise_steps, 100_000)).frames
    assert {frame[_FLAGS] & (_BITS | _BYTES | 0b11100000) for frame in frames} == {expected}


@pytest.mark.parametrize("noise_steps", [0.5, 2.0, 5.0, 1000.0, 30_000.0])
def test_no_packing_alone_takes_less_room(noise_steps):
    samples = _no_counts(noise_steps, 16_384)
    (frame,) = encode_series(samples).frames
    assert len(frame) <= 1.02 * min(len(encode(samples, packing)) for packing in PACKINGS)


@pytest.mark.parametrize("samples", [1, 7, 8, 9, 1001])
@pytest.mark.parametrize("packing", PACKINGS, ids=lambda one: f"{one.codec.decode()}-{one.level}")
def test_any_length_comes_back_from_any_packing(samples, packing):
    values = np.random.default_rng(samples).normal(size=samples)
    assert decode(encode(values, packing), "<f8").tobytes() == values.tobytes()


def test_every_changed_byte_of_a_frame_is_refused():
    frame = encode(np.sin(np.arange(300.0)))
    with pytest.raises(ValueError, match="declares"):
        decode(frame[:-1], "<f8")  # cut: refused before it is decoded
    assert decode(frame[:-4], "<f8").tobytes() == np.sin(np.arange(300.0)).tobytes()  # without a checksum: read
    for at in range(len(frame)):
        changed = bytearray(frame)
        changed[at] ^= 0x10
        with pytest.raises(ValueError, match=r"declares|checksum"):
            decode(bytes(changed), "<f8")


def test_a_frame_of_more_than_its_chunk_is_not_unpacked():
    series = encode_series(np.zeros(20_000), chunk_samples=10_000)
    series.frames[0] = encode(np.zeros(1_000_000))
    with pytest.raises(SeriesError, match=r"chunk 0 is damaged.*8000000 bytes; expected 80000 to 80000"):
        samples_of(series)
