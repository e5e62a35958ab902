"""Raw series: exact, whole and by slice, damage noticed; chunks, packings and the counts of a
converter."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from pyroshock.schema.counts import LARGEST_COUNT, as_counts, from_counts
from pyroshock.schema.recordings import RecordedChannel, Recording, SeriesChunk
from pyroshock.schema.series import (
    PACKINGS,
    SeriesError,
    SeriesLayout,
    chunk_length,
    decode,
    encode,
    encode_series,
    in_closest_packing,
    read_slice,
    samples_of,
    series_hash,
    write_series,
)
from pyroshock.schema.session import Store, Writer, open_store

#: Layout of `np.arange(100.0)` in chunks of thirty.
WHOLE_NUMBERS = SeriesLayout("<f8", 30, 1.0)
KINDS = ["<f4", "<f8", "<i2", "<i4", "<i8", "|u1"]


@given(
    hnp.arrays(
        st.sampled_from(KINDS),
        st.integers(1, 300),
        elements={"allow_nan": True, "allow_infinity": True},
    )
)
def test_frame_and_series_return_the_same_bits(samples):
    for again in (
        decode(encode(samples), samples.dtype.str),
        samples_of(encode_series(samples, 64)),
    ):
        assert again.dtype == samples.dtype
        assert again.tobytes() == samples.tobytes()


def test_hash_tells_dtype_and_content_apart():
    ones = np.ones(8, dtype=np.float32)
    assert (
        len(
            {
                series_hash(samples)
                for samples in (ones, ones.astype(np.float64), ones[:7], ones * 2)
            }
        )
        == 4
    )


@pytest.fixture
def store(tables_url):
    with open_store(tables_url, Writer("test", "0"), create=True) as store:
        yield store


def stored(store: Store, samples: np.ndarray, chunk_samples: int) -> int:
    """Key of a channel that holds `samples`, under the smallest campaign that the rules allow."""
    import datetime as dt

    from pyroshock.schema.campaigns import Campaign

    with store.writing() as session:
        campaign = Campaign(name="c", kind="hammer", date=dt.date(2026, 1, 1), fingerprint="x")
        session.add(campaign)
        session.flush()
        encoded = encode_series(samples, chunk_samples)
        channel = RecordedChannel(
            name="force", quantity="force", unit="N", si_unit="N", si_gain=1.0, si_offset=0.0,
            sampling_rate_hz=1.0,
            start_s=0.0, samples=samples.size, sha256=encoded.sha256, header={},
            **vars(encoded.layout),
        )  # fmt: skip
        recording = Recording(
            campaign_id=campaign.id, path="a.npz", sha256="0" * 64, size_bytes=1, format="npz",
            status="stored",
            channels=[channel],
        )  # fmt: skip
        session.add(recording)
        session.flush()
        write_series(session, {channel.id: encoded.frames}, store.written_by(session))
        return channel.id


@pytest.mark.parametrize("chunk_samples", [7, 64, 1000])
@pytest.mark.parametrize("step", [None, 0.125])
def test_any_slice_is_the_slice_of_the_whole(store, chunk_samples, step):
    rng = np.random.default_rng(1)
    if step is None:
        samples = rng.normal(size=500).astype(np.float32)
        samples[13] = np.nan
    else:
        samples = (rng.normal(0, 5, 500).astype(np.int16) * step).astype(np.float32)
    channel = stored(store, samples, chunk_samples)
    layout = SeriesLayout("<f4", chunk_samples, step)
    with store.reading() as session:
        for start, stop in [
            (0, 500),
            (0, 0),
            (499, 500),
            (0, 7),
            (7, 14),
            (3, 471),
            *_random_slices(rng),
        ]:
            part = read_slice(session.connection(), channel, layout, start, stop)
            assert part.tobytes() == samples[start:stop].tobytes(), (start, stop)


def _random_slices(rng):
    ends = np.sort(rng.integers(0, 501, size=(30, 2)), axis=1)
    return [(int(a), int(b)) for a, b in ends]


DAMAGES = (lambda f: f[:-3], lambda f: b"\x00" * len(f), lambda f: f[:16], lambda f: b"", None)


@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_or_missing_chunk_is_named(store, damage):
    channel = stored(store, np.arange(100.0), 30)
    with store.writing() as session:
        chunk = session.get_one(SeriesChunk, (channel, 1))
        if damage is None:
            session.delete(chunk)
        else:
            chunk.frame = damage(chunk.frame)
    with store.reading() as session, pytest.raises(SeriesError, match="chunk 1"):
        read_slice(session.connection(), channel, WHOLE_NUMBERS, 0, 100)


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
    ("noise_steps", "expected"),
    [(1.0, _BITS | _ZSTD), (10.0, _BYTES | _ZSTD), (30_000.0, _BITS | _LZ4)],
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


def test_a_pulse_is_known_by_the_same_bytes_whatever_packed_it():
    force_n = np.sin(np.linspace(0, np.pi, 801)) + np.random.default_rng(1).normal(size=801)
    closest, damaged = encode(force_n, PACKINGS[-1]), bytearray(encode(force_n))
    assert encode(force_n) != closest
    assert in_closest_packing(encode(force_n)) == in_closest_packing(closest) == closest
    damaged[100] ^= 1
    assert in_closest_packing(bytes(damaged)) == damaged


def test_changed_byte_and_a_frame_of_more_than_its_chunk_are_refused():
    frame = encode(np.sin(np.arange(300.0)))
    with pytest.raises(ValueError, match="declares"):
        decode(frame[:-1], "<f8")  # cut: refused before it is decoded
    assert (
        decode(frame[:-4], "<f8").tobytes() == np.sin(np.arange(300.0)).tobytes()
    )  # without a checksum: read
    for at in range(len(frame)):
        changed = bytearray(frame)
        changed[at] ^= 0x10
        with pytest.raises(ValueError, match=r"declares|checksum"):
            decode(bytes(changed), "<f8")
    series = encode_series(np.zeros(20_000), chunk_samples=10_000)
    series.frames[0] = encode(np.zeros(1_000_000))
    with pytest.raises(
        SeriesError, match=r"chunk 0 is damaged.*8000000 bytes; expected 80000 to 80000"
    ):
        samples_of(series)


def converter(
    step: float, noise_steps: float, dtype: str, samples: int = 40_000, seed: int = 1
) -> np.ndarray:
    counts = (
        np.random.default_rng(seed)
        .normal(0, noise_steps, samples)
        .round()
        .clip(-LARGEST_COUNT, LARGEST_COUNT)
    )
    return (counts.astype(np.int16) * np.float64(step)).astype(dtype)


def restored(samples: np.ndarray) -> np.ndarray | None:
    counts = as_counts(samples)
    if counts is None:
        return None
    again = np.empty_like(samples)
    from_counts(*counts, again)
    return again


@settings(max_examples=60)
@given(
    st.floats(1e-9, 1e6), st.floats(0.5, 9000), st.sampled_from(["<f4", "<f8"]), st.integers(0, 9)
)
def test_found_counts_give_every_bit_back(step, noise_steps, dtype, seed):
    samples = converter(step, noise_steps, dtype, seed=seed)
    again = restored(samples)
    assert again is None or again.tobytes() == samples.tobytes()


@pytest.mark.parametrize("dtype", ["<f4", "<f8"])
@pytest.mark.parametrize("noise_steps", [1.0, 30.0, 3000.0])
def test_step_is_found_whatever_the_scale(dtype, noise_steps):
    steps = 10 ** np.random.default_rng(2).uniform(-9, 6, 40)
    steps_recovered = sum(
        restored(converter(step, noise_steps, dtype)) is not None for step in steps
    )
    # In double precision the product's rounding leaves a few steps that no double stands for.
    assert steps_recovered >= 34


def test_step_is_the_converters_and_anything_else_is_left_alone():
    _, step = as_counts(converter(0.152587890625, 5.0, "<f4"))
    assert step == 0.152587890625
    samples = converter(0.1, 2.0, "<f4")
    samples[12_345] = np.float32(-32_767 * 0.1)
    assert restored(samples).tobytes() == samples.tobytes()
    samples = converter(0.1, 2.0, "<f8")
    for other in (samples + 0.3, np.zeros_like(samples), samples[:1]):
        assert as_counts(other) is None
    for value in (np.nan, np.inf, 33_000 * 0.1, -0.0, 0.15):
        assert as_counts(np.where(np.arange(samples.size) == 777, value, samples)) is None, value
    for dtype in ("<i2", "|u1", "<c8", ">f8"):
        assert as_counts(np.arange(100).astype(dtype)) is None, dtype


@settings(max_examples=200)
@given(st.lists(st.floats(width=32), min_size=1, max_size=50))
@example([5e-324, 0.0, 1.0])
@example([1e308, -1e308])
def test_no_number_is_refused_or_changed(values):
    for dtype in ("<f4", "<f8"):
        with np.errstate(over="ignore"):
            samples = np.array(values, dtype=dtype)
        again = restored(samples)
        assert again is None or again.tobytes() == samples.tobytes()
