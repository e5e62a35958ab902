"""What pages and models take for granted of stored JSON; the software writes no other."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def fits(column: str, value: Any) -> bool:
    """Whether the JSON of "table.column" has the form that its readers expect."""
    return SHAPES.get(column, lambda _: True)(value)


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _object(value: Any) -> bool:
    return isinstance(value, dict)


def _points(value: Any) -> bool:
    return isinstance(value, list) and len(value) > 1 and all(map(_number, value))


def _settings(value: Any) -> bool:
    well_formed = isinstance(value, dict) and isinstance(value.get("segmentation"), str)
    return well_formed and all(_number(value.get(key)) for key in ("threshold", "smoothing"))


def _report(value: Any) -> bool:
    """Of a diagnosis, what every list of them tells."""
    if not isinstance(value, dict) or not isinstance(value.get("gap"), dict):
        return False
    causes, gap = value.get("causes"), value["gap"]
    well_formed = isinstance(causes, list) and bool(causes) and all(map(_cause, causes))
    return well_formed and isinstance(gap.get("metric"), str) and {"before", "noise_floor"} <= gap.keys()


def _cause(value: Any) -> bool:
    if not isinstance(value, dict) or not isinstance(value.get("effects"), list):
        return False
    return all(isinstance(effect, str) for effect in value["effects"]) and "probability" in value


def _numbers(value: Any) -> bool:
    return isinstance(value, list) and all(map(_number, value))


SHAPES: dict[str, Callable[[Any], bool]] = {
    "pulses.force_points_n": _points,
    "channel_figures.srs_frequency_hz": _numbers,
    "channel_figures.srs_maximax_m_s2": _numbers,
    "extraction_settings.settings": _settings,
    "diagnoses.report": _report,
    "channels.header": _object,
    "planned_runs.treatment": _object,
    "planned_runs.settings": _object,
    "quality_findings.evidence": _object,
}
