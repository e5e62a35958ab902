"""What stands beside the samples of a file of arrays: scalars and short texts. One that changes the
meaning of a number is used, or the channels of its group, and of the groups below it, are refused
by its name and value.

`t_unit` is the unit of the time `t`, `force_unit` that of `force`, and `unit` that of every channel
of its group that has none of its own.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from .base import AS_IN_FILE, ReadingOptions, RecordingError
from .clock import Clock
from .contents import Array, Contents, same_unit, to_python, unit_in_time_name
from .field_rules import FieldRule, refused, used
from .file_fields import is_harmless, unread_field

#: Of every format of arrays.
STATEMENT_RULES: tuple[FieldRule, ...] = (
    used("fs", "the sampling rate; its other names stand below"),
    used("unit", "the unit of the channels of its group; `NAME_unit` is that of NAME alone"),
    used("t_unit", "the unit of the time vector, as `time_unit` is"),
    refused(
        "mask",
        "it marks samples that are none; put NaN in their place and save again without it",
        0,
    ),
    refused(
        "*_mask",
        "it marks samples that are none; put NaN in their place and save again without it",
        0,
    ),
)
_TIME_UNIT_NAMES = frozenset(
    {"t_unit", "t_units", "time_unit", "time_units", "timeunit", "timeunits", "unit_t"}
)
_UNIT_NAMES = frozenset({"unit", "units"})

Statements = Mapping[str, Mapping[str, Any]]


def with_statements(path: Path, contents: Contents, options: ReadingOptions) -> Contents:
    """`contents` with the units that texts state, and with every scalar and text that holds for an
    array in its `fields`. Raises `RecordingError` for a time vector with two units."""
    statements = {group: dict(values) for group, values in contents.statements.items()}
    for array in contents.arrays:
        if _is_scalar(array):
            statements.setdefault(array.group, {})[array.name] = to_python(array.take(0, 1))
        elif array.dtype.kind == "b" and (
            array.name.lower() == "mask" or array.name.lower().endswith("_mask")
        ):
            statements.setdefault(array.group, {})[array.name] = int(
                array.take(0, array.samples).sum()
            )
    names = [array.name for array in contents.arrays if not _is_scalar(array)]
    arrays = [
        array if _is_scalar(array) else _with_fields(path, array, names, statements, options)
        for array in contents.arrays
    ]
    return replace(contents, arrays=arrays)


def obstacle_of(
    rules: Sequence[FieldRule],
    array: Array,
    clock: Clock | None,
    options: ReadingOptions = AS_IN_FILE,
) -> str | None:
    """What of an array's fields may change its numbers and is not used; None where nothing does."""
    rate_hz = None if clock is None else clock.rate_hz
    return unread_field(rules, array.fields, options, unit=array.unit, rate_hz=rate_hz)


def _is_scalar(array: Array) -> bool:
    return (
        array.samples == 1
        and array.dtype.kind in "biuf"
        and not array.is_rate
        and not array.is_time
    )


def _with_fields(
    path: Path, array: Array, names: Iterable[str], statements: Statements, options: ReadingOptions
) -> Array:
    fields: dict[str, Any] = {}
    for group in _groups_above(array.group):
        for name, value in statements.get(group, {}).items():
            owner = _owner(name, names)
            if owner is None or owner == array.name:
                fields.setdefault(name, value)
    unit = array.unit
    for name in [name for name in fields if _states_unit(name, array)]:
        text = str(fields[name]).strip()
        if is_harmless(name, options) or not text:
            continue
        own = unit_in_time_name(array.name) if array.is_time else None
        if own is not None and not same_unit(own, text):
            raise RecordingError(
                f"{path.name}: {array.name!r} is in {own!r} by its name, in {text!r} by {name!r}"
            )
        if unit is None or not unit.strip():
            unit = text
        if unit == text:
            del fields[name]
    time_units = (
        [name for name in fields if name.lower() in _TIME_UNIT_NAMES] if not array.is_time else []
    )
    for name in time_units:
        del fields[name]
    return replace(array, unit=unit, fields={**fields, **array.fields})


def _groups_above(group: str) -> Iterable[str]:
    """The group and those above it, the nearest first; the root is ""."""
    while group:
        yield group
        group = group.rpartition("/")[0]
    yield ""


def _owner(name: str, arrays: Iterable[str]) -> str | None:
    """The array whose name a statement begins with: `force` of `force_gain`."""
    owners = [array for array in arrays if name.lower().startswith(f"{array.lower()}_")]
    return max(owners, key=len, default=None)


def _states_unit(name: str, array: Array) -> bool:
    """Whether a text of this name is the unit of an array."""
    lower = name.lower()
    if array.is_rate:
        return lower in {f"{array.name.lower()}_{word}" for word in _UNIT_NAMES}
    if array.is_time:
        return lower in _TIME_UNIT_NAMES or lower in {
            f"{array.name.lower()}_{word}" for word in _UNIT_NAMES
        }
    return lower in _UNIT_NAMES or lower in {f"{array.name.lower()}_{word}" for word in _UNIT_NAMES}
