"""The audit trail: who changed what, when, and with which request. Rows are added and never
changed; each carries its hash as every row does."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

from sqlalchemy import CheckConstraint, Index, Text, func, select
from sqlalchemy.orm import Mapped, Session, mapped_column

from .base import Base, HasId, WithProvenance, names_row, one_of
from .person_roles import PERSON_KINDS, Person

#: The change is stored; the request waits as a job; it broke off after some of it was stored; the
#: job was stopped by a person.
DONE, ASKED, FAILED, STOPPED = OUTCOMES = ("done", "asked", "failed", "stopped")


class AuditRow(HasId, WithProvenance, Base):
    """One change by one person, written in the transaction of the change where there is one.

    The command that `written_by_id` names tells the door: a page, the API, a job, the command line
    or Python.
    """

    __tablename__ = "audit_rows"
    __table_args__ = (
        CheckConstraint(one_of("person_kind", PERSON_KINDS), "person_kind_known"),
        CheckConstraint(one_of("outcome", OUTCOMES), "outcome_known"),
        # "what has this person done", the newest first
        Index("ix_audit_rows_person_id", "person", "id"),
        # "who did this", the newest first
        Index("ix_audit_rows_operation_id", "operation", "id"),
    )

    happened_at: Mapped[datetime]
    person: Mapped[str]
    person_kind: Mapped[str]
    operation: Mapped[str] = mapped_column(info=names_row("operation"))
    subject: Mapped[str]  # what it was about, as people call it; empty of the whole store
    request: Mapped[dict[str, Any]]  # what was asked for, without secrets and the content of files
    outcome: Mapped[str]
    message: Mapped[str | None] = mapped_column(Text)  # why it failed
    job: Mapped[int | None]  # the number of the job that waits or has done it


class AuditEntry:
    """What a row will say of the change that is being made. `recorded`: it has its row."""

    def __init__(
        self, person: Person, operation: str, subject: str, request: dict[str, Any]
    ) -> None:
        self.person, self.operation, self.subject, self.request = (
            person,
            operation,
            subject,
            request,
        )
        self.recorded = False

    def row(
        self, outcome: str = DONE, message: str | None = None, job: int | None = None
    ) -> AuditRow:
        """A new row, of this moment."""
        return AuditRow(
            happened_at=datetime.now(UTC),
            person=self.person.name,
            person_kind=self.person.kind,
            operation=self.operation,
            subject=self.subject,
            request=self.request,
            outcome=outcome,
            message=message,
            job=job,
        )


class ChangeMark:
    """Tells whether a transaction has changed a row since it was made."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._before = self._count()

    def changed(self) -> bool:
        """On PostgreSQL a transaction that has locked a row or drawn a key counts as one that has
        changed something; SQLite counts its rows."""
        self._session.flush()
        if self._session.get_bind().dialect.name == "postgresql":
            own = select(func.pg_current_xact_id_if_assigned().is_not(None))
            return bool(self._session.scalar(own))
        return self._count() > self._before

    def _count(self) -> int:
        if self._session.get_bind().dialect.name == "postgresql":
            return 0
        driver: Any = self._session.connection().connection.dbapi_connection
        return int(driver.total_changes)
