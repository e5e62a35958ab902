"""Readers of raw recordings: one per file format, listed here or added by other packages."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from ...plugins import READERS as READER_GROUP
from ...plugins import Loaded, load, taken
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

#: Every reader that is shipped; a new format is a file in this folder and a line here.
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
    "added_readers",
    "all_readers",
    "may_crash",
    "open_recording",
    "reader_for",
]


def reader_for(path: Path) -> Reader:
    """The reader of the path's suffix.

    Parameters:
        path: The file of the recording. Only its name is looked at; capital letters of the suffix
            do not matter.

    Raises:
        RecordingError: Where no reader has this suffix; the message names the known suffixes.
    """
    suffix = Path(path).suffix.lower()
    for reader in READERS:
        if suffix in reader.suffixes:
            return reader
    added = added_readers()
    for reader in added.objects.values():
        if suffix in reader.suffixes:
            return reader
    suffixes = ", ".join(suffix for reader in all_readers() for suffix in reader.suffixes)
    message = f"no reader for {suffix or 'a file without suffix'}; known: {suffixes}"
    raise RecordingError("; ".join([f"{Path(path).name}: {message}", *added.failures.values()]))


def all_readers() -> tuple[Reader, ...]:
    """Those that are shipped, then those of other packages."""
    return (*READERS, *added_readers().objects.values())


@cache
def added_readers() -> Loaded[Reader]:
    """Those of other packages, by format. Raises `PluginError` for a format or a suffix that is
    taken."""
    added = load(READER_GROUP, _accepted, [reader.format for reader in READERS])
    owners = {suffix: "pyroshock" for reader in READERS for suffix in reader.suffixes}
    for name, reader in added.objects.items():
        plugin = added.plugins[name]
        for suffix in reader.suffixes:
            if suffix in owners:
                raise taken(plugin, f"{owners[suffix]} reads files with the suffix {suffix}")
            owners[suffix] = f"{plugin.package} {plugin.version}"
    return added


def _accepted(name: str, kind: Any) -> Reader:
    if not (isinstance(kind, type) and issubclass(kind, Reader)):
        raise TypeError(f"expected a class derived from pyroshock.ingest.readers.Reader: {kind!r}")
    reader = kind()
    if reader.format != name:
        raise ValueError(f"its format is {reader.format!r}; expected the entry point's name")
    suffixes = reader.suffixes
    if not (isinstance(suffixes, tuple) and suffixes) or not all(
        suffix.startswith(".") and suffix == suffix.lower() for suffix in suffixes
    ):
        raise ValueError(f"its suffixes are {suffixes!r}; expected lower case, with the dot")
    return reader


def open_recording(path: Path, options: ReadingOptions = AS_IN_FILE) -> OpenRecording:
    """A recording, held open: use as a context manager.

    Parameters:
        path: The file of the recording.
        options: What a laboratory says of its files where these do not; by default nothing.

    Raises:
        RecordingError: Where no reader has the file's suffix, and as `Reader.open`.
    """
    return reader_for(path).open(Path(path), options)


def may_crash(path: Path) -> bool:
    """Whether a damaged file like this can crash the process that reads it, or hold it for ever.

    libhdf5 does either on about one in 3000 wrong bytes of its metadata; no other library has been
    seen to.

    Parameters:
        path: The file of the recording. One with a suffix of MAT or HDF5 is opened for a look at
            its signature.
    """
    if Path(path).suffix.lower() not in (*MatReader.suffixes, *Hdf5Reader.suffixes):
        return False
    import h5py

    return bool(h5py.is_hdf5(path))
