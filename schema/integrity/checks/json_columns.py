"""Names are one short line, paths stay in their folder, JSON has the form that its readers expect.
Our own commands see to that; files from elsewhere may differ."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import PurePosixPath
from typing import Any

from sqlalchemy import Column, Connection, select

from ...base import from_plain
from ...column_kinds import JSON_TEXT, kind_of
from ...known_facts import are_facts
from ...rows import iter_batches
from ...tables import metadata
from ..findings import IntegrityFinding, Scope


def fits(column: str, value: Any) -> bool:
    """Whether the JSON of "table.column" has the form that its readers expect."""
    return SHAPES.get(column, lambda _: True)(value)


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _object(value: Any) -> bool:
    return isinstance(value, dict)


def _numbers(value: Any) -> bool:
    return isinstance(value, list) and all(map(_number, value))


def _points(value: Any) -> bool:
    return _numbers(value) and len(value) > 1


def _settings(value: Any) -> bool:
    well_formed = isinstance(value, dict) and isinstance(value.get("segmentation"), str)
    return well_formed and all(_number(value.get(key)) for key in ("threshold", "smoothing"))


def _report(value: Any) -> bool:
    """Of a diagnosis, what every list of them tells."""
    if not isinstance(value, dict) or not isinstance(value.get("gap"), dict):
        return False
    causes, gap = value.get("causes"), value["gap"]
    well_formed = isinstance(causes, list) and bool(causes) and all(map(_cause, causes))
    return (
        well_formed
        and isinstance(gap.get("metric"), str)
        and {"before", "noise_floor"} <= gap.keys()
    )


def _cause(value: Any) -> bool:
    if not isinstance(value, dict) or not isinstance(value.get("effects"), list):
        return False
    return all(isinstance(effect, str) for effect in value["effects"]) and "probability" in value


def _texts(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(text, str) for text in value)


def _draws(value: Any) -> bool:
    """Of a prediction, the values of the draws by quantity."""
    return isinstance(value, dict) and all(map(_points, value.values()))


def _spectra(value: Any) -> bool:
    """Of a prediction, the spectra of the sensors; None of one without a plate."""
    if value is None:
        return True
    if not isinstance(value, dict) or not isinstance(value.get("sensors"), dict):
        return False
    ends = ("median", "lower", "upper")
    return (
        _number(value.get("q"))
        and _numbers(value.get("frequency_hz"))
        and all(
            isinstance(band, dict) and all(_numbers(band.get(end)) for end in ends)
            for band in value["sensors"].values()
        )
    )


def _adopted(value: Any) -> bool:
    return isinstance(value, list) and all(
        isinstance(version, dict) and {"version", "campaign", "effects"} <= version.keys()
        for version in value
    )


SHAPES: dict[str, Callable[[Any], bool]] = {
    "pulses.force_points_n": _points,
    "channel_figures.srs_frequency_hz": _numbers,
    "channel_figures.srs_maximax_m_s2": _numbers,
    "extraction_settings.settings": _settings,
    "diagnoses.report": _report,
    "channels.header": _object,
    "campaigns.known_facts": are_facts,
    "planned_runs.treatment": _object,
    "planned_runs.settings": _object,
    "run_predictions.models": _object,
    "run_predictions.adopted": _adopted,
    "run_predictions.settings": _object,
    "run_predictions.options": _object,
    "run_predictions.drawn": _draws,
    "run_predictions.spectra": _spectra,
    "run_predictions.warnings": _texts,
    "run_predictions.remarks": _texts,
    "quality_findings.evidence": _object,
    "saved_views.request": _object,
}


_ADVICE = "ask for another export"
_NAMES = frozenset(
    {
        "name",
        "label",
        "alias",
        "path",
        "channel",
        "check",
        "simulator",
        "method",
        "quantity",
        "unit",
    }
)
_LONGEST = 1000


def check_names(connection: Connection, _: Scope) -> Iterator[IntegrityFinding]:
    """Names that no line can show, paths that lead out of the campaign's folder, JSON of another
    form."""
    for table in metadata.sorted_tables:
        for column in table.columns:
            if column.name in _NAMES and kind_of(column) != JSON_TEXT:
                yield from _names(connection, column)
        yield from _json(connection, table)


def _names(connection: Connection, column: Column[Any]) -> Iterator[IntegrityFinding]:
    for text in connection.scalars(select(column).distinct().where(column.is_not(None))):
        if len(text) > _LONGEST or not text.isprintable():
            message = (
                f"{column.name} is {text!r:.60}; expected one line of at most {_LONGEST} characters"
            )
            yield IntegrityFinding("names", message, _ADVICE, {"table": column.table.name})
        elif column.name == "path" and (
            PurePosixPath(text).is_absolute() or ".." in PurePosixPath(text).parts
        ):
            message = f"path {text!r:.60} leads out of the campaign's folder"
            yield IntegrityFinding("names", message, _ADVICE, {"table": column.table.name})


def _json(connection: Connection, table: Any) -> Iterator[IntegrityFinding]:
    columns = list(table.columns)
    places = [i for i, column in enumerate(columns) if kind_of(column) == JSON_TEXT]
    if not places:
        return
    for batch in iter_batches(connection, table):
        for row in batch:
            for place in places:
                problem = _problem(columns[place], row[place])
                if problem is not None:
                    yield IntegrityFinding("names", problem, _ADVICE, {"table": table.name})


def _problem(column: Column[Any], stored: str | None) -> str | None:
    if stored is None:
        return None
    try:
        value = from_plain(json.loads(stored))
    except (ValueError, RecursionError, TypeError) as error:
        return f"{column.name} cannot be read: {type(error).__name__}"
    return (
        None
        if fits(str(column), value)
        else f"{column.name} has not the form that is expected there"
    )
