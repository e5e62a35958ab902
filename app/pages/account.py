"""The page of the account: who is signed in, the password, and tokens for scripts."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Form
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from ...schema.person_roles import ROLE_WORDS, USER
from ..operations.faults import read
from ..operations.form import controls
from ..operations.operation import Request as OperationRequest
from ..operations.people.account import OWN_PASSWORD, TOKEN_ADD, TOKEN_LIST, OwnPassword
from ..operations.people.stored_users import has_password
from ..web.dependencies import InLaboratory
from ..web.rendering import page
from ..web.role_needs import role_of
from ..web.sign_in import SignIn, session_cookie

router = APIRouter()
_Word = Annotated[str, Form(max_length=4000)]


@router.get("/account")
def account(request: Request, laboratory: InLaboratory) -> Response:
    person = laboratory.person
    is_user = person.kind == USER
    question = read(OperationRequest, {}, "network")
    tokens = TOKEN_LIST.answer(question, laboratory, lambda *_: None).rows if is_user else ()
    return page(
        request,
        "account.html",
        person=person,
        words=ROLE_WORDS[person.role],
        is_user=is_user,
        has_password=is_user
        and laboratory.store.read(lambda session: has_password(session, person.user_id)),
        controls=controls(TOKEN_ADD),
        tokens=tokens,
    )


@router.post("/account/password", dependencies=[Depends(role_of(OWN_PASSWORD))])
def change_password(
    request: Request, laboratory: InLaboratory, current: _Word = "", new: _Word = ""
) -> Response:
    """Change the password; the session of this browser goes on under a new identifier."""
    question = read(OwnPassword, {"current": current, "new": new}, "network")
    OWN_PASSWORD.answer(question, laboratory, lambda *_: None)
    entry: SignIn = request.app.state.sign_in
    answer = RedirectResponse("/account", 303)
    identifier = entry.renewed_session(request, laboratory.person)
    answer.headers.append("set-cookie", session_cookie(request, identifier))
    return answer
