"""The pages that describe the JSON API: all routes with a search, and one of them with its fields,
examples and a form that sends the request."""

from __future__ import annotations

from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from ..web.api_reference import ApiRoute, routes_by_topic
from ..web.dependencies import Configured
from ..web.rendering import page

router = APIRouter()


@router.get("/api")
def api(request: Request, settings: Configured) -> Response:
    document = request.app.openapi()
    return page(
        request,
        "api.html",
        origin=_origin(request),
        topics=_topics(request),
        problem=document["components"]["schemas"]["Problem"]["properties"],
        guarded=settings.token is not None,
    )


# Not below /api, where errors are JSON: this is a page for people.
@router.get("/operations/{anchor}")
def route(request: Request, anchor: str) -> Response:
    shown, topic = _route(request, anchor)
    form = [row for row in shown.fields if row.place in ("path", "query", "body")]
    data = {
        "method": shown.method,
        "path": shown.path,
        "kind": shown.kind,
        "fields": [
            {
                "name": row.name,
                "id": row.id,
                "place": row.place,
                "control": row.control,
                "unit": row.unit,
            }
            for row in form
        ],
    }
    return page(
        request, "api_route.html", origin=_origin(request), route=shown, topic=topic, data=data
    )


def _origin(request: Request) -> str:
    return str(request.base_url).rstrip("/")


def _topics(request: Request) -> dict[str, list[ApiRoute]]:
    return routes_by_topic(request.app.openapi(), _origin(request))


def _route(request: Request, anchor: str) -> tuple[ApiRoute, str]:
    """The route of a page, and its topic. Raises `LookupError` for one that there is not."""
    for topic, routes in _topics(request).items():
        for shown in routes:
            if shown.anchor == anchor:
                return shown, topic
    raise LookupError(f"no operation {anchor!r} of the API; the page /api lists them")
