"""What a format's own code gives: the arrays of a file, undecided which is time, rate or channel.
Here alone a library's exception or warning becomes a `RecordingError`, and calls into a C library
that never come back have an end.

A wrong byte in an HDF5 file can make libhdf5 walk in circles. No Python code runs meanwhile, so
that only the system can end it: by a timer of processor time, which a slow disk or network does not
use up.
"""

from __future__ import annotations

import io
import math
import os
import re
import signal
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...parallel.read_ahead import Isolation
from ...signals.units import SI_UNITS, UnitError, to_si
from .base import RecordingError
from .field_rules import FieldRule

Item = TypeVar("Item")
Result = TypeVar("Result")

RATE_NAMES = frozenset(
    {"fs", "fs_hz", "sampling_rate", "sampling_rate_hz", "sample_rate", "sample_rate_hz"}
)
RATE_UNITS = {"": 1.0, "hz": 1.0, "1/s": 1.0, "s/s": 1.0, "sps": 1.0, "khz": 1e3, "mhz": 1e6}
TIME_UNITS = {
    **dict.fromkeys(
        (
            "s",
            "sec",
            "secs",
            "second",
            "seconds",
            "sekunde",
            "sekunden",
            "seconde",
            "secondes",
            "с",
            "秒",
        ),
        1.0,
    ),
    **dict.fromkeys(
        (
            "ms",
            "msec",
            "msecs",
            "millisecond",
            "milliseconds",
            "millisekunden",
            "millisecondes",
            "мс",
            "毫秒",
        ),
        1e-3,
    ),
    **dict.fromkeys(
        ("us", "usec", "usecs", "microsecond", "microseconds", "µs", "μs", "мкс", "微秒"), 1e-6
    ),
    **dict.fromkeys(("ns", "nsec", "nanosecond", "nanoseconds"), 1e-9),
    "ps": 1e-12,
    **dict.fromkeys(("min", "mins", "minute", "minutes", "minuten"), 60.0),
    **dict.fromkeys(("h", "hr", "hrs", "hour", "hours", "stunden"), 3600.0),
}
#: What instruments and people call time, in the languages of laboratories; compared without case.
_TIME_WORDS = (
    r"t|times?|zeit(?:en|achse|basis|stempel)?|messzeit|temps|tiempos?|tempo|tempi|tijd|tid|czas|"
    r"čas|cas|idő|ido|время|zaman|waktu|χρόνος|时间|時間|时刻|時刻|시간|"
    r"time ?(?:stamps?|axis|base|vector|column)|x[ _-]?values?"
)
#: `Elapsed time`, `rel. Zeit`.
_BEFORE_TIME = (
    r"(?:elapsed|relative|rel\.?|recording|measurement|sample|absolute|abs\.?|relativ(?:e|er)?|"
    r"abgelaufene) "
)
_UNIT_WORDS = "|".join(sorted(map(re.escape, TIME_UNITS), key=len, reverse=True))
#: `time`, `Zeit`, `t_ms`, `Time/ms`, `Zeit in ms`, `temps, s`.
_TIME_NAME = re.compile(
    rf"(?:{_BEFORE_TIME})?(?:{_TIME_WORDS})(?:(?:_| in |/| ?[,:] ?| )({_UNIT_WORDS}))?\.?",
    re.IGNORECASE,
)
#: A column that has a unit for a name: `(ms)`, `[s]`, `seconds`.
_UNIT_AS_NAME = re.compile(
    rf"[\[(<] ?({_UNIT_WORDS}) ?[\])>]|([mnuµμ]s|[a-z]{{3,}})", re.IGNORECASE
)
_VOLTS = {"v", "volt", "volts"}
_BRACKETED = re.compile(r"(.*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\))")


@dataclass(frozen=True)
class Array:
    """One array as the file declares it; `take(start, stop)` reads those samples of it,
    flattened."""

    name: str
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    take: Callable[[int, int], NDArray[Any]]
    group: str = ""  # "a/b" of a nested file
    unit: str | None = None
    rate_hz: Any = None  # where the file gives the array its own
    start_s: float = 0.0
    times_s: Floats | None = (
        None  # of its samples, where the file gives the array its own: rate and start follow
    )
    header: dict[str, Any] = field(default_factory=dict)
    fields: Mapping[str, Any] = field(
        default_factory=dict
    )  # what is stated of it: held against `Contents.rules`
    nameless: bool = False  # `name` is ours: the file has none
    rises_as_time: bool = False  # time by its unit, whatever its name
    obstacle: str | None = (
        None  # why no channel can be made of it, as `unread_field` says it; others can be read
    )

    @property
    def samples(self) -> int:
        return math.prod(self.shape)

    @property
    def is_rate(self) -> bool:
        return self.name.lower() in RATE_NAMES

    @property
    def is_time(self) -> bool:
        return self.rises_as_time or is_time_name(self.name)


@dataclass(frozen=True)
class Contents:
    """All arrays of a file, the sampling rate it states once (any type, unchecked), and its other
    statements.

    `statements` are texts and attributes by group ("" is the root). With `rules` they, scalars and
    the fields of each array are held against these; without, the reader has done so.
    """

    arrays: list[Array]
    rate_hz: Any = None
    header: dict[str, Any] = field(default_factory=dict)
    statements: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    rules: Sequence[FieldRule] | None = None


def in_memory(name: str, values: NDArray[Any], **details: Any) -> Array:
    """An array that is in memory already."""

    def take(start: int, stop: int) -> NDArray[Any]:
        return values.reshape(-1)[start:stop].copy()

    return Array(name, values.shape, values.dtype, take, **details)


def lazy_array(load: Callable[[], NDArray[Any]]) -> Callable[[int, int], NDArray[Any]]:
    """`take` of an array that its format can only read whole: read at the first call, kept until
    the file closes."""
    whole = cache(load)

    def take(start: int, stop: int) -> NDArray[Any]:
        return whole().reshape(-1)[start:stop].copy()

    return take


def is_clock_name(name: str) -> bool:
    """Whether a column of this name is a time or a rate."""
    return name.lower() in RATE_NAMES or is_time_name(name)


@lru_cache(maxsize=1024)
def is_time_name(name: str) -> bool:
    """Whether a column of this name is time: a word for it in some language, or a unit of time
    alone."""
    return _TIME_NAME.fullmatch(_words(name)) is not None or _unit_as_name(name) is not None


def _words(name: str) -> str:
    return " ".join(name.split())


def _unit_as_name(name: str) -> str | None:
    match = _UNIT_AS_NAME.fullmatch(_words(name))
    unit = (match.group(1) or match.group(2)) if match else None
    return unit if unit is not None and unit.lower() in TIME_UNITS else None


def unit_in_time_name(name: str) -> str | None:
    """The unit that the name of a time column carries: `t_ms`, `Zeit in ms`, `(ms)`; None where it
    carries none."""
    match = _TIME_NAME.fullmatch(_words(name))
    return match.group(1) if match is not None and match.group(1) else _unit_as_name(name)


def time_scale(name: str, unit: str | None) -> float | None:
    """Seconds per unit of a time column called `name`; None for an unknown unit."""
    unit_text = unit.strip() if unit and unit.strip() else (unit_in_time_name(name) or "s")
    return TIME_UNITS.get(unit_text.strip(".").lower())


def is_unit(text: str) -> bool:
    """Whether `text` is a unit of time or of a quantity that a channel can measure."""
    if text.strip().lower() in TIME_UNITS or text.strip().lower() in RATE_UNITS:
        return True
    for quantity in SI_UNITS:
        try:
            to_si(text, quantity)
        except UnitError:
            continue
        return True
    return False


def same_unit(first: str, second: str) -> bool:
    """Whether two texts say one unit: `m/s2` and `m/s^2`, `V` and `Volts`."""
    if first.strip().lower() == second.strip().lower() or {first.lower(), second.lower()} <= _VOLTS:
        return True
    for quantity in SI_UNITS:
        try:
            return to_si(first, quantity) == to_si(second, quantity)
        except UnitError:
            continue
    return False


def name_and_unit(label: str) -> tuple[str, str | None]:
    """`force [N]` -> (`force`, `N`). Round brackets count where they hold a unit: `acc (top)` is a
    name."""
    match = _BRACKETED.fullmatch(label.strip())
    if match is None or not match.group(1):
        return label.strip(), None
    if match.group(2) is not None:
        return match.group(1), match.group(2).strip()
    return (
        (match.group(1), match.group(3).strip())
        if is_unit(match.group(3))
        else (label.strip(), None)
    )


def to_python(value: Any) -> Any:
    """A header value as JSON holds it."""
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    if isinstance(value, np.ndarray):
        return (
            to_python(value.reshape(-1)[0])
            if value.size == 1
            else [to_python(v) for v in value.reshape(-1)[:64]]
        )
    if isinstance(value, np.longdouble):
        return float(value)  # its `item` is no Python float
    if isinstance(value, np.generic) and value.dtype.kind in "biuf":
        return value.item()
    return value if value is None or isinstance(value, bool | int | float | str) else str(value)


#: What a library says about itself, not about the file.
_ABOUT_THE_LIBRARY = (
    DeprecationWarning,
    PendingDeprecationWarning,
    FutureWarning,
    ImportWarning,
    ResourceWarning,
)
_LONGEST_REASON = 400


def one_line(text: object) -> str:
    """A message on one line, shortened: a damaged file can put kilobytes into a name.

    What cannot be printed is replaced: no database takes NUL or half a character, and no terminal
    should take the rest.
    """
    line = "".join(sign if sign.isprintable() else "\ufffd" for sign in " ".join(str(text).split()))
    return line if len(line) <= _LONGEST_REASON else line[:_LONGEST_REASON] + "…"


class BoundedFile(io.BufferedReader):
    """A file of which nobody asks for more than there is: libraries read parts of whatever length
    these declare."""

    def read(self, size: int | None = -1, /) -> bytes:
        rest = max(0, os.fstat(self.fileno()).st_size - self.tell())
        return super().read(rest if size is None or size < 0 else min(size, rest))


@contextmanager
def translate_errors(path: Path) -> Iterator[None]:
    """Turn whatever goes wrong inside into a `RecordingError` that names `path`; warnings count as
    errors.

    Seen on damaged files: OSError, EOFError, ValueError, TypeError, KeyError, IndexError,
    AttributeError, OverflowError, MemoryError, NotImplementedError, RuntimeError, SyntaxError
    (numpy's and lvm_read's literals), UnicodeError, struct.error, zlib.error, zipfile.BadZipFile,
    scipy's MatReadError and MatReadWarning, pandas' ParserError and ParserWarning, pyarrow's
    ArrowInvalid, and pyuff's bare `Exception`: hence no list below.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            for kind in _ABOUT_THE_LIBRARY:
                warnings.simplefilter("ignore", kind)
            yield
    except RecordingError as error:
        if one_line(error) == str(error):
            raise
        raise RecordingError(one_line(error)) from error
    except FileNotFoundError as error:
        raise RecordingError(f"{path.name}: no such file: {path}") from error
    except Exception as error:
        reason = one_line(error) or type(error).__name__
        raise RecordingError(
            f"{path.name}: damaged, or not what its suffix says: {reason}"
        ) from error


def refuse_nothing(path: Path) -> None:
    """Raise `RecordingError` for a folder or an empty file."""
    if path.is_dir():
        raise RecordingError(f"{path.name}: is a folder; expected a recording file")
    if path.stat().st_size == 0:
        raise RecordingError(f"{path.name}: is empty (0 bytes); expected a recording")


#: Processor time of a call: a file of a megabyte is opened and read in hundredths of a second.
_CALL_S, _FILE_BYTES_PER_S, _SAMPLE_BYTES_PER_S = 3.0, 1e6, 50e6
_ends_process = False


def end_this_process_when_stuck() -> None:
    """From now on a call that takes too long ends this process, which must hold nothing that
    matters."""
    global _ends_process  # it is the process that is so, and no call's argument
    _ends_process = hasattr(signal, "setitimer")  # not on Windows


def seconds_for(file_bytes: int, sample_bytes: int = 0) -> float:
    """Far above what a call needs that reads `sample_bytes` of samples from a file of
    `file_bytes`."""
    return _CALL_S + file_bytes / _FILE_BYTES_PER_S + sample_bytes / _SAMPLE_BYTES_PER_S


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """A call that may take so much processor time, where `end_this_process_when_stuck`."""
    if not _ends_process:
        yield
        return
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def reading_apart(
    lost: Callable[[Item], Result], patience_s: Callable[[Item], float], *, always: bool = False
) -> Isolation[Item, Result]:
    """How files are read in processes of their own: each ends when a C library never comes back."""
    preload = ("pyroshock.ingest.load", "scipy.interpolate")
    return Isolation(lost, patience_s, always, end_this_process_when_stuck, preload)
