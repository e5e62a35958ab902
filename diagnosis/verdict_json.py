"""A diagnosis as it is kept: the report for scripts, and beside it what the report leaves out and its page draws."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import fields
from typing import Any

import numpy as np

from ..twin.effects import Effect, effect_from_json
from .plot_data import CurvePicture, Floats, Pictures, ResidualPicture
from .verdict import (
    Band,
    Cause,
    EffectShare,
    Fitted,
    GapSize,
    NextRun,
    PathStep,
    Region,
    Shrinkage,
    StageShare,
    TimeWindow,
    Unexplained,
    Verdict,
    Where,
)

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
            "residuals": [_picture(each) for each in verdict.pictures.residuals],
            "curves": [_picture(each) for each in verdict.pictures.curves],
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
    plain = _restored(report, details["lost"])
    drawn = details["pictures"]
    return Verdict(
        campaign=plain["campaign"],
        simulator=plain["simulator"],
        gap=GapSize(**plain["gap"]),
        where=_where(plain["where"]),
        causes=tuple(_cause(*pair) for pair in zip(plain["causes"], details["causes"], strict=True)),
        shrinkage=tuple(_shrinkage(each) for each in plain["shrinkage"]),
        effects=tuple(
            _effect_share(*pair) for pair in zip(plain.get("effects", ()), details.get("effects", ()), strict=True)
        ),
        unexplained=_unexplained(plain.get("unexplained")),
        path=tuple(PathStep(**step) for step in plain.get("path", ())),
        next_runs=tuple(NextRun(**each) for each in plain["next_runs"]),
        assumptions=tuple(plain["assumptions"]),
        seconds=plain["seconds"],
        fits={name: _effects_from(effects) for name, effects in details["fits"].items()},
        pictures=Pictures(
            configurations=tuple(drawn["configurations"]),
            residuals=tuple(ResidualPicture(**_picture_from(each)) for each in drawn["residuals"]),
            curves=tuple(CurvePicture(**_picture_from(each)) for each in drawn["curves"]),
        ),
    )


def _finite(value: Any, at: list[str | int], lost: list[Json]) -> Any:
    """Plain data with null for what is no number of JSON's; where that was is added to `lost`."""
    if isinstance(value, Mapping):
        return {key: _finite(each, [*at, key], lost) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each, [*at, i], lost) for i, each in enumerate(value)]
    if isinstance(value, float):
        if math.isfinite(value):
            return float(value)
        lost.append({"at": at, "value": str(float(value))})
        return None
    return value


def _restored(report: Mapping[str, Any], lost: Sequence[Mapping[str, Any]]) -> Json:
    plain = deepcopy(dict(report))
    for each in lost:
        *way, last = each["at"]
        holder: Any = plain
        for step in way:
            holder = holder[step]
        holder[last] = float(each["value"])
    return plain


def _where(plain: Json) -> Where:
    return Where(
        stage=tuple(StageShare(**_with_interval(each)) for each in plain["stage"]),
        factors=tuple(Region(**each) for each in plain["factors"]),
        time=tuple(TimeWindow(**each) for each in plain["time"]),
        frequency=tuple(Band(**each) for each in plain["frequency"]),
        drift=tuple(plain["drift"]),
    )


def _cause(plain: Json, more: Json) -> Cause:
    return Cause(
        effects=tuple(plain["effects"]),
        probability=plain["probability"],
        parameters=tuple(Fitted(**_with_interval(each)) for each in plain.get("parameters", ())),
        split=tuple(more["split"]),
        fitted=_effects_from(more["fitted"]),
    )


def _shrinkage(plain: Json) -> Shrinkage:
    more = {name: (before, after) for name, (before, after) in plain["more"].items()}
    return Shrinkage(**{**_with_interval(plain), "effects": tuple(plain["effects"]), "more": more})


def _effect_share(plain: Json, more: Json) -> EffectShare:
    parameters = tuple(Fitted(**_with_interval(each)) for each in plain["parameters"])
    return EffectShare(**{**_with_interval(plain), "parameters": parameters, "named": more["named"]})


def _unexplained(plain: Json | None) -> Unexplained | None:
    return None if plain is None else Unexplained(**_with_interval(plain))


def _with_interval(plain: Json) -> Json:
    ends = plain["ci90"]
    return {**plain, "ci90": None if ends is None else (ends[0], ends[1])}


def _effects(effects: Sequence[Effect]) -> list[Json]:
    return [effect.as_json() for effect in effects]


def _effects_from(tables: Sequence[Json]) -> tuple[Effect, ...]:
    return tuple(effect_from_json(table) for table in tables)


def _picture(picture: ResidualPicture | CurvePicture) -> Json:
    values = {item.name: getattr(picture, item.name) for item in fields(picture)}
    return {name: _numbers(value) if isinstance(value, np.ndarray) else value for name, value in values.items()}


def _picture_from(plain: Json) -> Json:
    return {name: _array(value) if isinstance(value, list) else value for name, value in plain.items()}


def _numbers(values: Floats) -> list[float | str | None]:
    """NaN, of which pictures are full, as null; infinities by name."""
    return [v if math.isfinite(v) else None if math.isnan(v) else str(v) for v in values.tolist()]


def _array(values: Sequence[float | str | None]) -> Floats:
    return np.array([math.nan if v is None else float(v) for v in values], dtype=np.float64)
