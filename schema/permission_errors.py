"""What a database refuses, in words: and where a login lacks a role, which one.

Roles are PostgreSQL's (`rights`); a file of SQLite is its owner's, whole.
"""

from __future__ import annotations

from sqlalchemy import Engine
from sqlalchemy.exc import DBAPIError

from .engine import StoreError, StoreRoleError, describe, first_line
from .permissions import ADMIN, DELETED_FROM, OPERATOR, READER, VERSION

#: SQLSTATE insufficient_privilege: "permission denied for table ..", "must be owner of table ..".
_DENIED = "42501"
#: First words of statements that an operator may use; others change tables.
_CHANGE_ROWS = ("INSERT", "UPDATE", "DELETE")


def refusal(engine: Engine, error: DBAPIError, subject: str | None = None) -> StoreError:
    """The error to raise for a driver's; `subject` is what it says it of, else the store's address."""
    message = f"{subject or describe(engine)}: {first_line(error)}"
    role = needed_role(error)
    if role is None:
        return StoreError(message)
    login = engine.url.username or "LOGIN"
    return StoreRoleError(f'{message}; this needs the role {role}: an administrator runs GRANT {role} TO "{login}"')


def needed_role(error: DBAPIError) -> str | None:
    """The role that a refused statement needs; None where it was refused for another reason."""
    if getattr(error.orig, "sqlstate", None) != _DENIED:
        return None
    words = (error.statement or "").split() or [""]
    if words[0].upper() == "SELECT":
        return OPERATOR if "FOR UPDATE" in " ".join(words) else READER
    if words[:2] == ["DELETE", "FROM"] and words[2] not in DELETED_FROM:
        return ADMIN
    return OPERATOR if words[0].upper() in _CHANGE_ROWS and VERSION not in words else ADMIN
