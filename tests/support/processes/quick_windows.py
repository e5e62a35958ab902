"""Windows that are there at once: what does not depend on the store is made once for all tests."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from typing import Any

import pytest


@pytest.fixture(scope="session", autouse=True)
def routes_built_once() -> Iterator[None]:
    """A route that one application has built is not built again for the next: that took a quarter
    of the time of tests with a window each.

    Routes know no store, which a request brings. A program that has one application builds each
    once anyway.
    """
    # Where no file of tests has imported it, no window is opened that would gain by it.
    routing: Any = sys.modules.get("fastapi.routing")
    if routing is None:
        yield
        return
    build = routing._IncludedRouter._build_effective_context
    built: dict[Any, tuple[Any, Any]] = {}

    def once(included: Any, route: Any) -> Any:
        key = (id(route), *_of_inclusion(included.include_context))
        if key not in built:
            built[key] = (route, build(included, route))  # with the route, whose id is its own then
        return built[key][1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(routing._IncludedRouter, "_build_effective_context", once)
        yield


def _of_inclusion(context: Any) -> tuple[Any, ...]:
    """What a built route takes from the place where its router is included.

    It takes the application too, for dependencies that are overridden, and none of ours is.
    """
    assert not context.dependency_overrides_provider.dependency_overrides
    return (
        id(context.included_router),
        context.prefix,
        context.include_in_schema,
        context.deprecated,
        context.max_body_size,
        tuple(context.tags),
        tuple((needed.dependency, needed.use_cache) for needed in context.dependencies),
        tuple((status, repr(answer)) for status, answer in context.responses.items()),
        tuple(map(id, context.callbacks)),
        *(getattr(part, "value", part) for part in _replaceable(context)),
    )


def _replaceable(context: Any) -> tuple[Any, ...]:
    return (
        context.default_response_class,
        context.generate_unique_id_function,
        context.strict_content_type,
    )


@pytest.fixture(scope="session", autouse=True)
def cheap_hashes() -> Iterator[Callable[[], Any]]:
    """A password is hashed in a millisecond, not in the tenth of a second that makes guessing dear.

    Gives what makes the hashes of the software; a test of people asks for one.
    """
    from argon2 import PasswordHasher
    from pyroshock.app.operations.people import passwords

    real_hasher = passwords._hasher
    cheap = PasswordHasher(time_cost=1, memory_cost=64, parallelism=1)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(passwords, "_hasher", lambda: cheap)
        yield real_hasher
