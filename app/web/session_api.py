"""The token that writes carry."""

from __future__ import annotations

from fastapi import APIRouter
from starlette.requests import Request

from .csrf import HEADER

router = APIRouter(tags=["session"])


@router.get("/csrf")
def csrf(request: Request) -> dict[str, str]:
    """The token for the header X-CSRF-Token; it belongs to the cookie that this answer sets."""
    return {"header": HEADER, "token": request.state.csrf}
