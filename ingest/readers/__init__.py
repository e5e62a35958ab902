"""Readers of raw recordings: one per file format, listed here."""

from __future__ import annotations

from pathlib import Path

from .base import AS_IN_FILE, ChannelInfo, OpenRecording, Reader, ReadingOptions, RecordingError
from .csv import CsvReader
from .hdf5 import Hdf5Reader
from .ide import IdeReader
from .lvm import LvmReader
from .mat import MatReader
from .npy import NpyReader
from .npz import NpzReader
from .parquet import ParquetReader
from .tdms import TdmsReader
from .uff import UffReader
from .wav import WavReader

#: Every reader; a new format is a file in this folder and a line here.
READERS: tuple[Reader, ...] = (
    MatReader(),
    CsvReader(),
    ParquetReader(),
    TdmsReader(),
    UffReader(),
    LvmReader(),
    Hdf5Reader(),
    NpzReader(),
    NpyReader(),
    WavReader(),
    IdeReader(),
)

__all__ = [
    "AS_IN_FILE",
    "READERS",
    "ChannelInfo",
    "OpenRecording",
    "Reader",
    "ReadingOptions",
    "RecordingError",
    "may_crash",
    "open_recording",
    "reader_for",
]


def reader_for(path: Path) -> Reader:
    """The reader of the path's suffix; `RecordingError` with the known suffixes otherwise."""
    suffix = Path(path).suffix.lower()
    for reader in READERS:
        if suffix in reader.suffixes:
            return reader
    suffixes = ", ".join(suffixes for reader in READERS for suffixes in reader.suffixes)
    raise RecordingError(
        f"{Path(path).name}: no reader for {suffix or 'a file without suffix'}; known: {suffixes}"
    )


def open_recording(path: Path, options: ReadingOptions = AS_IN_FILE) -> OpenRecording:
    """The recording at `path`, held open: use as a context manager. Raises `RecordingError`."""
    return reader_for(path).open(Path(path), options)


def may_crash(path: Path) -> bool:
    """Whether a damaged file like this can crash the process that reads it, or hold it for ever.

    libhdf5 does either on about one in 3000 wrong bytes of its metadata; no other library has been
    seen to.
    """
    if Path(path).suffix.lower() not in (*MatReader.suffixes, *Hdf5Reader.suffixes):
        return False
    import h5py

    return bool(h5py.is_hdf5(path))
