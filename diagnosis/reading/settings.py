"""The configurations of a campaign: their factors in the words of the store, and labels for people."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from sqlalchemy.orm import Session

from ...schema.configurations import configuration_factors
from ...schema.known_factors import BY_NAME
from ..record import Factor, RunConfiguration

#: Columns of a projectile's own travel to the vent holes, and their units in m.
TRAVEL = {"travel_m": 1.0, "travel_mm": 1e-3}
#: A column is a note when so many of its runs differ in it; below so many runs nobody can tell.
_DIFFERENT, _RUNS = 0.8, 6
#: Beginnings of the names of what is read and not set; other numbers may be a design without repetitions.
_CONDITIONS = ("time", "date", "hour", "temperature", "humidity", "ambient", "order", "sequence", "index")


def read_settings(
    session: Session, keys: Sequence[int]
) -> tuple[tuple[RunConfiguration, ...], tuple[int, ...], tuple[str, ...]]:
    """Of runs by the store's `keys` of their configurations: configurations in the order of their first runs, the row
    of each run's, and sentences on columns that are no settings. Configurations that differ in those alone are one."""
    stored = configuration_factors(session, list(dict.fromkeys(keys)))
    notes = note_columns([stored[key] for key in keys])
    runs = [tuple(sorted((name, x) for name, x in stored[key].items() if name not in notes)) for key in keys]
    row_of = {setting: row for row, setting in enumerate(dict.fromkeys(runs))}
    sentences = tuple(f"{name}: a note on each run, and not a setting" for name in notes)
    return _labelled([dict(setting) for setting in row_of]), tuple(row_of[run] for run in runs), sentences


def note_columns(runs: Sequence[Mapping[str, Factor]]) -> tuple[str, ...]:
    """Columns of a table of runs that are no settings: remarks, and what was read off a thermometer or a clock.

    Of the factors of each run the free ones that are a text or a condition of its own in nearly every run.
    """
    notes = []
    for name in dict.fromkeys(name for run in runs for name in run if name not in BY_NAME):
        values = [run[name] for run in runs if name in run]
        differ = len(values) >= _RUNS and len(set(values)) >= _DIFFERENT * len(values)
        if differ and (name.lower().startswith(_CONDITIONS) or any(isinstance(value, str) for value in values)):
            notes.append(name)
    return tuple(notes)


def _labelled(settings: Sequence[Mapping[str, Factor]]) -> tuple[RunConfiguration, ...]:
    """Configurations in this order. A label names what varies; two that read the same are numbered."""
    names = dict.fromkeys(name for factors in settings for name in factors)
    varying = [name for name in names if len({factors.get(name) for factors in settings}) > 1]
    texts = [
        ", ".join(_factor_text(name, factors[name]) for name in varying if name in factors) or "the one setting"
        for factors in settings
    ]
    count = Counter(texts)
    return tuple(
        RunConfiguration(f"{text} ({i})" if count[text] > 1 else text, factors)
        for i, (text, factors) in enumerate(zip(texts, settings, strict=True), 1)
    )


def _factor_text(name: str, value: Factor) -> str:
    """`tip_radius_mm 30`: a number in the unit of its column."""
    column = BY_NAME.get(name)
    if isinstance(value, str):
        return f"{name} {value}"
    return f"{column.column} {value / column.scale:.6g}" if column else f"{name} {value:.6g}"


def travel_m(configuration: RunConfiguration) -> float | None:
    """The projectile's travel to the vent holes, m; None where no column has it.

    Raises `ValueError` for a column that is not a positive number.
    """
    name = next((name for name in TRAVEL if configuration.factors.get(name) is not None), None)
    if name is None:
        return None
    value = configuration.factors[name]
    if isinstance(value, str) or not value > 0:
        raise ValueError(f"{name} is {value!r} at {configuration.label}: expected a number above 0")
    return value * TRAVEL[name]
