"""Every kind of job: a new one is a file of `app/jobs/job_kinds`, and a row here."""

from __future__ import annotations

import importlib
from collections import UserDict
from typing import Any

from ..operations.catalogue import OPERATIONS, operation
from ..operations.operation import Operation
from .kind import Kind


class KindTable(UserDict[str, Any]):
    """Kinds of jobs by name. The module of a kind is imported when the kind is first asked for.

    So the queue, which all features use, imports no feature.
    """

    def __getitem__(self, name: str) -> Kind[Any]:
        place = super().__getitem__(name)
        if not isinstance(place, Kind):
            module, attribute = place
            place = getattr(
                importlib.import_module(module, __package__.partition(".")[0]), attribute
            )
            if isinstance(place, Operation):
                from .operation_kind import kind_of

                place = kind_of(place)
            self[name] = place
            assert isinstance(place, Kind)
        return place


#: Kind of job -> (module of the package, its object there).
KINDS = KindTable(
    {
        **{
            name: (f".app.operations.{module}", attribute)
            for name, (module, attribute, *_) in OPERATIONS.items()
        },
    }
)


def job_page(kind: str) -> str:
    """The page of a job of an operation while it is worked on, with {job} for its number; empty:
    the usual one."""
    return operation(kind).job_page if kind in OPERATIONS else ""
