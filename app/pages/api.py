"""The page that describes the JSON API: every route, how to call it, and the tokens that a script
sends."""

from __future__ import annotations

from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from ..web.api_reference import routes_by_topic
from ..web.dependencies import Configured
from ..web.rendering import page

router = APIRouter()


@router.get("/api")
def api(request: Request, settings: Configured) -> Response:
    document = request.app.openapi()
    origin = str(request.base_url).rstrip("/")
    return page(
        request,
        "api.html",
        origin=origin,
        topics=routes_by_topic(document, origin),
        problem=document["components"]["schemas"]["Problem"]["properties"],
        guarded=settings.token is not None,
    )
