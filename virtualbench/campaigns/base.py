"""What every kind of campaign gives to `simulate`: recordings to make, one at a time and in any
process."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..recorder import Value
from ..sensors import SensorBuild

Row = Mapping[str, str]
Truth = dict[str, Any]


@dataclass(frozen=True)
class RecordingTask:
    """One recording to make. `cells` is its row of runs.csv but for the recording's name, `hits`
    how often it is hit.

    `day_fraction` is when in its day, 0 in the morning and 1 in the evening.
    """

    name: str
    row: Row
    cells: Mapping[str, str]
    hits: int
    day_fraction: float


@dataclass(frozen=True)
class Taken:
    """A recording, (n,) by channel, and the truth of each of its hits in time order."""

    channels: Mapping[str, NDArray[np.float32]]
    truths: Sequence[Truth]


class VirtualBench(Protocol):
    """A bench as it stands for one campaign; picklable, since recordings are made in several
    processes."""

    @property
    def sampling_rate_hz(self) -> float: ...

    @property
    def sensors(self) -> tuple[SensorBuild, ...]: ...

    def stages(self) -> Mapping[str, Mapping[str, Value]]:
        """The `[bench.*]` tables of campaign.toml, as the lab believes them to be."""
        ...

    def tasks(self, rows: Sequence[Row], repetitions: int) -> list[RecordingTask]:
        """The recordings of a plan, in its order."""
        ...

    def take(self, task: RecordingTask, rng: np.random.Generator) -> Taken:
        """Make one recording."""
        ...


def cell(row: Row, column: str, allowed: Sequence[str] = ()) -> str:
    """A plan's cell. Raises `ValueError` where it is missing, or not one of the `allowed`."""
    text = str(row.get(column, "")).strip()
    if not text or (allowed and text not in allowed):
        expected = f"one of {', '.join(allowed)}" if allowed else "a value"
        raise ValueError(
            f"plan: run {row.get('run', '?')}: {column} is {text!r}; expected {expected}"
        )
    return text


def positive(row: Row, column: str) -> float:
    """A plan's cell as a number above zero. Raises `ValueError`."""
    text = cell(row, column)
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not 0 < value < float("inf"):
        raise ValueError(
            f"plan: run {row.get('run', '?')}: {column} is {text!r}; expected a number above zero"
        )
    return value


def day_fraction(number: int, per_day: int) -> float:
    """When in its day the `number`-th run (from 0) is made, `per_day` of them spread over each."""
    return (number % per_day) / per_day


def cells_of(row: Row, repetition: int) -> dict[str, str]:
    """A plan's row as runs.csv begins it."""
    rest = {
        key: value for key, value in row.items() if key not in ("run", "repetition", "recording")
    }
    return {"run": str(row["run"]), "repetition": str(repetition), **rest}
