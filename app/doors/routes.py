"""All operations as routes of the web application: JSON below /api, and forms."""

from __future__ import annotations

from functools import cache

from fastapi import APIRouter

from ..operations.catalogue import operations
from .form_route import add_form
from .json_route import add_route


@cache
def json_router() -> APIRouter:
    """A JSON route for each operation that has one; made once, for it knows no store."""
    router = APIRouter()
    for operation in operations():
        if "json" not in operation.absent:
            add_route(router, operation)
    return router


@cache
def form_router() -> APIRouter:
    """What answers the form of each operation; a page with the form where no page has it."""
    router = APIRouter()
    for operation in operations():
        if "form" not in operation.absent:
            add_form(router, operation)
    return router
