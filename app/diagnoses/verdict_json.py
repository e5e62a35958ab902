"""A diagnosis as it is kept: the report for scripts, and beside it what the report leaves out and its page draws."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from copy import deepcopy
from dataclasses import is_dataclass
from types import UnionType
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

from ...diagnosis.verdict import Verdict, plain
from ...twin.effects import Effect, effect_from_json

Json = dict[str, Any]

#: Of the details. Those of format 1 have no shares of effects and no path: they open with these empty.
FORMAT = 2
READABLE = (1, FORMAT)


def verdict_to_json(verdict: Verdict) -> tuple[Json, Json]:
    """The report and its details, both without numbers that JSON has not: together all of the verdict.

    The report has null for them; the details say where, and what they were.
    """
    table = verdict.as_json()
    lost = list(_not_finite(table, []))
    details = {
        "format": FORMAT,
        "lost": lost,
        "causes": [{"split": list(cause.split), "fitted": plain(cause.fitted)} for cause in verdict.causes],
        "effects": [{"named": effect.named} for effect in verdict.effects],
        "fits": plain(verdict.fits),
        "pictures": plain(verdict.pictures),
    }
    return _with_values(table, [(entry["at"], None) for entry in lost]), details


def verdict_from_json(report: Mapping[str, Any], details: Mapping[str, Any]) -> Verdict:
    """The inverse of `verdict_to_json`, number for number; parts that the details leave out are empty.

    Raises `ValueError` for details of another format, `LookupError` for an effect that is no longer there.
    """
    if details.get("format") not in READABLE:
        readable = " and ".join(map(str, READABLE))
        raise ValueError(f"details of format {details.get('format')!r}; this software knows {readable}: diagnose again")
    table = _with_values(report, [(entry["at"], float(entry["value"])) for entry in details.get("lost", ())])
    for name in ("causes", "effects"):
        pairs = zip(table.get(name, ()), details.get(name, ()), strict=True)
        table[name] = [{**row, **detail} for row, detail in pairs]
    table |= {name: details[name] for name in ("fits", "pictures") if name in details}
    verdict: Verdict = _decode(Verdict, table)
    return verdict


def _decode(kind: Any, value: Any) -> Any:
    """Plain data as a value of a type, as a field is annotated: records by their fields, lists as tuples or arrays.

    Null is NaN where the type does not allow None. Keys that a record has no field for are left out.
    """
    parts = get_args(kind)
    if value is None:
        return None if type(None) in parts else math.nan
    if get_origin(kind) is UnionType:
        return _decode(next(part for part in parts if part is not type(None)), value)
    if kind is Effect:
        return effect_from_json(value)
    if isinstance(kind, type) and is_dataclass(kind):
        hints = get_type_hints(kind)
        return kind(**{name: _decode(hints[name], value[name]) for name in hints if name in value})
    match get_origin(kind):
        case np.ndarray:
            return np.array(value, dtype=np.float64)  # null becomes NaN
        case origin if origin is tuple:
            return tuple(_decode(parts[0], item) for item in value)
        case origin if origin is Mapping:
            return {key: _decode(parts[1], item) for key, item in value.items()}
    return value


def _not_finite(value: Any, path: list[str | int]) -> Iterator[Json]:
    """Where plain data has a number that JSON has not, and which."""
    if isinstance(value, float) and not math.isfinite(value):
        yield {"at": path, "value": str(float(value))}
    items = value.items() if isinstance(value, Mapping) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield from _not_finite(item, [*path, key])


def _with_values(report: Mapping[str, Any], items: Iterable[tuple[list[str | int], float | None]]) -> Json:
    """A copy with other numbers at these paths."""
    table = deepcopy(dict(report))
    for path, value in items:
        holder: Any = table
        for step in path[:-1]:
            holder = holder[step]
        holder[path[-1]] = value
    return table
