"""What every reader gives: a description of the file first, then samples on demand.

A reader is one file in this folder and one line in `readers/__init__.py`. It opens a recording as
an `OpenRecording`, whose `channels` cost no sample to know (where the format allows it) and whose
`read` returns exactly the numbers in the file: same values, same dtype, no unit applied. Units and
sensitivities are applied once, by `ingest.channel`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, ClassVar, Self

from numpy.typing import NDArray

from .field_rules import FieldRule

#: A channel longer than this is refused unread: 2**31 samples are 12 hours at 51.2 kHz.
MAX_SAMPLES_PER_CHANNEL = 2**31
#: A file may declare at most this many times its own size (zstd and gzip reach a few hundred on
#: constant data).
MAX_EXPANSION = 1000
#: ... but anything below this is harmless whatever the file's size.
HARMLESS_BYTES = 64 * 2**20


class RecordingError(ValueError):
    """A recording cannot be read whole; the message names the file, what was found and what was
    expected."""


@dataclass(frozen=True)
class ReadingOptions:
    """What a laboratory says of its files where these do not: `[recordings]` of campaign.toml,
    options of a command.

    `columns` are the names of columns in order, where a file has none, with a unit if need be
    (`force [N]`); `delimiter` and `decimal` are signs, for text that could be read in two ways.
    `harmless_fields` are fields of the files (or patterns of them) that the laboratory knows to
    change no number. `resample_uneven_time` puts samples whose own times are uneven on an even
    grid; without it such a file is refused.
    """

    columns: tuple[str, ...] = ()
    sampling_rate_hz: float | None = None
    delimiter: str | None = None
    decimal: str | None = None
    harmless_fields: tuple[str, ...] = ()
    resample_uneven_time: bool = False


AS_IN_FILE = ReadingOptions()


@dataclass(frozen=True)
class ChannelInfo:
    """One channel as the file declares it."""

    name: str
    samples: int
    dtype: str  # numpy dtype string of what `read` returns, e.g. "<f4"
    sampling_rate_hz: float
    start_s: float = 0.0
    unit: str | None = None  # the file's own words, None where it says nothing
    header: dict[str, Any] = field(
        default_factory=dict
    )  # what else the file says, JSON-serialisable


class OpenRecording(ABC):
    """A recording held open. Use as a context manager.

    Raises `RecordingError` from any method when the file is damaged, truncated, or declares more
    than it holds.
    """

    channels: tuple[ChannelInfo, ...]

    @abstractmethod
    def read(self, name: str, start: int = 0, stop: int | None = None) -> NDArray[Any]:
        """Samples of a channel as they are in the file.

        Parameters:
            name: The name of the channel.
            start: The first sample; by default that of the record.
            stop: The sample before which the slice ends; by default (None) the end of the record.

        Returns:
            The samples (n,) in native byte order, with the dtype of the file.
        """

    def names(self, name: str) -> bool:
        """Whether the file has something of a name, be it readable or not.

        Parameters:
            name: The name of a channel. Repeated blanks count as one.
        """
        return any(
            collapse_blanks(channel.name) == collapse_blanks(name) for channel in self.channels
        )

    def close(self) -> None:  # noqa: B027 - a recording read at once has nothing to release
        """Release the file. The default holds nothing."""

    def info(self, name: str) -> ChannelInfo:
        """What the file declares of a channel.

        Parameters:
            name: The name of the channel, or that of the only one so called but for repeated
                blanks.

        Raises:
            RecordingError: Where there is no such channel, or several are alike; the message names
                those there are.
        """
        for channel in self.channels:
            if channel.name == name:
                return channel
        alike = [
            channel
            for channel in self.channels
            if collapse_blanks(channel.name) == collapse_blanks(name)
        ]
        if len(alike) == 1:
            return alike[0]
        if alike:
            names = ", ".join(repr(channel.name) for channel in alike)
            raise RecordingError(
                f"{name!r} can be each of {names}; expected the name as the file has it"
            )
        channel_names = ", ".join(c.name for c in self.channels) or "none"
        raise RecordingError(f"no channel {name!r}; the file has: {channel_names}")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


class Reader(ABC):
    """One file format."""

    format: ClassVar[str]  # short name stored with the recording: "mat", "tdms"
    suffixes: ClassVar[tuple[str, ...]]  # lower case, with the dot
    fields: ClassVar[
        tuple[FieldRule, ...]
    ] = ()  # what the format can say beside its samples, and what becomes of it

    @abstractmethod
    def open(self, path: Path, options: ReadingOptions = AS_IN_FILE) -> OpenRecording:
        """Open a recording.

        Parameters:
            path: The file of the recording.
            options: What a laboratory says of its files where these do not; by default nothing.

        Raises:
            RecordingError: When it is not a whole file of this format, or contradicts `options`.
        """


def collapse_blanks(name: str) -> str:
    """A name with one blank for every run of blanks: instruments print `Force  1`, people write
    `Force 1`.

    Parameters:
        name: The name of a channel. Blanks at its ends are left out.
    """
    return " ".join(name.split())


def refuse_bomb(path: Path, name: str, samples: int, itemsize: int) -> None:
    """Look whether a file can hold what it declares, before memory is allocated for it.

    Parameters:
        path: The file of the recording.
        name: The name of the channel, for the message.
        samples: The number of samples that the file declares.
        itemsize: The size of one sample in bytes.

    Raises:
        RecordingError: When the declared size is beyond anything the file can hold.
    """
    declared = samples * itemsize
    held = path.stat().st_size
    if samples > MAX_SAMPLES_PER_CHANNEL:
        raise RecordingError(
            f"{path.name}: channel {name!r} declares {samples} samples, more "
            f"than {MAX_SAMPLES_PER_CHANNEL}"
        )
    if declared > HARMLESS_BYTES and declared > MAX_EXPANSION * held:
        raise RecordingError(
            f"{path.name}: channel {name!r} declares {declared} bytes in a file of {held}; "
            f"more than {MAX_EXPANSION} times the file is refused"
        )


def rate_from_step(step_s: float, relative: float = 1e-9) -> float:
    """Sampling rate of a step: the roundest number the step allows.

    Recorders run at round rates and files print steps with few digits: UFF 58 keeps six, so that
    51200 Hz comes back as 1.95313e-05 s, which alone would give 51199.87 Hz.

    Parameters:
        step_s: The time from sample to sample.
        relative: The share of itself to within which the step is known; by default 1e-9.

    Returns:
        The sampling rate in Hz.
    """
    rate = 1.0 / step_s
    for decimals in range(-6, 4):
        candidate = round(rate, decimals)
        if candidate > 0 and abs(candidate - rate) <= relative * rate:
            return candidate
    return rate
