"""Accounts at the laboratory's identity provider, as users of the store: invited, bound at the
first sign-in, and known by issuer and subject from then on.

A login (an e-mail address, a short name) may be given to somebody else at the provider; issuer and
subject may not (OpenID Connect Core 1.0, section 5.7). So a login finds nothing but an invitation
that is still open, and never a user who is bound, or who was not invited.
"""

from __future__ import annotations

import re
import string
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Literal

from sqlalchemy import select
from sqlalchemy.orm import Session

from ....schema.person_roles import PERSON_ROLES, READER, USER, Person
from ....schema.sign_on_identities import SignOnIdentity
from ....schema.users import User
from .stored_users import NAME, RESERVED_NAMES, forget_password

#: Whom a sign-in adds: nobody, who has a group with a role, everybody whom the provider knows.
Admission = Literal["invited", "groups", "everybody"]
ADMISSIONS: tuple[Admission, ...] = ("invited", "groups", "everybody")
LONGEST_LOGIN = 200
_LOWER = str.maketrans(string.ascii_uppercase, string.ascii_lowercase)
#: Names that are tried for a person who is added, until one is free.
_MOST_NAMES = 100


class NotAdmittedError(ValueError):
    """An account that the provider knows, and that is no user here; the message says why."""


@dataclass(frozen=True)
class ProviderAccount:
    """What an identity provider has said of who signs in, after it was checked. `groups` are those
    that the provider names."""

    issuer: str
    subject: str
    login: str
    groups: tuple[str, ...] = ()


@dataclass(frozen=True)
class AdmissionRules:
    """`roles`: group at the provider -> role here. `admits`: whom a first sign-in adds."""

    roles: Mapping[str, str]
    admits: Admission = "invited"

    def role_of(self, groups: Collection[str]) -> str | None:
        """The role that may most among those of the groups; of a person without such a group,
        `reader` where everybody is admitted, else None."""
        named = [self.roles[group] for group in groups if group in self.roles]
        if named:
            return max(named, key=PERSON_ROLES.index)
        return READER if self.admits == "everybody" else None


def login_of(text: str) -> str:
    """A login as it is compared: small letters in place of capital ones of the Latin alphabet, and
    no others, for two letters of which one becomes the other belong to two people."""
    return text.strip().translate(_LOWER)


def account_person(session: Session, account: ProviderAccount) -> tuple[Person, int, bool] | None:
    """The user of an account that is bound, the generation of the session that begins, and whether
    the role is that of a group; None of an account that is not bound.

    Raises:
        NotAdmittedError: Where the user was removed.
    """
    identity = _bound_identity(session, account)
    if identity is None:
        return None
    user = _entitled_user(identity)
    return Person(user.name, user.role, USER, user.id), user.generation, identity.by_group


def admit(session: Session, account: ProviderAccount, rules: AdmissionRules) -> tuple[Person, int]:
    """The user of an account, and the generation of the session that begins; bound, added or given
    the role of its groups where the rules say so. May be run again.

    Raises:
        NotAdmittedError: Where the account is nobody's here, and the rules add nobody like it.
    """
    identity = _bound_identity(session, account)
    if identity is None:
        identity = _claimed_invitation(session, account) or _added(session, account, rules)
    user = _entitled_user(identity)
    if identity.by_group:
        role = rules.role_of(account.groups)
        if role is None:
            raise NotAdmittedError(_without_role(account))
        # Also of the last administrator: the laboratory has taken the group away.
        user.role = role
    session.flush()
    return Person(user.name, user.role, USER, user.id), user.generation


def invite(
    session: Session, name: str, login: str, role: str | None, account: tuple[str, str] | None
) -> bool:
    """Let a person sign in through the provider; who has no row of users gets one, without a
    password. An invitation takes the place of the account that was the user's before.

    Parameters:
        session: A session of `Store.writing`.
        name: The name of the user here.
        login: What the provider will call the person at the first sign-in.
        role: The role here; None leaves that of a user who is there.
        account: Issuer and subject, where the account is known already.

    Returns:
        Whether the user was added, or taken back.

    Raises:
        ValueError: For a name that cannot be one, and a login or an account that is another user's.
    """
    login, now = login_of(login), datetime.now(UTC)
    user = session.scalars(select(User).where(User.name == name)).one_or_none()
    is_new = user is None
    if user is None:
        user = _new_user(session, name, role or READER)
    elif user.removed_at is not None:
        is_new, user.removed_at, user.role = True, None, role or READER
        user.generation += 1
        forget_password(session, user)
    elif role is not None and role != user.role:
        raise ValueError(
            f"user {name!r} has the role {user.role}; pyroshock users change {name} --role "
            f"{role} changes it"
        )
    claimant = session.scalars(
        select(SignOnIdentity).where(
            SignOnIdentity.login == login, SignOnIdentity.user_id != user.id
        )
    ).first()
    if claimant is None and account is not None:
        issuer, subject = account
        claimant = session.scalars(
            select(SignOnIdentity).where(
                SignOnIdentity.issuer == issuer,
                SignOnIdentity.subject == subject,
                SignOnIdentity.user_id != user.id,
            )
        ).first()
    if claimant is not None:
        raise ValueError(
            f"login {login!r} is that of user {claimant.user.name!r}; remove that user, or invite "
            f"{claimant.user.name} with another login first"
        )
    own = select(SignOnIdentity).where(SignOnIdentity.user_id == user.id)
    identity = session.scalars(own).one_or_none()
    if identity is None:
        identity = SignOnIdentity(user_id=user.id, login=login, by_group=False, invited_at=now)
        session.add(identity)
    elif identity.subject is not None:
        user.generation += 1  # sessions of the account before end
    identity.login, identity.by_group, identity.invited_at = login, False, now
    identity.issuer, identity.subject = account or (None, None)
    identity.bound_at = None if account is None else now
    session.flush()
    return is_new


def _bound_identity(session: Session, account: ProviderAccount) -> SignOnIdentity | None:
    query = select(SignOnIdentity).where(
        SignOnIdentity.issuer == account.issuer, SignOnIdentity.subject == account.subject
    )
    return session.scalars(query).one_or_none()


def _claimed_invitation(session: Session, account: ProviderAccount) -> SignOnIdentity | None:
    """The invitation with this login, bound to the account from now on; None where there is
    none."""
    query = select(SignOnIdentity).where(SignOnIdentity.login == login_of(account.login))
    identity = session.scalars(query.with_for_update()).one_or_none()
    if identity is None:
        return None
    if identity.subject is not None:
        raise NotAdmittedError(
            f"the login {account.login!r} belongs to another account of the identity provider "
            "here; if that one is gone, an administrator invites the login anew on the page /users"
        )
    _entitled_user(identity)
    identity.issuer, identity.subject = account.issuer, account.subject
    identity.bound_at = datetime.now(UTC)
    return identity


def _added(session: Session, account: ProviderAccount, rules: AdmissionRules) -> SignOnIdentity:
    role = None if rules.admits == "invited" else rules.role_of(account.groups)
    if role is None:
        raise NotAdmittedError(
            f"the login {account.login!r} is no user here; an administrator invites it on the page "
            "/users"
            if rules.admits == "invited"
            else _without_role(account)
        )
    now = datetime.now(UTC)
    user = _new_user(session, _free_name(session, account.login), role)
    identity = SignOnIdentity(
        user_id=user.id,
        user=user,
        login=login_of(account.login),
        issuer=account.issuer,
        subject=account.subject,
        by_group=True,
        invited_at=now,
        bound_at=now,
    )
    session.add(identity)
    return identity


def _entitled_user(identity: SignOnIdentity) -> User:
    user = identity.user
    if user.removed_at is not None:
        raise NotAdmittedError(
            f"user {user.name} was removed; an administrator takes the person back by an "
            "invitation on the page /users"
        )
    return user


def _without_role(account: ProviderAccount) -> str:
    return (
        f"the login {account.login!r} has no group at the identity provider that has a role here; "
        "whoever runs this server says which groups have one, and an administrator can invite the "
        "login on the page /users"
    )


def _new_user(session: Session, name: str, role: str) -> User:
    if not NAME.fullmatch(name) or name in RESERVED_NAMES:
        raise ValueError(
            f"name is {name!r}; expected small letters, digits, and . _ - between them, and none "
            f"of {', '.join(RESERVED_NAMES)}"
        )
    user = User(name=name, role=role, made_at=datetime.now(UTC))
    session.add(user)
    session.flush()
    return user


def _free_name(session: Session, login: str) -> str:
    """A name for who signs in with a login, which no user has or had."""
    words = re.sub(r"[^a-z0-9._-]+", "-", login_of(login).partition("@")[0])
    stem = words.strip("._-")[:60] or "person"
    for number in range(1, _MOST_NAMES):
        name = stem if number == 1 else f"{stem}-{number}"
        query = select(User.id).where(User.name == name)
        if name not in RESERVED_NAMES and session.scalar(query) is None:
            return name
    raise NotAdmittedError(
        f"{_MOST_NAMES} users have names like {stem!r} already; an administrator invites the login "
        f"{login!r} under another name on the page /users"
    )
