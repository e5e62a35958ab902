"""Columns of a table of runs that are no settings: remarks, and what was read off a thermometer or a clock."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...schema.columns import BY_NAME
from ..record import Factor

#: A column is a note when so many of its runs differ in it; below so many runs nobody can tell.
_DIFFERENT, _RUNS = 0.8, 6
#: Beginnings of the names of what is read and not set; other numbers may be a design without repetitions.
_CONDITIONS = ("time", "date", "hour", "temperature", "humidity", "ambient", "order", "sequence", "index")


def note_columns(runs: Sequence[Mapping[str, Factor]]) -> tuple[str, ...]:
    """Free factors, of the factors of each run, that are a text or a condition of its own in nearly every run."""
    free = dict.fromkeys(name for run in runs for name in run if name not in BY_NAME)
    return tuple(name for name in free if _is_note(name, [run[name] for run in runs if name in run]))


def _is_note(name: str, values: Sequence[Factor]) -> bool:
    if len(values) < _RUNS or len(set(values)) < _DIFFERENT * len(values):
        return False
    return name.lower().startswith(_CONDITIONS) or any(isinstance(value, str) for value in values)
