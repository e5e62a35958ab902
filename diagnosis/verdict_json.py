"""A diagnosis as it is kept: the report for scripts, and beside it what the report leaves out and its page draws."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import is_dataclass
from types import UnionType
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

from ..twin.effects import Effect, effect_from_json
from .plot_data import CurvePicture, ResidualPicture
from .verdict import Verdict

Json = dict[str, Any]

#: Of the details. Those of format 1 have no shares of effects and no path: they open with these empty.
FORMAT = 2
READABLE = (1, FORMAT)


def verdict_to_json(verdict: Verdict) -> tuple[Json, Json]:
    """The report and its details, both without numbers that JSON has not: together all of the verdict.

    The report has null for them; the details say where, and what they were.
    """
    lost: list[Json] = []
    report = _finite(verdict.as_json(), [], lost)
    details = {
        "format": FORMAT,
        "lost": lost,
        "causes": [{"split": list(cause.split), "fitted": _effects(cause.fitted)} for cause in verdict.causes],
        "effects": [{"named": effect.named} for effect in verdict.effects],
        "fits": {name: _effects(effects) for name, effects in verdict.fits.items()},
        "pictures": {
            "configurations": list(verdict.pictures.configurations),
            "residuals": [_picture(picture) for picture in verdict.pictures.residuals],
            "curves": [_picture(picture) for picture in verdict.pictures.curves],
        },
    }
    return report, details


def verdict_from_json(report: Mapping[str, Any], details: Mapping[str, Any]) -> Verdict:
    """The inverse of `verdict_to_json`, number for number.

    Raises `ValueError` for details of another format, `LookupError` for an effect that is no longer there.
    """
    if details.get("format") not in READABLE:
        known = " and ".join(map(str, READABLE))
        raise ValueError(f"details of format {details.get('format')!r}; this software knows {known}: diagnose again")
    table = _restored(report, details["lost"])
    for name in ("causes", "effects"):
        pairs = zip(table.get(name, ()), details.get(name, ()), strict=True)
        table[name] = [{**plain, **detail} for plain, detail in pairs]
    verdict: Verdict = _decoded(Verdict, {**table, "fits": details["fits"], "pictures": details["pictures"]})
    return verdict


def _decoded(kind: Any, value: Any) -> Any:
    """Plain data as a value of a type, as a field is annotated: records by their fields, lists as tuples or arrays.

    Keys that a record has no field for are left out.
    """
    if value is None:
        return None
    if get_origin(kind) is UnionType:
        kind = next(part for part in get_args(kind) if part is not type(None))
    if kind is Effect:
        return effect_from_json(value)
    if isinstance(kind, type) and is_dataclass(kind):
        hints = get_type_hints(kind)
        return kind(**{name: _decoded(hints[name], value[name]) for name in hints if name in value})
    parts = get_args(kind)
    match get_origin(kind):
        case np.ndarray:
            return np.array([math.nan if v is None else float(v) for v in value], dtype=np.float64)
        case origin if origin is tuple:
            return tuple(_decoded(parts[0], item) for item in value)
        case origin if origin is Mapping:
            return {key: _decoded(parts[1], item) for key, item in value.items()}
    return value


def _finite(value: Any, path: list[str | int], lost: list[Json]) -> Any:
    """Plain data with null for what is no number of JSON's; where that was is added to `lost`."""
    if isinstance(value, Mapping):
        return {key: _finite(item, [*path, key], lost) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item, [*path, i], lost) for i, item in enumerate(value)]
    if isinstance(value, float):
        if math.isfinite(value):
            return float(value)
        lost.append({"at": path, "value": str(float(value))})
        return None
    return value


def _restored(report: Mapping[str, Any], lost: Sequence[Mapping[str, Any]]) -> Json:
    table = deepcopy(dict(report))
    for entry in lost:
        *path, last = entry["at"]
        holder: Any = table
        for step in path:
            holder = holder[step]
        holder[last] = float(entry["value"])
    return table


def _effects(effects: Sequence[Effect]) -> list[Json]:
    return [effect.as_json() for effect in effects]


def _picture(picture: ResidualPicture | CurvePicture) -> Json:
    """NaN, of which pictures are full, as null; infinities by name."""
    return {
        name: [v if math.isfinite(v) else None if math.isnan(v) else str(v) for v in value.tolist()]
        if isinstance(value, np.ndarray)
        else value
        for name, value in vars(picture).items()
    }
