"""Raw series: exact, whole and by slice, and damage is noticed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from pyroshock.schema.recordings import RecordedChannel, Recording, SeriesChunk
from pyroshock.schema.series import (
    SeriesError,
    SeriesLayout,
    decode,
    encode,
    encode_series,
    read_slice,
    samples_of,
    series_hash,
    write_series,
)
from pyroshock.schema.session import Store, Writer, open_store

#: Layout of `np.arange(100.0)` in chunks of thirty.
WHOLE_NUMBERS = SeriesLayout("<f8", 30, 1.0)
KINDS = ["<f4", "<f8", "<i2", "<i4", "<i8", "|u1"]


@given(hnp.arrays(st.sampled_from(KINDS), st.integers(1, 300), elements={"allow_nan": True, "allow_infinity": True}))
def test_frame_and_series_return_the_same_bits(samples):
    for again in (decode(encode(samples), samples.dtype.str), samples_of(encode_series(samples, 64))):
        assert again.dtype == samples.dtype
        assert again.tobytes() == samples.tobytes()


def test_hash_tells_dtype_and_content_apart():
    ones = np.ones(8, dtype=np.float32)
    assert len({series_hash(samples) for samples in (ones, ones.astype(np.float64), ones[:7], ones * 2)}) == 4


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
            name="force", quantity="force", unit="N", si_unit="N", si_gain=1.0, si_offset=0.0, sampling_rate_hz=1.0,
            start_s=0.0, samples=samples.size, sha256=encoded.sha256, header={}, **vars(encoded.layout),
        )  # fmt: skip
        recording = Recording(
            campaign_id=campaign.id, path="a.npz", sha256="0" * 64, size_bytes=1, format="npz", status="stored",
            channels=[channel],
        )  # fmt: skip
        session.add(recording)
        session.flush()
        write_series(session, channel.id, encoded.frames, store.written_by(session))
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
        for start, stop in [(0, 500), (0, 0), (499, 500), (0, 7), (7, 14), (3, 471), *_random_slices(rng)]:
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
