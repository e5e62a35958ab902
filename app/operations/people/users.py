"""Users, as an administrator sees them: listed, added, changed and removed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, model_validator

from ....schema.person_roles import ADMINISTRATOR, READER, ROLE_WORDS
from ..fields import Presentation, request_field
from ..laboratory import Laboratory
from ..operation import FormPage, Operation, Outcome, Progress, Request, Rows
from .passwords import Password, check_password, password_field

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

RoleName = Literal["reader", "operator", "engineer", "administrator"]
UserName = Annotated[str, Field(min_length=1, max_length=64)]
_NAMED = Presentation(positional=True)
_IN_A_STORE = {"python": "A library's user works in a store as whoever runs the process."}


def _list(_: Request, laboratory: Laboratory, __: Progress) -> Rows:
    from .stored_users import user_rows

    with laboratory.store.reading() as session:
        rows = user_rows(session)
    return Rows(rows, "no users yet; add one with: pyroshock users add NAME --role administrator")


USER_LIST: Operation[Request, Rows] = Operation(
    name="user-list",
    request=Request,
    run=_list,
    help="List the people who sign in, with their roles; those who were removed come last.",
    example="pyroshock users list",
    command=("users", "list"),
    route=("GET", "/users"),
    role=ADMINISTRATOR,
    listing=True,
    absent={"form": "The page /users shows the list.", **_IN_A_STORE},
)


def _role_field(default: Any) -> Any:
    words = "; ".join(f"{role}: {what}" for role, what in ROLE_WORDS.items())
    return request_field(default, help=f"Give the role. {words[0].upper()}{words[1:]}.")


class NewUser(Request):
    """A person who is to sign in."""

    name: UserName = request_field(
        help="Give the name that the person signs in with: small letters, digits, and . _ -.",
        presentation=_NAMED,
    )
    role: RoleName = _role_field(READER)
    password: Password = password_field(
        "Give the first password, of 12 characters or more; the person changes it afterwards."
    )

    @model_validator(mode="after")
    def _has_a_good_password(self) -> NewUser:
        check_password(self.password, self.name)
        return self


def _changed(name: str, what: str) -> Outcome:
    return Outcome((f"user {name} {what}",), {"name": name, "user": what}, "/users")


def _add(request: NewUser, laboratory: Laboratory, _: Progress) -> Outcome:
    from .stored_users import add_user

    def add(session: Session) -> None:
        add_user(session, request.name, request.role, request.password)

    laboratory.store.write(add)
    return _changed(request.name, f"added with the role {request.role}")


USER_ADD: Operation[NewUser, Outcome] = Operation(
    name="user-add",
    request=NewUser,
    run=_add,
    help="""Add a person who signs in with a name and a password. The password is asked for, or read
from standard input; it is never an argument.

A person who was removed is taken back so, with a new password.""",
    example="pyroshock users add anna --role engineer",
    command=("users", "add"),
    route=("POST", "/users"),
    role=ADMINISTRATOR,
    absent=_IN_A_STORE,
    form=FormPage("/users", "user-add", "/users"),
)


class Invitation(Request):
    """A person who is to sign in through the laboratory's identity provider."""

    name: UserName = request_field(
        help="Give the name of the person here: small letters, digits, and . _ -.",
        presentation=_NAMED,
    )
    login: Annotated[str, Field(min_length=1, max_length=200)] = request_field(
        help="Give the login at the identity provider, such as the e-mail address."
    )
    role: RoleName | None = request_field(
        None,
        help="Give the role of a person who is new here; a user who is there keeps the own. "
        "[default: reader]",
    )
    subject: Annotated[str, Field(min_length=1, max_length=255)] | None = request_field(
        None,
        help="Name the account at the identity provider by its subject (sub), with the issuer: no "
        "other account can use the invitation then.",
    )
    issuer: Annotated[str, Field(min_length=1, max_length=500)] | None = request_field(
        None, help="Give the address of the identity provider that the subject is of."
    )

    @model_validator(mode="after")
    def _has_both_or_none(self) -> Invitation:
        if (self.subject is None) != (self.issuer is None):
            missing = "subject" if self.subject is None else "issuer"
            raise ValueError(f"{missing} is missing; expected subject and issuer, or neither")
        return self


def _invite(request: Invitation, laboratory: Laboratory, _: Progress) -> Outcome:
    from .stored_identities import invite

    account = None
    if request.issuer is not None and request.subject is not None:
        account = (request.issuer, request.subject)

    def add(session: Session) -> bool:
        return invite(session, request.name, request.login, request.role, account)

    is_new = laboratory.store.write(add)
    added = f"added with the role {request.role or READER}, and " if is_new else ""
    return _changed(request.name, f"{added}invited as {request.login}")


USER_INVITE: Operation[Invitation, Outcome] = Operation(
    name="user-invite",
    request=Invitation,
    run=_invite,
    help="""Invite a person to sign in through the laboratory's identity provider.

The first account that signs in with this login becomes the person's, and stays so whatever it is
called later. Inviting a user again ends that, and the sessions of the user.""",
    example="pyroshock users invite anna --login anna@lab.example --role engineer",
    command=("users", "invite"),
    route=("POST", "/users/invitations"),
    role=ADMINISTRATOR,
    absent=_IN_A_STORE,
    form=FormPage("/users", "user-invite", "/users/invitations"),
)


class UserChange(Request):
    """Another role of a person."""

    name: UserName = request_field(help="Name the user.", presentation=_NAMED)
    role: RoleName = _role_field(...)


def _change(request: UserChange, laboratory: Laboratory, _: Progress) -> Outcome:
    from .stored_users import change_role

    laboratory.store.write(lambda session: change_role(session, request.name, request.role))
    return _changed(request.name, f"has the role {request.role} now")


USER_CHANGE: Operation[UserChange, Outcome] = Operation(
    name="user-change",
    request=UserChange,
    run=_change,
    help="Give a user another role. It holds from the next request on, and for jobs that wait.",
    example="pyroshock users change anna --role administrator",
    command=("users", "change"),
    route=("POST", "/users/{name}/role"),
    role=ADMINISTRATOR,
    absent=_IN_A_STORE,
    form=FormPage("/users", "user-change", "/users/{name}/role"),
)


class NewPassword(Request):
    """A password that an administrator sets."""

    name: UserName = request_field(help="Name the user.", presentation=_NAMED)
    password: Password = password_field("Give the new password, of 12 characters or more.")

    @model_validator(mode="after")
    def _has_a_good_password(self) -> NewPassword:
        check_password(self.password, self.name)
        return self


def _set_password(request: NewPassword, laboratory: Laboratory, _: Progress) -> Outcome:
    from .stored_users import set_password

    laboratory.store.write(lambda session: set_password(session, request.name, request.password))
    return _changed(request.name, "has another password; the sessions of the one before ended")


USER_PASSWORD: Operation[NewPassword, Outcome] = Operation(
    name="user-password",
    request=NewPassword,
    run=_set_password,
    help="Set another password for a user who has forgotten it. It is asked for, or read from "
    "standard input. All sessions of the user end.",
    example="pyroshock users password anna",
    command=("users", "password"),
    route=("POST", "/users/{name}/password"),
    role=ADMINISTRATOR,
    absent=_IN_A_STORE,
    form=FormPage("/users", "user-password", "/users/{name}/password"),
)


class NamedUser(Request):
    """One user."""

    name: UserName = request_field(help="Name the user.", presentation=_NAMED)


def _removable(request: NamedUser, laboratory: Laboratory) -> str:
    from .stored_users import get_user

    with laboratory.store.reading() as session:
        return f"user {get_user(session, request.name).name}"


def _remove(request: NamedUser, laboratory: Laboratory, _: Progress) -> Outcome:
    from .stored_users import remove_user

    laboratory.store.write(lambda session: remove_user(session, request.name))
    return _changed(request.name, "removed; sessions and tokens of this user open nothing now")


USER_REMOVE: Operation[NamedUser, Outcome] = Operation(
    name="user-remove",
    request=NamedUser,
    run=_remove,
    help="Remove a user: sessions and tokens end, and jobs that wait are not done. What the user "
    "has written stays, with the name.",
    example="pyroshock users remove anna",
    command=("users", "remove"),
    route=("POST", "/users/{name}/remove"),
    deletes=_removable,
    absent=_IN_A_STORE,
    form=FormPage("/users", "user-remove", "/users/{name}/remove"),
)
