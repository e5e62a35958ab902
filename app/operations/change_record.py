"""The audit trail of operations: each change that an operation makes leaves a row that says who
asked for it, and for what."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Protocol

from pydantic import BaseModel

from ...schema.addresses import without_secrets
from ...schema.person_roles import Person
from ..common.number_format import finite
from .fields import RecordedFile, TextFile, presentation_of

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from ...schema.audit import AuditEntry
    from .laboratory import Laboratory

#: A text of a request is kept up to so many characters: a plan that was imported has a million.
_LONGEST = 2_000


class RecordedOperation(Protocol):
    """What of an operation (`operation.Operation`) its record needs."""

    @property
    def name(self) -> str: ...
    @property
    def words(self) -> tuple[str, ...]: ...
    @property
    def changes(self) -> bool: ...
    @property
    def changes_elsewhere(self) -> bool: ...
    @property
    def uses_store(self) -> bool: ...
    @property
    def opens_store(self) -> bool: ...
    @property
    def label(self) -> Callable[[Any], str]: ...


@contextmanager
def recorded(
    operation: RecordedOperation, request: BaseModel, laboratory: Laboratory
) -> Iterator[None]:
    """Give what the block changes its row in the audit trail, in the first transaction that stores
    something.

    A change that breaks off after that has a second row, with the error. What is changed beside the
    store (files, the registry of models) has a row once it is done. Within the record of another
    operation there is nothing to do: one request of a person is one row.
    """
    if not operation.changes:
        yield
        return
    from ...schema.audit import FAILED, AuditEntry

    entry = AuditEntry(
        laboratory.person, operation.name, subject_of(operation, request), request_json(request)
    )
    if not (operation.uses_store and operation.opens_store):
        yield
        if operation.changes_elsewhere:
            _add_to_store_at(laboratory.db, operation, entry)
        return
    store = laboratory.store
    if store.audit is not None:
        yield
        return
    store.audit = entry
    try:
        yield
    except Exception as error:
        store.audit = None
        if entry.recorded:
            message = without_secrets(str(error))[:_LONGEST]
            store.write(lambda session: session.add(entry.row(FAILED, message)))
        raise
    finally:
        store.audit = None
    if operation.changes_elsewhere and not entry.recorded:
        store.write(lambda session: session.add(entry.row()))


def _add_to_store_at(address: str, operation: RecordedOperation, entry: AuditEntry) -> None:
    """The row of an operation that has made or moved the store itself."""
    from ... import __version__
    from ...schema.session import Writer, open_store

    with open_store(address, Writer(" ".join(operation.words), __version__)) as store:
        store.write(lambda session: session.add(entry.row()))


def asking_record(
    operation: RecordedOperation, request: BaseModel, person: Person
) -> Callable[[Session, int], None]:
    """What writes, in the transaction that queues a job, who has asked for it; of an operation that
    changes nothing it writes nothing.

    Returns:
        A function of the session and the number of the job.
    """
    from ...schema.audit import ASKED, AuditEntry

    if not operation.changes:
        return lambda _session, _job: None
    entry = AuditEntry(
        person, operation.name, subject_of(operation, request), request_json(request)
    )
    return lambda session, job: session.add(entry.row(ASKED, job=job))


def subject_of(operation: RecordedOperation, request: BaseModel) -> str:
    """What a request is about, as people call it: a name, or a number with its noun."""
    if label := operation.label(request):
        return str(label)[:_LONGEST]
    for name, field in type(request).model_fields.items():
        value = getattr(request, name)
        if presentation_of(field).positional and isinstance(value, int | str):
            return (f"{name} {value}" if isinstance(value, int) else value)[:_LONGEST]
    return ""


def request_json(request: BaseModel) -> dict[str, Any]:
    """A request as JSON: what was said, without secrets, and of files their name and size."""
    stated = {
        name: _plain(value)
        for name, field in type(request).model_fields.items()
        if not presentation_of(field).secret and (value := getattr(request, name)) != field.default
    }
    return dict(finite(stated))


def _plain(value: Any) -> Any:
    if isinstance(value, TextFile):
        return {"name": value.name, "characters": len(value.text)}
    if isinstance(value, RecordedFile):
        return {"name": value.name, "bytes": value.size_bytes}
    if isinstance(value, BaseModel):
        return _plain(value.model_dump(mode="json"))
    if isinstance(value, Mapping):
        return {str(key): _plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [_plain(part) for part in value]
    if value is None or isinstance(value, bool | int | float):
        return value
    text = without_secrets(str(value))
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"
