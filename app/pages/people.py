"""Users, for administrators; and the audit trail, for engineers, too."""

from __future__ import annotations

from fastapi import APIRouter, Depends
from starlette.requests import Request
from starlette.responses import Response

from ...schema.person_roles import PERSON_ROLES, ROLE_WORDS
from ..doors.json_route import read_pairs
from ..operations.faults import read
from ..operations.form import controls
from ..operations.operation import Request as OperationRequest
from ..operations.people.audit_trail import AUDIT_LIST, AuditQuestion
from ..operations.people.users import USER_ADD, USER_INVITE, USER_LIST
from ..web.dependencies import InLaboratory
from ..web.rendering import page, query
from ..web.role_needs import role_of

router = APIRouter()


@router.get("/users", dependencies=[Depends(role_of(USER_LIST))])
def users(request: Request, laboratory: InLaboratory) -> Response:
    question = read(OperationRequest, {}, "network")
    answer = USER_LIST.answer(question, laboratory, lambda *_: None)
    return page(
        request,
        "users.html",
        present=[row for row in answer.rows if row["removed_at"] is None],
        removed=[row for row in answer.rows if row["removed_at"] is not None],
        roles=PERSON_ROLES,
        words=ROLE_WORDS,
        controls=controls(USER_ADD),
        invitation=controls(USER_INVITE),
        logins=any(row["login"] for row in answer.rows),
    )


@router.get("/audit", dependencies=[Depends(role_of(AUDIT_LIST))])
def audit(request: Request, laboratory: InLaboratory) -> Response:
    question = read_pairs(AuditQuestion, request.query_params.multi_items())
    answer = AUDIT_LIST.answer(question, laboratory, lambda *_: None)
    filters = {
        name: value
        for name in ("person", "operation", "about", "outcome")
        if (value := getattr(question, name)) is not None
    }
    whole = len(answer.rows) == question.limit
    return page(
        request,
        "audit.html",
        rows=answer.rows,
        controls=controls(AUDIT_LIST, filters, names=("person", "operation", "about", "outcome")),
        filtered=bool(filters),
        empty=answer.empty,
        older=f"/audit{query({**filters, 'before': answer.rows[-1]['id']})}" if whole else "",
    )
