"""A shot in the address of a page: what can be used of it, and by field what cannot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..common.quantities import display_of
from ..operations.faults import Fault, RequestError, read
from ..operations.predict.request import PredictionRequest
from ..twins.building import BuiltTwin
from ..twins.twin_cache import TwinCache

#: What a twin is made of; the other fields set the shot.
_OF_TWIN = ("campaign", "contact", "plate", "chain_height_m", "coupled")


def built_twin(twins: TwinCache, question: PredictionRequest) -> BuiltTwin:
    """The twin that is asked for. Raises as `TwinCache.get`."""
    with question.twin_request() as request:
        return twins.get(request)


def read_address(pairs: Sequence[tuple[str, str]]) -> tuple[PredictionRequest, dict[str, str]]:
    """The question without the fields that cannot be read, and a message for each of those."""
    given: dict[str, Any] = {}
    for name, value in pairs:
        if name == "factor":
            given.setdefault(name, []).append(value)
        elif value or name not in _OF_TWIN:
            given[name] = value
    faults: dict[str, str] = {}
    while True:
        try:
            return read(PredictionRequest, given, "network"), faults
        except RequestError as error:
            if not given.keys() & {fault.field for fault in error.faults}:
                raise  # nothing can be left out that would mend it
            for fault in error.faults:
                faults[fault.field] = _message(fault)
                given.pop(fault.field, None)


def _message(fault: Fault) -> str:
    if fault.field not in PredictionRequest.model_fields:
        return f"{fault.field} is no setting of a shot and is left out."
    message = fault.spelled(display_of(fault.field).label.capitalize())
    return f"{message}. The page shows the usual value."


def twin_at(
    twins: TwinCache, question: PredictionRequest
) -> tuple[PredictionRequest, BuiltTwin, dict[str, str]]:
    """The twin that is asked for, else the nearest one that there is, and a message for each field
    that was dropped.

    Raises `LookupError` or `ValueError` where not even the usual twin can be built.
    """
    try:
        return question, built_twin(twins, question), {}
    except (LookupError, ValueError):
        usual = {name: PredictionRequest.model_fields[name].default for name in _OF_TWIN}
    kept, faults = question.model_copy(update=usual), {}
    built = built_twin(twins, kept)
    for name in _OF_TWIN:
        wanted = getattr(question, name)
        if wanted == usual[name]:
            continue
        tried = kept.model_copy(update={name: wanted})
        try:
            kept, built = tried, built_twin(twins, tried)
        except (LookupError, ValueError) as error:
            faults[name] = str(error)
    return kept, built, faults
