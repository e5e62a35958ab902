"""A shot in the address of a page: what can be used of it, and by field what cannot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pydantic import ValidationError

from ..common.quantities import display_of
from ..twins.building import BuiltTwin
from ..twins.twin_cache import TwinCache
from .forms import faults_of
from .predicted_shots import PredictionOptions

#: What a twin is made of; the other fields set the shot.
_OF_TWIN = ("campaign", "contact", "plate", "chain_height_m", "coupled")


def read_address(pairs: Sequence[tuple[str, str]]) -> tuple[PredictionOptions, dict[str, str]]:
    """The options without the fields that cannot be read, and a message for each of those."""
    given: dict[str, Any] = {}
    for name, value in pairs:
        if name == "factor":
            given.setdefault(name, []).append(value)
        elif value or name not in _OF_TWIN:
            given[name] = value
    faults: dict[str, str] = {}
    while True:
        try:
            return PredictionOptions(**given), faults
        except ValidationError as error:
            for place, fault in zip(error.errors(), faults_of(error.errors()), strict=True):
                name = str(place["loc"][0])
                faults[name] = _message(
                    name, place["type"], given.pop(name, None), fault["message"]
                )


def _message(name: str, kind: str, value: Any, message: str) -> str:
    label = display_of(name).label.capitalize()
    if kind == "extra_forbidden":
        return f"{name} is no setting of a shot and is left out."
    reason = "expected a number" if kind.endswith("_parsing") else message
    return (
        f"{label} is {value!r}: {reason}. The page shows its usual value."
        if value
        else f"{label}: {message}."
    )


def twin_at(
    twins: TwinCache, question: PredictionOptions
) -> tuple[PredictionOptions, BuiltTwin, dict[str, str]]:
    """The twin that is asked for, else the nearest one that there is, and a message for each field
    that was dropped.

    Raises `LookupError` or `ValueError` where not even the usual twin can be built.
    """
    try:
        return question, twins.get(question.request()), {}
    except (LookupError, ValueError):
        usual = {name: PredictionOptions.model_fields[name].default for name in _OF_TWIN}
    kept, faults = question.model_copy(update=usual), {}
    built = twins.get(kept.request())
    for name in _OF_TWIN:
        wanted = getattr(question, name)
        if wanted == usual[name]:
            continue
        tried = kept.model_copy(update={name: wanted})
        try:
            kept, built = tried, twins.get(tried.request())
        except (LookupError, ValueError) as error:
            faults[name] = str(error)
    return kept, built, faults
