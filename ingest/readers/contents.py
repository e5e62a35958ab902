"""What a format's own code gives: the arrays of a file, undecided which is time, rate or channel."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...signals.units import SI_UNITS, UnitError, to_si

RATE_NAMES = frozenset({"fs", "fs_hz", "sampling_rate", "sampling_rate_hz", "sample_rate", "sample_rate_hz"})
RATE_UNITS = {"": 1.0, "hz": 1.0, "1/s": 1.0, "s/s": 1.0, "sps": 1.0, "khz": 1e3, "mhz": 1e6}
TIME_UNITS = {
    **dict.fromkeys(("s", "sec", "second", "seconds"), 1.0),
    **dict.fromkeys(("ms", "msec", "milliseconds"), 1e-3),
    **dict.fromkeys(("us", "usec", "microseconds", "µs", "μs"), 1e-6),
    **dict.fromkeys(("ns", "nsec", "nanoseconds"), 1e-9),
    "ps": 1e-12,
}
_TIME_NAME = re.compile(r"(?:t|time)(?:_(s|sec|ms|msec|us|usec|ns|nsec))?", re.IGNORECASE)
_BRACKETED = re.compile(r"(.*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\))")


@dataclass(frozen=True)
class Array:
    """One array as the file declares it; `take(start, stop)` reads those samples of it, flattened."""

    name: str
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    take: Callable[[int, int], NDArray[Any]]
    group: str = ""  # "a/b" of a nested file
    unit: str | None = None
    rate_hz: Any = None  # where the file gives the array its own
    start_s: float = 0.0
    header: dict[str, Any] = field(default_factory=dict)
    nameless: bool = False  # `name` is ours: the file has none

    @property
    def samples(self) -> int:
        return math.prod(self.shape)

    @property
    def is_rate(self) -> bool:
        return self.name.lower() in RATE_NAMES

    @property
    def is_time(self) -> bool:
        return _TIME_NAME.fullmatch(self.name) is not None


@dataclass(frozen=True)
class Contents:
    """All arrays of a file, the sampling rate it states once (any type, unchecked), and its other statements."""

    arrays: list[Array]
    rate_hz: Any = None
    header: dict[str, Any] = field(default_factory=dict)


def held(name: str, values: NDArray[Any], **details: Any) -> Array:
    """An array that is in memory already."""

    def take(start: int, stop: int) -> NDArray[Any]:
        return values.reshape(-1)[start:stop].copy()

    return Array(name, values.shape, values.dtype, take, **details)


def loaded_once(load: Callable[[], NDArray[Any]]) -> Callable[[int, int], NDArray[Any]]:
    """`take` of an array that its format can only read whole: read at the first call, kept until the file closes."""
    whole = cache(load)

    def take(start: int, stop: int) -> NDArray[Any]:
        return whole().reshape(-1)[start:stop].copy()

    return take


def is_clock_name(name: str) -> bool:
    """Whether a column of this name is a time or a rate."""
    return name.lower() in RATE_NAMES or _TIME_NAME.fullmatch(name) is not None


def time_scale(name: str, unit: str | None) -> float | None:
    """Seconds per unit of a time column called `name`; None for an unknown unit."""
    suffix = _TIME_NAME.fullmatch(name)
    unit_text = unit.strip() if unit and unit.strip() else (suffix.group(1) if suffix and suffix.group(1) else "s")
    return TIME_UNITS.get(unit_text.lower())


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


def name_and_unit(label: str) -> tuple[str, str | None]:
    """`force [N]` -> (`force`, `N`). Round brackets count where they hold a unit: `acc (top)` is a name."""
    match = _BRACKETED.fullmatch(label.strip())
    if match is None or not match.group(1):
        return label.strip(), None
    if match.group(2) is not None:
        return match.group(1), match.group(2).strip()
    return (match.group(1), match.group(3).strip()) if is_unit(match.group(3)) else (label.strip(), None)


def plain(value: Any) -> Any:
    """A header value as JSON holds it."""
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    if isinstance(value, np.ndarray):
        return plain(value.reshape(-1)[0]) if value.size == 1 else [plain(v) for v in value.reshape(-1)[:64]]
    if isinstance(value, np.longdouble):
        return float(value)  # its `item` is no Python float
    if isinstance(value, np.generic) and value.dtype.kind in "biuf":
        return value.item()
    return value if value is None or isinstance(value, bool | int | float | str) else str(value)
