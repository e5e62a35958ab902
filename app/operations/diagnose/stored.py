"""Diagnoses that the store keeps: the report for scripts, and beside it what the report leaves out
and its page draws. They are listed page by page, and read back whole."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from copy import deepcopy
from dataclasses import is_dataclass
from types import UnionType
from typing import TYPE_CHECKING, Any, get_args, get_origin, get_type_hints

import numpy as np
from sqlalchemy import select

from ....diagnosis.verdict import Verdict, plain
from ....schema.campaigns import Campaign
from ....schema.diagnoses import Diagnosis, TwinVersion
from ....schema.listings import get_campaign_id
from ....twin.effects import Effect, effect_from_json
from ...twins.adopted_effects import configuration_name
from .request import DiagnosisRequest, restrictions_among

if TYPE_CHECKING:
    from sqlalchemy.orm import Session


def list_diagnoses(
    session: Session, campaign: str | None = None, limit: int | None = 50, after: int | None = None
) -> list[dict[str, Any]]:
    """Diagnoses of a campaign (None: of all), the newest first: at most `limit` of those older than
    number `after`.

    `complete` says whether `kept_verdict` can read it back, `restricted` whether only some effects
    were considered (`--with`, `--without`). Raises `LookupError` for an unknown campaign.
    """
    complete = Diagnosis.details.is_not(None).label("complete")
    query = select(Diagnosis, Campaign.name, complete).join(
        Campaign, Diagnosis.campaign_id == Campaign.id
    )
    if campaign is not None:
        query = query.where(Diagnosis.campaign_id == get_campaign_id(session, campaign))
    if after is not None:
        query = query.where(Diagnosis.id < after)
    rows = session.execute(query.order_by(Diagnosis.id.desc()).limit(limit)).all()
    adopted = adopted_words(session, [row.id for row, _, _ in rows])
    return [
        {
            **_first_answer(row),
            "campaign": name,
            "adopted": adopted.get(row.id),
            "complete": bool(complete),
        }
        for row, name, complete in rows
    ]


def _first_answer(row: Diagnosis) -> dict[str, Any]:
    first, gap = row.report["causes"][0], row.report["gap"]
    return {
        "id": row.id,
        "diagnosed_at": row.diagnosed_at.isoformat(timespec="seconds"),
        "simulator": row.simulator,
        "first": " or ".join(first["effects"]),
        "probability": first["probability"],
        "gap": gap["before"],
        "noise_floor": gap["noise_floor"],
        "metric": gap["metric"],
        "restricted": bool(restrictions_among(row.report["assumptions"])),
    }


def adopted_words(session: Session, keys: Iterable[int]) -> dict[int, str]:
    """What became part of the twin, by diagnosis: "version 3: gun.valve_flow"; the first where
    there are several."""
    query = (
        select(TwinVersion)
        .where(TwinVersion.diagnosis_id.in_(list(keys)))
        .order_by(TwinVersion.version.desc())
    )
    return {
        row.diagnosis_id: f"version {row.version}: {configuration_name(row.configuration)}"
        for row in session.scalars(query)
        if row.diagnosis_id is not None
    }


def kept_report(session: Session, diagnosis_id: int) -> dict[str, Any]:
    """The report as scripts read it, of any diagnosis. Raises `LookupError` for an unknown one."""
    return get_diagnosis_row(session, diagnosis_id).report


def kept_verdict(session: Session, diagnosis_id: int) -> Verdict:
    """A kept diagnosis as it was made, pictures and fits with it.

    Raises `LookupError` for an unknown one, and for one that an older store keeps without what its
    page draws; `ValueError` for one that a newer software has kept.
    """
    row = get_diagnosis_row(session, diagnosis_id)
    if row.details is None:
        name = row.campaign.name
        raise LookupError(
            f"diagnosis {diagnosis_id} of {name} was kept without what its page draws: diagnose "
            f"again (pyroshock diagnose {name})"
        )
    return verdict_from_json(row.report, row.details)


def kept_summary(session: Session, diagnosis_id: int) -> Verdict:
    """A kept diagnosis without its pictures and fits, for a row of a list. Raises `LookupError` and
    `ValueError`."""
    row = get_diagnosis_row(session, diagnosis_id)
    report, details = row.report, row.details or {"format": FORMAT}
    causes: list[Json] = [{} for _ in report["causes"]]
    effects = details.get("effects") or [{} for _ in report.get("effects", ())]
    small = {
        "format": details["format"],
        "lost": details.get("lost", ()),
        "causes": causes,
        "effects": effects,
    }
    return verdict_from_json(report, small)


def kept_options(session: Session, diagnosis_id: int) -> dict[str, Any]:
    """What a kept diagnosis was asked, by the fields of `DiagnosisRequest`; {} for one that is kept
    without it.

    An option that another version had is left out. Raises `LookupError` for an unknown diagnosis.
    """
    options = (get_diagnosis_row(session, diagnosis_id).details or {}).get("options", {})
    return {name: options[name] for name in DiagnosisRequest.model_fields if name in options}


def get_diagnosis_row(session: Session, diagnosis_id: int) -> Diagnosis:
    """The row of a diagnosis by its number. Raises `LookupError` for an unknown one."""
    row = session.get(Diagnosis, diagnosis_id)
    if row is None:
        raise LookupError(
            f"no diagnosis {diagnosis_id} in the store; pyroshock diagnoses lists them"
        )
    return row


Json = dict[str, Any]

#: Of the details. Those of format 1 have no shares of effects and no path: they open with these
#: empty.
FORMAT = 2
READABLE = (1, FORMAT)
#: Fields of a verdict that the details have as a whole. Older details lack some of them.
_BESIDE_THE_REPORT = ("fits", "averaged", "pictures", "what_if", "error_map")


def verdict_to_json(verdict: Verdict) -> tuple[Json, Json]:
    """The report and its details, both without numbers that JSON has not: together all of the
    verdict.

    The report has null for them; the details say where, and what they were.
    """
    table = verdict.as_json()
    lost = list(_not_finite(table, []))
    details = {
        "format": FORMAT,
        "lost": lost,
        "causes": [
            {"split": list(cause.split), "fitted": plain(cause.fitted)} for cause in verdict.causes
        ],
        "effects": [{"named": effect.named} for effect in verdict.effects],
        "fits": plain(verdict.fits),
        "averaged": plain(verdict.averaged),
        "pictures": plain(verdict.pictures),
        "what_if": plain(verdict.what_if),
        "error_map": plain(verdict.error_map),
    }
    return _with_values(table, [(entry["at"], None) for entry in lost]), details


def verdict_from_json(report: Mapping[str, Any], details: Mapping[str, Any]) -> Verdict:
    """The inverse of `verdict_to_json`, number for number; parts that the details leave out are
    empty.

    Raises `ValueError` for details of another format, `LookupError` for an effect that is no longer
    there.
    """
    if details.get("format") not in READABLE:
        readable = " and ".join(map(str, READABLE))
        raise ValueError(
            f"details of format {details.get('format')!r}; this software "
            f"knows {readable}: diagnose again"
        )
    table = _with_values(
        report, [(entry["at"], float(entry["value"])) for entry in details.get("lost", ())]
    )
    for name in ("causes", "effects"):
        pairs = zip(table.get(name, ()), details.get(name, ()), strict=True)
        table[name] = [{**row, **detail} for row, detail in pairs]
    table |= {name: details[name] for name in _BESIDE_THE_REPORT if name in details}
    verdict: Verdict = _decode(Verdict, table)
    return verdict


def _decode(kind: Any, value: Any) -> Any:
    """Plain data as a value of a type, as a field is annotated: records by their fields, lists as
    tuples or arrays.

    Null is NaN where the type does not allow None. Keys that a record has no field for are left
    out.
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
    items = (
        value.items()
        if isinstance(value, Mapping)
        else enumerate(value)
        if isinstance(value, list)
        else ()
    )
    for key, item in items:
        yield from _not_finite(item, [*path, key])


def _with_values(
    report: Mapping[str, Any], items: Iterable[tuple[list[str | int], float | None]]
) -> Json:
    """A copy with other numbers at these paths."""
    table = deepcopy(dict(report))
    for path, value in items:
        holder: Any = table
        for step in path[:-1]:
            holder = holder[step]
        holder[path[-1]] = value
    return table
