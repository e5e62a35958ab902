"""The account of the person who is signed in: the password, and tokens for scripts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from ....schema.person_roles import PERSON_ROLES, READER, USER, Person
from ..faults import FieldError
from ..fields import Presentation, request_field
from ..laboratory import Laboratory
from ..operation import FormPage, Operation, Outcome, Progress, Request, Result, ResultTable, Rows
from .passwords import Password, password_field
from .users import RoleName

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

_SIGNED_IN = "The account is that of a person who is signed in to the pages."
_NOBODY = {"command": _SIGNED_IN, "python": _SIGNED_IN}


def signed_in_user(laboratory: Laboratory) -> Person:
    """The user who asks. Raises `ValueError` for anybody who is no user of the store."""
    person = laboratory.person
    if person.kind != USER:
        raise ValueError(
            f"{person.name} is no user and has no account; an administrator adds one: "
            "pyroshock users add NAME"
        )
    return person


class OwnPassword(Request):
    """Another password of the person who is signed in."""

    current: Password = password_field("Give the password that holds now.")
    new: Password = password_field("Give the new password, of 12 characters or more.")


def _change(request: OwnPassword, laboratory: Laboratory, _: Progress) -> Outcome:
    from .stored_users import person_of_password, set_password

    person = signed_in_user(laboratory)

    def change(session: Session) -> None:
        if person_of_password(session, person.name, request.current) is None:
            raise FieldError("current", "the current password is wrong")
        set_password(session, person.name, request.new)

    laboratory.store.write(change)
    line = "the password is changed; your other sessions have ended"
    return Outcome((line,), {"name": person.name}, "/account")


OWN_PASSWORD: Operation[OwnPassword, Outcome] = Operation(
    name="own-password",
    request=OwnPassword,
    run=_change,
    help="Change your own password. Your other sessions end.",
    role=READER,
    absent={**_NOBODY, "json": "The page of the account has it, which keeps its own session open."},
    form=FormPage("/account", "own-password", ""),
)


def _list(_: Request, laboratory: Laboratory, __: Progress) -> Rows:
    from sqlalchemy import select

    from ....schema.users import PersonalToken

    person = signed_in_user(laboratory)
    query = (
        select(PersonalToken)
        .where(PersonalToken.user_id == person.user_id)
        .order_by(PersonalToken.id.desc())
    )
    with laboratory.store.reading() as session:
        rows = [
            {
                "token": row.id,
                "label": row.label,
                "role": row.role,
                "made_at": row.made_at.isoformat(timespec="seconds"),
                "revoked_at": row.revoked_at and row.revoked_at.isoformat(timespec="seconds"),
            }
            for row in session.scalars(query)
        ]
    return Rows(rows, "no tokens")


TOKEN_LIST: Operation[Request, Rows] = Operation(
    name="token-list",
    request=Request,
    run=_list,
    help="List your own tokens, without what they are: each was shown once.",
    route=("GET", "/account/tokens"),
    listing=True,
    absent={**_NOBODY, "form": "The page /account shows the list."},
)


class NewToken(Request):
    """A token for a script."""

    label: Annotated[str, Field(min_length=1, max_length=100)] = request_field(
        help="Say what the token is for, such as the name of the script."
    )
    role: RoleName = request_field(
        READER, help="Give the role of the token; it is at most your own."
    )


@dataclass(frozen=True)
class MadeToken(Result):
    """A new token, which is shown this once."""

    token: str
    label: str
    role: str

    def notes(self) -> tuple[str, ...]:
        """That nobody sees it again."""
        return (
            f"The token for {self.label} is shown this once; keep it where the script finds it.",
        )

    def tables(self) -> tuple[ResultTable, ...]:
        """The token with how it is sent."""
        row = {"token": self.token, "role": self.role, "sent as": "Authorization: Bearer TOKEN"}
        return (ResultTable("", [row], upright=True),)

    def to_json(self) -> dict[str, Any]:
        """The token, its label and its role."""
        return {"token": self.token, "label": self.label, "role": self.role}


def _make(request: NewToken, laboratory: Laboratory, _: Progress) -> MadeToken:
    from datetime import UTC, datetime

    from ....schema.users import PersonalToken
    from .stored_users import hash_of_token, new_token

    person = signed_in_user(laboratory)
    if not person.may(request.role):
        raise FieldError(
            "role",
            f"role is {request.role}; expected at most your own role, one of "
            f"{', '.join(PERSON_ROLES[: PERSON_ROLES.index(person.role) + 1])}",
        )
    token = new_token()

    def add(session: Session) -> None:
        session.add(
            PersonalToken(
                user_id=person.user_id,
                label=request.label,
                role=request.role,
                sha256=hash_of_token(token),
                made_at=datetime.now(UTC),
            )
        )

    laboratory.store.write(add)
    return MadeToken(token, request.label, request.role)


TOKEN_ADD: Operation[NewToken, MadeToken] = Operation(
    name="token-add",
    request=NewToken,
    run=_make,
    help="Make a token for a script, which sends it as `Authorization: Bearer TOKEN`. It is shown "
    "once, and acts as you, with the role that you give it.",
    route=("POST", "/account/tokens"),
    role=READER,
    answered_here=True,
    changes_elsewhere=True,
    absent=_NOBODY,
    form=FormPage("/account", "token-add", "/account/tokens"),
)


class NamedToken(Request):
    """One of your tokens."""

    token: Annotated[int, Field(ge=1, le=2**31 - 1)] = request_field(
        help="Give the number of the token.", presentation=Presentation(positional=True)
    )


def _revoke(request: NamedToken, laboratory: Laboratory, _: Progress) -> Outcome:
    from datetime import UTC, datetime

    from ....schema.users import PersonalToken

    person = signed_in_user(laboratory)

    def revoke(session: Session) -> None:
        row = session.get(PersonalToken, request.token)
        if row is None or row.user_id != person.user_id:
            raise LookupError(f"you have no token {request.token}; the page /account lists yours")
        row.revoked_at = row.revoked_at or datetime.now(UTC)

    laboratory.store.write(revoke)
    line = f"token {request.token} revoked"
    return Outcome((line,), {"token": request.token}, "/account")


TOKEN_REVOKE: Operation[NamedToken, Outcome] = Operation(
    name="token-revoke",
    request=NamedToken,
    run=_revoke,
    help="Revoke one of your tokens: it opens nothing from now on.",
    route=("POST", "/account/tokens/{token}/revoke"),
    role=READER,
    absent=_NOBODY,
    form=FormPage("/account", "token-revoke", "/account/tokens/{token}/revoke"),
)
