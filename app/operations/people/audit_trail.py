"""The audit trail, read: who has changed what, the newest first."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

from ....schema.person_roles import ENGINEER
from ..fields import Presentation, request_field, row_limit
from ..laboratory import Laboratory
from ..operation import Operation, Progress, Request, Rows

_USUAL, _USUAL_PAGE, _LONGEST_PAGE = 50, 200, 1_000


class AuditQuestion(Request):
    """Which rows of the audit trail are read."""

    person: str | None = request_field(
        None, max_length=200, help="List what this person has changed."
    )
    operation: str | None = request_field(
        None, max_length=200, help="List changes by this operation, such as train."
    )
    about: str | None = request_field(
        None, max_length=1000, help="List changes whose subject has this text in it."
    )
    outcome: Literal["done", "asked", "failed", "stopped"] | None = request_field(
        None, help="List changes that ended so; asked: a job was queued."
    )
    limit: row_limit(_USUAL_PAGE, _LONGEST_PAGE) = request_field(  # type: ignore[valid-type]
        None,
        validate_default=True,
        help="List at most this number of rows, the newest first. [default: 50, over a network "
        "200]",
        presentation=Presentation(option="last"),
    )
    before: Annotated[int, Field(ge=1, le=2**31 - 1)] | None = request_field(
        None, help="List the rows older than the one with this number."
    )


class AuditRows(Rows):
    """Rows of the audit trail, the newest first."""

    def shortened(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """Without the request, which may be long."""
        kind = "" if row["person_kind"] == "user" else f" ({row['person_kind']})"
        return {
            "id": row["id"],
            "when": row["when"],
            "person": f"{row['person']}{kind}",
            "operation": row["operation"],
            "subject": row["subject"] or None,
            "outcome": row["outcome"],
            "job": row["job"],
        }


def _read(request: AuditQuestion, laboratory: Laboratory, _: Progress) -> AuditRows:
    from sqlalchemy import select

    from ....schema.audit import AuditRow
    from ....schema.provenance import Provenance

    query = (
        select(AuditRow, Provenance.command)
        .join(Provenance, AuditRow.written_by_id == Provenance.id)
        .order_by(AuditRow.id.desc())
        .limit(request.limit or _USUAL)
    )
    if request.person is not None:
        query = query.where(AuditRow.person == request.person)
    if request.operation is not None:
        query = query.where(AuditRow.operation == request.operation)
    if request.about is not None:
        query = query.where(AuditRow.subject.contains(request.about, autoescape=True))
    if request.outcome is not None:
        query = query.where(AuditRow.outcome == request.outcome)
    if request.before is not None:
        query = query.where(AuditRow.id < request.before)
    with laboratory.store.reading() as session:
        rows = [
            {
                "id": row.id,
                "when": row.happened_at.isoformat(timespec="seconds"),
                "person": row.person,
                "person_kind": row.person_kind,
                "operation": row.operation,
                "subject": row.subject,
                "request": row.request,
                "outcome": row.outcome,
                "message": row.message,
                "job": row.job,
                "command": command,
            }
            for row, command in session.execute(query)
        ]
    return AuditRows(rows, "nothing was changed yet, or nothing that fits the filter")


AUDIT_LIST: Operation[AuditQuestion, AuditRows] = Operation(
    name="audit-list",
    request=AuditQuestion,
    run=_read,
    help="""List who has changed what, the newest first: one row for each change that was made
through a page, the API, a job, the command line or Python.

Sign-ins to the pages, those that failed and sign-outs have rows, too. On the command line and in
Python the person is the user of the operating system. Rows are never changed or deleted.""",
    example="pyroshock audit --last 20\npyroshock audit --person anna --operation train",
    command=("audit",),
    route=("GET", "/audit"),
    role=ENGINEER,
    listing=True,
    absent={
        "form": "The page /audit shows the list with its filters.",
        "python": "The method `query` of a store reads the table audit_rows.",
    },
)
