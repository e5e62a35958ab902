"""The readers of recordings as targets: whatever a file holds, it is read whole and consistent, or refused."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
from fuzzing.mutations import binary, containers, generated, tables
from fuzzing.seeds import recordings
from fuzzing.target import ACCEPTED, Mutate, Target, Use, stacked
from pyroshock.ingest.readers import OpenRecording, RecordingError, open_recording
from pyroshock.schema.plain import to_plain

_SHARED = ("ingest/readers/recording.py", "ingest/readers/clock.py", "ingest/readers/contents.py")
#: How a file of each suffix is damaged.
FORMATS: dict[str, Mutate] = {
    ".csv": tables.damaged,
    ".lvm": tables.damaged,
    ".npz": stacked({containers.inside_zip: 6, generated.any_file(generated.npz): 2, binary.damaged: 2}, most=2),
    ".mat": stacked({containers.inside_mat: 6, generated.any_file(generated.mat): 2, binary.damaged: 3}, most=2),
    ".h5": stacked({binary.damaged: 8, generated.any_file(generated.hdf5): 2}, most=2),
    ".parquet": stacked({binary.damaged: 6, generated.any_file(generated.parquet): 3}, most=2),
    ".tdms": stacked({binary.damaged: 8, generated.any_file(generated.tdms): 2}, most=2),
    ".uff": stacked({tables.damaged: 4, binary.damaged: 6}, most=2),
}
#: Read through libhdf5 whatever the suffix.
MAT73 = FORMATS[".h5"]


def reads(suffix: str) -> Use:
    """Open a recording of that suffix, and read all of it and a part."""

    def use(data: bytes, folder: Path) -> str:
        path = folder / f"input{suffix}"
        path.write_bytes(data)
        with open_recording(path) as recording:
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
        for text in (channel.name, channel.unit or "", json.dumps(to_plain(channel.header), ensure_ascii=False)):
            text.encode("utf-8")
        whole = recording.read(channel.name)
        assert whole.shape == (channel.samples,) and whole.dtype == np.dtype(channel.dtype), channel
        start, stop = channel.samples // 3, channel.samples // 2
        np.testing.assert_array_equal(recording.read(channel.name, start, stop), whole[start:stop])


def _reader(name: str, suffix: str, *recipes: str, module: str, mutate: Mutate | None = None) -> Target:
    return Target(
        f"{name} recording",
        reads(suffix),
        lambda: recordings(*recipes),
        mutate or FORMATS[suffix],
        (RecordingError,),
        f"input{suffix}",
        tuple(f"ingest/readers/{part}.py" for part in module.split()) + _SHARED,
        may_crash=name in ("hdf5", "mat73"),
    )


READERS = (
    _reader("csv", ".csv", "csv", "csv-german", module="csv csv_layout text"),
    _reader("lvm", ".lvm", "lvm", "lvm-comma", module="lvm text"),
    _reader("npz", ".npz", "npz", "npz-compressed", module="npz"),
    _reader("mat5", ".mat", "mat5", "mat5-compressed", "mat5-time", module="mat mat5_elements"),
    _reader("mat73", ".mat", "mat73", module="mat hdf5", mutate=MAT73),
    _reader("hdf5", ".h5", "hdf5", "hdf5-nested", module="hdf5"),
    _reader("parquet", ".parquet", "parquet", "parquet-frame", module="parquet"),
    _reader("tdms", ".tdms", "tdms", module="tdms"),
    _reader("uff", ".uff", "uff-ascii", "uff-binary", module="uff"),
)
