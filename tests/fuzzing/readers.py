"""The readers of recordings as targets: whatever a file holds, it is read whole and consistent, or
refused."""

from __future__ import annotations

import inspect
import json
import math
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from fuzzing.mutations import binary, containers, generated, tables
from fuzzing.seeds import bare_lvm, mat_structures, oscilloscopes, recordings, wavs
from fuzzing.target import ACCEPTED, Mutate, Target, Use, stacked
from pyroshock.ingest import readers
from pyroshock.ingest.readers import (
    AS_IN_FILE,
    OpenRecording,
    ReadingOptions,
    RecordingError,
    open_recording,
)
from pyroshock.schema.base import to_plain
from support.records.recipes import RECIPES

_SHARED = tuple(f"ingest/readers/{part}.py" for part in ("recording", "clock", "contents"))
#: How a file of each suffix is damaged.
FORMATS: dict[str, Mutate] = {
    **dict.fromkeys((".csv", ".lvm", ".txt"), tables.damaged),
    ".npy": stacked({binary.damaged: 8, generated.any_file(generated.npy): 3}, most=2),
    ".wav": stacked({binary.damaged: 8, generated.any_file(generated.wav): 2}, most=2),
    ".ide": binary.damaged,
    ".npz": stacked(
        {containers.inside_zip: 6, generated.any_file(generated.npz): 2, binary.damaged: 2}, most=2
    ),
    ".mat": stacked(
        {containers.inside_mat: 6, generated.any_file(generated.mat): 2, binary.damaged: 3}, most=2
    ),
    ".h5": stacked({binary.damaged: 8, generated.any_file(generated.hdf5): 2}, most=2),
    ".parquet": stacked({binary.damaged: 6, generated.any_file(generated.parquet): 3}, most=2),
    ".tdms": stacked({binary.damaged: 8, generated.any_file(generated.tdms): 2}, most=2),
    ".uff": stacked({tables.damaged: 4, binary.damaged: 6}, most=2),
}
#: Read through libhdf5 whatever the suffix.
MAT73 = FORMATS[".h5"]


def reads(suffix: str, options: ReadingOptions = AS_IN_FILE) -> Use:
    """Open a recording of that suffix, and read all of it and a part."""

    def use(data: bytes, folder: Path) -> str:
        path = folder / f"input{suffix}"
        path.write_bytes(data)
        with open_recording(path, options) as recording:
            read_whole(recording)
        return ACCEPTED

    return use


def read_whole(recording: OpenRecording) -> None:
    """What every accepted recording must hold; raises `AssertionError`."""
    assert recording.channels
    for channel in recording.channels:
        assert channel.samples > 0 and np.dtype(channel.dtype).kind in "iuf", channel
        assert math.isfinite(channel.sampling_rate_hz) and channel.sampling_rate_hz > 0, channel
        assert math.isfinite(channel.start_s), channel
        for text in (
            channel.name,
            channel.unit or "",
            json.dumps(to_plain(channel.header), ensure_ascii=False),
        ):
            text.encode("utf-8")
        whole = recording.read(channel.name)
        assert whole.shape == (channel.samples,) and whole.dtype == np.dtype(channel.dtype), channel
        start, stop = channel.samples // 3, channel.samples // 2
        np.testing.assert_array_equal(recording.read(channel.name, start, stop), whole[start:stop])


def _reader(
    name: str,
    suffix: str,
    *recipes: str,
    module: str,
    mutate: Mutate | None = None,
    options: ReadingOptions = AS_IN_FILE,
    seeds: Callable[[], Sequence[bytes]] | None = None,
) -> Target:
    return Target(
        f"{name} recording",
        reads(suffix, options),
        seeds or (lambda: recordings(*recipes)),
        mutate or FORMATS[suffix],
        (RecordingError,),
        f"input{suffix}",
        tuple(f"ingest/readers/{part}.py" for part in module.split()) + _SHARED,
        may_crash=name in ("hdf5", "mat73"),
    )


_NAMES = ("force", "acceleration_1", "counts")
GIVEN = ReadingOptions(_NAMES, 51200.0)
_TEXT = "csv text"

#: Suffixes of the same formats.
_ALIASES = frozenset({".dat", ".hdf5"})

READERS = (
    _reader("csv", ".csv", "csv", "csv-german", module=_TEXT),
    _reader("text", ".txt", "text", "text-bare", module=_TEXT, options=GIVEN),
    _reader("oscilloscope", ".csv", module=_TEXT, seeds=oscilloscopes, mutate=FORMATS[".txt"]),
    _reader("lvm", ".lvm", "lvm", "lvm-comma", module="lvm text"),
    _reader("lvm-bare", ".lvm", module="lvm csv text", options=GIVEN, seeds=bare_lvm),
    _reader("npz", ".npz", "npz", "npz-compressed", module="npz"),
    _reader("npy", ".npy", "npy", module="npy", options=GIVEN),
    _reader("wav", ".wav", "wav", module="wav", options=GIVEN, seeds=wavs),
    _reader("mat5", ".mat", "mat5", "mat5-compressed", "mat5-time", module="mat mat5"),
    _reader("mat5-structure", ".mat", module="mat mat5", seeds=mat_structures),
    _reader("mat73", ".mat", "mat73", module="mat hdf5", mutate=MAT73),
    _reader("hdf5", ".h5", "hdf5", "hdf5-nested", module="hdf5"),
    _reader("parquet", ".parquet", "parquet", "parquet-frame", module="parquet"),
    _reader("tdms", ".tdms", "tdms", module="tdms"),
    _reader("uff", ".uff", "uff-ascii", "uff-binary", module="uff"),
    *([_reader("ide", ".ide", "ide", module="ide")] if find_spec("idelib") is not None else []),
    *(
        _reader(
            name,
            suffix,
            name,
            module=Path(inspect.getfile(type(readers.reader_for(Path(f"a{suffix}"))))).stem,
            mutate=binary.damaged,
        )
        for name, (suffix, _) in RECIPES.items()
        if suffix not in FORMATS and suffix not in _ALIASES  # a format without mutations of its own
    ),
)
