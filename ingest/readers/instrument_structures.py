"""Axes as instruments write them into MATLAB files: PicoScope's `Tinterval` and `Tstart`,
Dewesoft's `Data1_time_AI_1` beside `Data1_AI_1`, and Simcenter Testlab's `x_values` beside
`y_values`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from .base import rate_from_step
from .contents import Array, Contents, time_scale, to_python
from .field_rules import FieldRule, harmless, used

INSTRUMENT_FIELDS: tuple[FieldRule, ...] = (
    used("Tinterval", "PicoScope: the step in seconds"),
    used("Tstart", "PicoScope: the time of the first sample in seconds"),
    harmless("*Length", "PicoScope: the number of samples"),
    used(
        "*_time_*", "Dewesoft: the times of the channel of the same name without `time`, in seconds"
    ),
    used("x_values.*", "Testlab: start, step and unit of the axis; one that is no time is refused"),
    harmless(
        "y_values.quantity.*",
        "Testlab: the unit of the display. The samples are in it or in SI, as the export was set, "
        "and the file does not say which: the channel has no unit until the laboratory gives it; a "
        "factor or offset is refused",
    ),
)
_DEWESOFT_TIME = re.compile(r"(Data\d+)_time_(.+)")

#: Scalars and texts of a file by group and name.
Facts = Mapping[str, Mapping[str, Any]]


def with_instrument_axes(contents: Contents) -> Contents:
    """`contents` with the rate, start and unit of arrays that such a structure states."""
    facts: dict[str, dict[str, Any]] = {
        group: dict(values) for group, values in contents.statements.items()
    }
    for array in contents.arrays:
        if array.samples == 1 and array.dtype.kind in "iuf":
            facts.setdefault(array.group, {})[array.name] = to_python(array.take(0, 1))
    times: dict[tuple[str, str], Array] = {}
    for array in contents.arrays:
        if (
            match := _DEWESOFT_TIME.fullmatch(array.name)
        ) is not None and array.dtype.kind in "iuf":
            times[array.group, f"{match.group(1)}_{match.group(2)}"] = array
    arrays = []
    for array in contents.arrays:
        time = times.get((array.group, array.name))
        if any(array is other for other in times.values()):
            continue
        if time is not None and time.samples == array.samples:
            array = replace(
                array,
                times_s=np.asarray(time.take(0, time.samples), dtype=np.float64),
                rate_hz=None,
            )
        arrays.append(_of_testlab(_of_picoscope(array, facts), facts))
    return replace(contents, arrays=arrays)


def _of_picoscope(array: Array, facts: Facts) -> Array:
    step = facts.get(array.group, {}).get("Tinterval")
    if (
        step is None
        or not _positive(step)
        or array.samples == 1
        or array.is_time
        or array.rate_hz is not None
    ):
        return array
    start = facts[array.group].get("Tstart", 0.0)
    return replace(array, rate_hz=rate_from_step(float(step)), start_s=float(start))


def _of_testlab(array: Array, facts: Facts) -> Array:
    signal, _, place = array.group.rpartition("/")
    axis = facts.get(f"{signal}/x_values", {})
    if place != "y_values" or array.name != "values" or not _positive(axis.get("increment")):
        return array
    label = str(facts.get(f"{signal}/x_values/quantity", {}).get("label", "")).strip()
    seconds = time_scale("", label) if label else None
    if seconds is None:
        stated = f"in {label!r}, which is no time" if label else "of no stated unit"
        return replace(
            array, obstacle=f"is over x_values {stated}; export a time signal, with its unit"
        )
    for axis_name in ("y_values", "x_values"):
        group = f"{signal}/{axis_name}/quantity/unit_transformation"
        for name, neutral in (("factor", 1.0), ("offset", 0.0)):
            value = facts.get(group, {}).get(name, neutral)
            if value != neutral:
                place = group.removeprefix(f"{signal}/").replace("/", ".")
                return replace(
                    array,
                    obstacle=f"has {place}.{name} = {value!r}; "
                    f"export it in its own unit, with none",
                )
    return replace(
        array,
        rate_hz=rate_from_step(float(axis["increment"]) * seconds),
        start_s=float(axis.get("start_value", 0.0)) * seconds,
    )


def _positive(value: Any) -> bool:
    return (
        isinstance(value, int | float)
        and not isinstance(value, bool)
        and np.isfinite(value)
        and value > 0
    )
