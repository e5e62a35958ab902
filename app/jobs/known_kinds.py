"""Every kind of job."""

from __future__ import annotations

from collections import UserDict
from typing import Any

from ..operations.catalogue import OPERATIONS, operation
from .kind import Kind


class KindTable(UserDict[str, Any]):
    """Kinds of jobs by name: one for each operation, which is imported when its kind is first asked
    for. So the queue, which all features use, imports no feature."""

    def __getitem__(self, name: str) -> Kind[Any]:
        kind: Kind[Any] | None = super().__getitem__(name)
        if kind is None:
            from .operation_kind import kind_of

            kind = self[name] = kind_of(operation(name))
        return kind


KINDS = KindTable(dict.fromkeys(OPERATIONS))


def job_page(kind: str) -> str:
    """The page of a job of an operation while it is worked on, with {job} for its number; empty:
    the usual one."""
    return operation(kind).job_page if kind in OPERATIONS else ""
