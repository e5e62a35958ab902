"""The x axis of a waveform, as a format names it: time in some unit, or no time."""

from __future__ import annotations

from .contents import TIME_UNITS, is_time_name

#: Names of an x axis that say nothing.
_NO_NAME = ("", "none", "x", "untitled")
_NO_TIME = ("freq", "angle", "order", "distance", "position", "lag")


def seconds_per_unit_of_x(name: str, unit: str) -> float | None:
    """Seconds per unit of an x axis; None where it is no time. Without a unit, a time is in
    seconds."""
    word = name.strip().lower()
    if any(other in word for other in _NO_TIME):
        return None
    if unit.strip():
        return TIME_UNITS.get(unit.strip().lower())
    return 1.0 if word in _NO_NAME or is_time_name(word) else None
