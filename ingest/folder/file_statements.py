"""What the recordings of a folder say of themselves, before anybody has described the campaign:
channels, units, rates, sensors and dates, each from the files' own headers."""

from __future__ import annotations

import datetime as dt
import re
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from ...files.delimited_text import decode_utf8
from ...parallel.read_ahead import map_ahead
from ..errors import IngestError
from ..readers import (
    AS_IN_FILE,
    ReadingOptions,
    RecordingError,
    all_readers,
    may_crash,
    open_recording,
)
from ..readers.contents import one_line, reading_apart
from ..readers.start_times import CLOCK_ZERO, parsed_instant
from .campaign_file import FILE as CAMPAIGN
from .runs_table import FILES

#: Receives (files done, their number, the file's path).
Progress = Callable[[int, int, str], None]
#: Files of a folder that are looked at; a campaign has hundreds.
MOST_FILES = 20_000
#: Opening a file takes milliseconds; one that takes longer than this never ends.
_PATIENCE_S = 60.0
#: Fields of a header that say something of the sensor, which a person wants to see.
_OF_SENSOR = re.compile(
    r"sensor|serial|model|manufacturer|calib|certificate|sensitiv|range|gain|position|location|"
    r"axis|direction|coupling|channel.?name",
    re.IGNORECASE,
)
_DAY = re.compile(r"(?<!\d)(\d{4})[-/.](\d{2})[-/.](\d{2})(?!\d)")
_NAMES_A_DAY = re.compile(r"date|time|start|stamp", re.IGNORECASE)
#: Readings before this are of a clock that was never set.
_EARLIEST = dt.date(1971, 1, 1)
#: Hints of one channel that a page shows, and letters of each.
_MOST_HINTS, _LONGEST_HINT = 6, 80


@dataclass(frozen=True)
class FileStatement:
    """One file: its channels with what each says, its day and operator where it states them; or the
    `fault` for which it cannot be read."""

    path: str
    channels: tuple[tuple[str, str | None, float | None, int], ...] = ()
    headers: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    day: str | None = None
    operator: str | None = None
    without_rate: bool = False
    fault: str | None = None


@dataclass(frozen=True)
class StatedChannel:
    """A channel over all files. `units` and `rates_hz` as the files state them, each once; `hints`
    are further fields of their headers."""

    name: str
    files: int
    units: tuple[str, ...]
    rates_hz: tuple[float, ...]
    samples: int
    hints: Mapping[str, str]


@dataclass(frozen=True)
class FolderStatements:
    """`files` in the order of their paths; `modal_tables` are tables of modes beside them, and
    `runs_table` is the name of the table of runs, where one is there."""

    files: tuple[FileStatement, ...]
    modal_tables: tuple[str, ...] = ()
    runs_table: str | None = None

    @property
    def readable(self) -> tuple[FileStatement, ...]:
        """Those that are recordings and can be read."""
        return tuple(file for file in self.files if file.fault is None)

    @property
    def channels(self) -> tuple[StatedChannel, ...]:
        """Every channel that a readable file has, in the order in which they appear."""
        names = dict.fromkeys(name for file in self.readable for name, *_ in file.channels)
        return tuple(self._channel(name) for name in names)

    @property
    def days(self) -> Counter[str]:
        """Days that the files state, each with the number of files."""
        return Counter(file.day for file in self.readable if file.day)

    @property
    def operators(self) -> tuple[str, ...]:
        """Operators that the files state."""
        return tuple(dict.fromkeys(file.operator for file in self.readable if file.operator))

    @property
    def without_rate(self) -> int:
        """How many of the files state no sampling rate."""
        return sum(file.without_rate for file in self.readable)

    def _channel(self, name: str) -> StatedChannel:
        entries = [
            (file, unit, rate, samples)
            for file in self.readable
            for own, unit, rate, samples in file.channels
            if own == name
        ]
        hints: dict[str, str] = {}
        for file, *_ in entries:
            hints |= file.headers.get(name, {})
        return StatedChannel(
            name,
            len(entries),
            tuple(dict.fromkeys(unit for _, unit, _, _ in entries if unit)),
            tuple(sorted({rate for _, _, rate, _ in entries if rate is not None})),
            max(samples for *_, samples in entries),
            dict(list(hints.items())[:_MOST_HINTS]),
        )


def read_statements(
    folder: Path,
    options: ReadingOptions = AS_IN_FILE,
    progress: Progress | None = None,
    *,
    processes: int = 1,
) -> FolderStatements:
    """Open every recording of a folder, and note what it says of itself; no sample is kept.

    Parameters:
        folder: The folder, with its recordings at any depth.
        options: What is known of the files already, where they do not say it.
        progress: Receives the files done, their number and the path; by default nobody is told.
        processes: How many processes open files at the same time.

    Raises:
        IngestError: Where there is no such folder, or neither a recording nor a table of runs
            in it.
    """
    if not folder.is_dir():
        raise IngestError(f"{folder}: no such folder; expected a folder of recordings")
    names = sorted(
        path.relative_to(folder).as_posix()
        for path in folder.rglob("*")
        if path.is_file() and not any(part.startswith(".") for part in path.parts[-3:])
    )
    tables = [name for name in names if _is_modal_table(folder / name)]
    suffixes = {suffix for reader in all_readers() for suffix in reader.suffixes}
    recordings = [
        name
        for name in names[:MOST_FILES]
        if Path(name).suffix.lower() in suffixes and name not in (*FILES, CAMPAIGN, *tables)
    ]
    there = next((name for name in FILES if (folder / name).is_file()), None)
    if not recordings and there is None:
        endings = ", ".join(sorted(suffixes))
        raise IngestError(
            f"{folder.name}: no recording; expected files with one of these endings: {endings}"
        )
    crashing = any(may_crash(folder / name) for name in recordings)
    isolation = reading_apart(_never_read, lambda _: _PATIENCE_S, always=crashing)
    files = []
    results = map_ahead(partial(read_statement, folder, options), recordings, processes, isolation)
    for done, (name, statement) in enumerate(results, 1):
        files.append(statement)
        if progress:
            progress(done, len(recordings), name)
    return FolderStatements(tuple(files), tuple(tables), there)


def _never_read(name: str) -> FileStatement:
    return FileStatement(
        name, fault=f"{name}: the library that reads it crashed or did not end; it is damaged"
    )


def read_statement(folder: Path, options: ReadingOptions, name: str) -> FileStatement:
    """What one file says of itself.

    Parameters:
        folder: The folder of the file.
        options: What is known of the files already.
        name: The path of the file within the folder.
    """
    try:
        return _opened(folder, name, options, has_rate=True)
    except RecordingError as error:
        if options.sampling_rate_hz is None:
            # With a rate of our own its channels are shown, and the rate is asked for.
            stated = ReadingOptions(**{**vars(options), "sampling_rate_hz": 1.0})
            try:
                return _opened(folder, name, stated, has_rate=False)
            except RecordingError:
                pass  # the first message says what is wrong with the file as it is
        return FileStatement(name, fault=one_line(str(error)))


def _opened(folder: Path, name: str, options: ReadingOptions, *, has_rate: bool) -> FileStatement:
    with open_recording(folder / name, options) as recording:
        channels, headers, days, operators = [], {}, [], []
        for info in recording.channels:
            unit = (info.unit or "").strip() or None
            rate = info.sampling_rate_hz if has_rate else None
            channels.append((info.name, unit, rate, info.samples))
            headers[info.name] = _hints(info.header)
            days += _days(info.header)
            operators += [
                str(value).strip()
                for key, value in info.header.items()
                if key.strip().lower() == "operator" and str(value).strip()
            ]
    return FileStatement(
        name,
        tuple(channels),
        headers,
        min(days, default=None),
        next(iter(operators), None),
        not has_rate,
    )


def _hints(header: Mapping[str, Any]) -> dict[str, str]:
    texts = {
        key: " ".join(str(value).split())[:_LONGEST_HINT]
        for key, value in header.items()
        if _OF_SENSOR.search(key) and not isinstance(value, list | dict)
    }
    return {key: text for key, text in texts.items() if text}


def _days(header: Mapping[str, Any]) -> list[str]:
    """ISO days of a header: of the instant at which time is 0, else of fields that name a day."""
    instant = parsed_instant(header.get(CLOCK_ZERO))
    texts = [str(instant)] if instant is not None else []
    texts += [
        value
        for key, value in header.items()
        if isinstance(value, str) and _NAMES_A_DAY.search(key)
    ]
    days = []
    for text in texts:
        match = _DAY.search(text)
        try:
            day = dt.date(*(int(part) for part in match.groups())) if match else None
        except ValueError:  # 2026/13/40 is no day
            continue
        if day is not None and day >= _EARLIEST:
            days.append(day.isoformat())
            break
    return days


def _is_modal_table(path: Path) -> bool:
    """Whether a CSV file begins as a table of modes does."""
    if path.suffix.lower() != ".csv":
        return False
    try:
        with path.open("rb") as file:
            head = decode_utf8(file.read(4096).rsplit(b"\n", 1)[0])
    except (OSError, ValueError):  # not readable, or no text: the readers say so of recordings
        return False
    return head.lstrip().lower().startswith("mode") and "frequency_hz" in head.splitlines()[0]
