"""Which role a person needs for a route: said beside the route, by the operation that it asks for
or by itself, and checked in one place before the route is called."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from starlette.requests import Request

from ...schema.person_roles import ADMINISTRATOR, READER, Person
from .guard import SAFE_METHODS

if TYPE_CHECKING:
    from ..operations.operation import Operation


@dataclass(frozen=True)
class NeedsRole:
    """A dependency of a route that says which role it needs, and for what: the subject of the
    sentence that refuses."""

    role: str
    what: str

    def __call__(self) -> None:
        """Called for each request; `require_role` has looked at it before."""


def role_of(operation: Operation[Any, Any]) -> NeedsRole:
    """The role that an operation needs, for a route that asks for it."""
    return NeedsRole(operation.needed_role, f"the operation {operation.name}")


def need_of(route: Any, method: str) -> NeedsRole:
    """What a route needs. One that says nothing of it reads, where its method does, and is an
    administrator's otherwise: a test names it."""
    needed = declared_need(route)
    if needed is not None:
        return needed
    role = READER if method in SAFE_METHODS else ADMINISTRATOR
    return NeedsRole(role, f"{method} {getattr(route, 'path', '')}")


def declared_need(route: Any) -> NeedsRole | None:
    """What a route says that it needs; None where it says nothing."""
    calls = (needed.dependency for needed in getattr(route, "dependencies", ()))
    return next((call for call in calls if isinstance(call, NeedsRole)), None)


def check_route(route: Any, method: str, person: Person) -> None:
    """Refuse a person whose role is less than the route needs. Raises `RoleNeededError`."""
    needed = need_of(route, method)
    person.check_may(needed.role, needed.what)


def require_role(request: Request) -> None:
    """Raises `RoleNeededError`; a dependency of every route."""
    check_route(request.scope["route"], request.method, request.state.person)
