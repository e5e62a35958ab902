"""The files of one recording: one, or several that hold some of its channels each."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path, PureWindowsPath
from typing import Any

from numpy.typing import NDArray

from . import (
    AS_IN_FILE,
    ChannelInfo,
    OpenRecording,
    ReadingOptions,
    RecordingError,
    may_crash,
    open_recording,
    reader_for,
)
from .start_times import CLOCK_ZERO, parsed_instant, seconds_between

#: Between the files of a recording, in the cell that names them and in the path that is stored.
SEPARATOR = ";"


def recording_path(folder: Path, text: str) -> str:
    """The path of a recording as it is stored, relative to the campaign's folder, from a cell that
    names its files.

    Folders are parted by / or \\ there and by / in the store, and several files are sorted, so that
    the same recording has the same path whoever writes it on whatever system. Raises `ValueError`
    with what was expected.
    """
    whole = text.replace("\\", "/")
    names = (
        [whole] if SEPARATOR not in whole or _is_file(folder / whole) else whole.split(SEPARATOR)
    )
    paths = sorted(_path_of_file(folder, name.strip(), several=len(names) > 1) for name in names)
    if len(set(paths)) < len(paths):
        raise ValueError("different files; one of them is named twice")
    return SEPARATOR.join(paths)


def _path_of_file(folder: Path, name: str, *, several: bool) -> str:
    root = folder.resolve()
    windows = PureWindowsPath(name)
    try:
        path = (folder / name).resolve()
        inside = bool(name) and path.is_relative_to(root) and not windows.drive and not windows.root
    except (OSError, RuntimeError, ValueError):  # a loop of links, a name no file can have
        inside = False
    if not inside:
        raise ValueError(
            "a file inside the campaign folder" + (f"; {name!r} is none" if several else "")
        )
    if not _is_file(path):
        named = f"called {name!r}" if several else "of that name"
        raise ValueError(f"a file of the campaign folder; there is none {named}")
    return path.relative_to(root).as_posix()


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


@dataclass(frozen=True)
class RecordingFiles:
    """The files behind a stored `path` of the campaign in `folder`."""

    folder: Path
    path: str
    reading: ReadingOptions = AS_IN_FILE

    @property
    def paths(self) -> tuple[Path, ...]:
        """At least one, in the order of the stored path."""
        if SEPARATOR not in self.path or _is_file(self.folder / self.path):
            return (self.folder / self.path,)
        return tuple(self.folder / name for name in self.path.split(SEPARATOR))

    @property
    def name(self) -> str:
        """For messages, without folders."""
        return SEPARATOR.join(path.name for path in self.paths)

    @property
    def size_bytes(self) -> int:
        """Of all files together. Raises `OSError`."""
        return sum(path.stat().st_size for path in self.paths)

    @property
    def format(self) -> str:
        """The short names of the files' formats. Raises `RecordingError` where there is no reader
        for one."""
        return "+".join(dict.fromkeys(reader_for(path).format for path in self.paths))

    @property
    def may_crash(self) -> bool:
        """As `readers.may_crash`, of any of the files."""
        return any(may_crash(path) for path in self.paths)

    def sha256(self) -> str:
        """Of the file; of several, of their SHA-256s, a line each. Raises `RecordingError` when one
        cannot be read."""
        hashes = [file_hash(path) for path in self.paths]
        return (
            hashes[0]
            if len(hashes) == 1
            else hashlib.sha256("\n".join(hashes).encode()).hexdigest()
        )

    def open(self) -> OpenRecording:
        """The recording, held open: use as a context manager. Raises `RecordingError`."""
        paths = self.paths
        return (
            open_recording(paths[0], self.reading)
            if len(paths) == 1
            else JoinedRecording(paths, self.reading)
        )


def file_hash(path: Path) -> str:
    """SHA-256 of a file, read in pieces. Raises `RecordingError` when it cannot be read."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise RecordingError(f"{path.name}: cannot be read: {error.strerror}") from error


class JoinedRecording(OpenRecording):
    """Several files as one recording, each channel with the rate and start of its own file.

    Where every file says at which instant its time is 0, all start on one clock; else they begin
    together.

    A channel that two of the files have is refused when it is asked for: nobody can say which is
    meant.
    """

    def __init__(self, paths: Sequence[Path], reading: ReadingOptions = AS_IN_FILE) -> None:
        with ExitStack() as stack:
            self._files = [
                (path.name, stack.enter_context(open_recording(path, reading))) for path in paths
            ]
            self._stack = stack.pop_all()
        self._later_s = _later_s([recording for _, recording in self._files])
        by_name: dict[str, ChannelInfo] = {}
        for (_, file), later_s in zip(self._files, self._later_s, strict=True):
            for channel in file.channels:
                by_name.setdefault(
                    channel.name, replace(channel, start_s=channel.start_s + later_s)
                )
        self.channels = tuple(by_name.values())

    def names(self, name: str) -> bool:
        return bool(self._holders(name))

    def info(self, name: str) -> ChannelInfo:
        holders = self._holders(name)
        if len(holders) > 1:
            named = " and in ".join(file for file, _ in holders)
            raise RecordingError(f"channel {name!r} is in {named}; expected it in one of the files")
        if not holders:
            return super().info(name)
        info = holders[0][1].info(name)
        later_s = next(
            s for (_, f), s in zip(self._files, self._later_s, strict=True) if f is holders[0][1]
        )
        return replace(info, start_s=info.start_s + later_s)

    def read(self, name: str, start: int = 0, stop: int | None = None) -> NDArray[Any]:
        self.info(name)
        return self._holders(name)[0][1].read(name, start, stop)

    def _holders(self, name: str) -> list[tuple[str, OpenRecording]]:
        return [(file, recording) for file, recording in self._files if recording.names(name)]

    def close(self) -> None:
        self._stack.close()


def _later_s(recordings: Sequence[OpenRecording]) -> list[float]:
    """By how much the zero of each file's clock is later than the earliest; nothing where one of
    them says none."""
    zeros = [
        next((c.header[CLOCK_ZERO] for c in file.channels if CLOCK_ZERO in c.header), None)
        for file in recordings
    ]
    stated = [instant for instant in map(parsed_instant, zeros) if instant is not None]
    if len(stated) < len(recordings):
        return [0.0] * len(recordings)
    return [seconds_between(min(stated), instant) for instant in stated]
