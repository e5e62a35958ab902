"""For whom a job is done: the person who asked for it, with the role of today, and the row of the
audit trail that its end leaves."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from sqlalchemy import select
from sqlalchemy.orm import Session

from ...schema.audit import AuditEntry
from ...schema.person_roles import USER, Person, RoleNeededError, system_person
from ...schema.session import Store
from ...schema.users import User
from ..operations.catalogue import OPERATIONS, operation
from ..operations.change_record import request_json, subject_of
from .known_kinds import KINDS

if TYPE_CHECKING:
    from .claims import Claimed


def asking_person(store: Store, claimed: Claimed) -> Person | None:
    """The person who asked for a job; None of a job that knows nobody.

    Raises `RoleNeededError` for a user who was removed, and for one whose role of today may not
    ask for the operation of the job.
    """
    name, kind = claimed.asked_by, claimed.asked_by_kind
    if name is None or kind is None:
        return None
    person = Person(name, kind=kind)
    if kind == USER:
        query = select(User.id, User.role).where(User.name == name, User.removed_at.is_(None))
        row = store.read(lambda session: session.execute(query).one_or_none())
        if row is None:
            raise RoleNeededError(
                f"the job was asked for by {name}, who is no user any more; somebody else asks for "
                "it again"
            )
        person = Person(name, row.role, USER, row.id)
    if claimed.kind in OPERATIONS:
        operation(claimed.kind).check_role(person)
    return person


def record_of(
    claimed: Claimed, outcome: str, message: str | None = None
) -> Callable[[Session], None]:
    """What writes the end of a job into the audit trail; of an operation that changes nothing, and
    of arguments that another version asked for, it writes nothing."""
    if claimed.kind not in OPERATIONS or not operation(claimed.kind).changes:
        return lambda _: None
    declared = operation(claimed.kind)
    try:
        request = KINDS[claimed.kind].read(claimed.arguments)
    except ValueError:  # of another version: the job has failed for that, and says so
        subject, stated = claimed.label, {}
    else:
        subject, stated = subject_of(declared, request), request_json(request)
    person = system_person()
    if claimed.asked_by is not None and claimed.asked_by_kind is not None:
        person = Person(claimed.asked_by, kind=claimed.asked_by_kind)
    entry = AuditEntry(person, declared.name, subject, stated)
    return lambda session: session.add(entry.row(outcome, message, claimed.lease.job))
