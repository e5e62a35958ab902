"""The rules of a reader, one function each, run over every recipe in `conftest.py`."""

from __future__ import annotations

import json
import os
import shutil
from functools import partial
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.ingest.readers import (
    READERS,
    RecordingError,
    may_crash,
    open_recording,
    reader_for,
)
from pyroshock.parallel.read_ahead import Isolation, map_ahead
from support.processes import chores
from support.records.recipes import Truth

few = settings(max_examples=12)


def test_channels_are_described_as_written_and_headers_are_json(sample):
    with open_recording(sample.path, sample.truth.options) as recording:
        found = {c.name: (c.samples, c.dtype, c.unit) for c in recording.channels}
        for channel in recording.channels:
            assert channel.sampling_rate_hz == sample.truth.rate_hz
            assert channel.start_s == pytest.approx(sample.truth.start_s, abs=1e-9)
            assert json.loads(json.dumps(channel.header, allow_nan=False)) == channel.header
    written = sample.truth.channels.items()
    assert found == {name: (len(x), x.dtype.str, sample.truth.units[name]) for name, x in written}


def test_whole_channels_are_exact(sample):
    with open_recording(sample.path, sample.truth.options) as recording:
        for name, written in sample.truth.channels.items():
            read = recording.read(name)
            assert read.dtype == written.dtype and read.dtype.isnative
            np.testing.assert_array_equal(read, written)
            read[:] = 0  # a change to what was read changes nothing
            np.testing.assert_array_equal(recording.read(name), written)


@given(data=st.data())
@few
def test_slices_are_slices_of_the_whole(sample, data):
    bound = st.integers(-120, 120)
    start, stop = data.draw(bound), data.draw(st.none() | bound)
    with open_recording(sample.path, sample.truth.options) as recording:
        for name, written in sample.truth.channels.items():
            np.testing.assert_array_equal(recording.read(name, start, stop), written[start:stop])


def test_an_unknown_channel_is_refused_with_the_known_ones(sample):
    with (
        open_recording(sample.path, sample.truth.options) as recording,
        pytest.raises(RecordingError, match=r"'pressure'.*force") as refused,
    ):
        recording.read("pressure")
    assert sample.path.name in str(refused.value)


def test_close_releases_the_file_and_a_closed_recording_is_refused(sample):
    with open_recording(sample.path, sample.truth.options) as recording:
        recording.read("force", 3, 9)
    assert not _open_here(sample.path)
    with pytest.raises(RecordingError, match="is closed"):
        recording.read("force")


def test_a_refused_file_is_released(sample, tmp_path):
    path = _cut(sample.path, tmp_path, sample.path.stat().st_size // 2)
    with pytest.raises(RecordingError):
        open_recording(path, sample.truth.options)
    assert not _open_here(path)


@given(fraction=st.floats(0, 1, exclude_max=True))
@few
def test_a_cut_file_is_refused_or_identical(sample, tmp_path_factory, fraction):
    size = int(fraction * sample.path.stat().st_size)
    path = _cut(sample.path, tmp_path_factory.mktemp("cut"), size)
    _assert_refused_or_identical(path, sample.truth)


@given(cut=st.integers(1, 40))
@few
def test_a_file_that_lacks_its_last_bytes_is_refused_or_identical(sample, tmp_path_factory, cut):
    path = _cut(sample.path, tmp_path_factory.mktemp("cut"), sample.path.stat().st_size - cut)
    _assert_refused_or_identical(path, sample.truth)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=2)
def test_a_wrong_byte_raises_nothing_else(sample, tmp_path_factory, seed):
    rng, content = np.random.default_rng(seed), sample.path.read_bytes()
    paths = [tmp_path_factory.mktemp("wrong") / sample.path.name for _ in range(8)]
    for path in paths:
        damaged = bytearray(content)
        damaged[rng.integers(len(content))] = rng.integers(256)
        path.write_bytes(damaged)
    # where the format's library may crash, as the ingest does it: in a process of its own, which
    # reads the whole file too, for a process that cannot begin would count as crashed by each
    isolation = Isolation[Path, str | None](
        lambda path: f"{path.name}: lost", lambda _: 10.0, always=may_crash(sample.path)
    )
    use = partial(chores.refusal, sample.truth.options)
    (_, whole_refused), *results = map_ahead(use, [sample.path, *paths], 1, isolation)
    assert whole_refused is None
    for path, refused in results:
        if refused is not None:
            _assert_clear(refused, path)


@given(garbage=st.binary(max_size=600))
@few
def test_garbage_is_refused(sample, tmp_path_factory, garbage):
    path = tmp_path_factory.mktemp("garbage") / f"garbage{sample.path.suffix}"
    path.write_bytes(garbage)
    with pytest.raises(RecordingError) as refused:
        open_recording(path, sample.truth.options)
    _assert_clear(str(refused.value), path)


def test_another_formats_content_is_refused(sample, tmp_path):
    ours = {reader_for(sample.path).format}
    if h5py.is_hdf5(sample.path):
        ours |= {"mat", "hdf5"}  # MATLAB 7.3 is HDF5
    for other in READERS:
        if other.format not in ours:
            path = tmp_path / f"disguised{other.suffixes[0]}"
            shutil.copy(sample.path, path)
            with pytest.raises(RecordingError) as refused:
                open_recording(path)
            _assert_clear(str(refused.value), path)


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.format)
def test_nothing_there_is_refused_whatever_the_case_of_the_suffix(reader, tmp_path):
    for suffix in reader.suffixes:
        assert reader_for(Path(f"shot{suffix.upper()}")) is reader
    absent, empty, folder = (
        tmp_path / f"{name}{reader.suffixes[0]}" for name in ("absent", "empty", "folder")
    )
    empty.touch()
    folder.mkdir()
    for path, reason in ((absent, "no such file"), (empty, "is empty"), (folder, "is a folder")):
        with pytest.raises(RecordingError, match=reason):
            open_recording(path)


def _cut(path: Path, folder: Path, size: int) -> Path:
    shorter = folder / path.name
    shorter.write_bytes(path.read_bytes()[:size])
    return shorter


def _assert_refused_or_identical(path: Path, truth: Truth) -> None:
    """A container may have lost a later channel without a trace; then asking for it is refused."""
    for name, written in truth.channels.items():
        try:
            with open_recording(path, truth.options) as recording:
                read = recording.read(name)
        except RecordingError as refused:
            _assert_clear(str(refused), path)
        else:
            np.testing.assert_array_equal(read, written)


def _assert_clear(message: str, path: Path) -> None:
    assert message.startswith(path.name) and "\n" not in message and len(message) < 600


def _open_here(path: Path) -> bool:
    """Whether this process holds `path` open."""
    folder = Path("/proc/self/fd")
    if not folder.is_dir():
        pytest.skip("needs /proc to see open files")
    return any(os.path.realpath(link) == str(path) for link in folder.iterdir())
