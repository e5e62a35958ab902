"""Attached photographs and documents: all of them on one page, and each as a file.

A file is what a stranger has sent. Pictures of the kinds that browsers draw without running
anything are shown; everything else is handed out to be saved, and no answer may run a script,
whatever a browser takes it for (OWASP, file upload).
"""

from __future__ import annotations

from typing import Annotated
from urllib.parse import quote

from fastapi import APIRouter, Depends, Query
from starlette.requests import Request
from starlette.responses import Response

from ..common.reduced_pictures import MEDIA_TYPE, PREVIEW_PX, reduced_picture
from ..operations.people.attachments import ATTACHMENT_GET
from ..operations.people.stored_attachments import (
    content_of,
    get_attachment,
    recent_attachments,
)
from ..web.dependencies import Key, OpenStore
from ..web.page_sources import THE_STORE
from ..web.rendering import page
from ..web.role_needs import role_of

router = APIRouter()
#: Attachments of one page.
PAGE = 50
_Before = Annotated[int | None, Query(ge=1, le=2**31 - 1)]
_HEADERS = {
    "content-security-policy": "default-src 'none'; sandbox",
    "x-content-type-options": "nosniff",
    # a browser asks each time, for who may not read it any more, and is sent the bytes once
    "cache-control": "private, no-cache",
}


@router.get("/attachments", dependencies=[Depends(THE_STORE)])
def attachments(request: Request, store: OpenStore, before: _Before = None) -> Response:
    with store.reading() as session:
        listed = recent_attachments(session, PAGE + 1, before)
        pages = {row.key: row.subject.page(session) for row in listed}
    return page(
        request,
        "attachments.html",
        attachments=listed[:PAGE],
        pages=pages,
        older=f"/attachments?before={listed[PAGE - 1].key}" if len(listed) > PAGE else "",
    )


@router.get("/attachments/{attachment}/preview", dependencies=[Depends(role_of(ATTACHMENT_GET))])
def preview(request: Request, attachment: Key, store: OpenStore) -> Response:
    """A picture in the size that pages show."""
    with store.reading() as session:
        stored = get_attachment(session, attachment)
        if not stored.is_shown:
            raise LookupError(f"attachment {attachment} ({stored.file_name}) is shown by no page")
        tag = f'"{stored.sha256}-{PREVIEW_PX}"'
        if stored.removed_at is None and request.headers.get("if-none-match") == tag:
            return Response(status_code=304, headers={**_HEADERS, "etag": tag})
        content = content_of(session, attachment)
    reduced, *_ = reduced_picture(content, PREVIEW_PX)
    return Response(reduced, media_type=MEDIA_TYPE, headers={**_HEADERS, "etag": tag})


@router.get("/attachments/{attachment}/file", dependencies=[Depends(role_of(ATTACHMENT_GET))])
def file(request: Request, attachment: Key, store: OpenStore, download: bool = False) -> Response:
    """The bytes: of a picture that pages show to be drawn, of anything else to be saved."""
    with store.reading() as session:
        stored = get_attachment(session, attachment)
        tag = f'"{stored.sha256}"'
        if stored.removed_at is None and request.headers.get("if-none-match") == tag:
            return Response(status_code=304, headers={**_HEADERS, "etag": tag})
        content = content_of(session, attachment)
    is_drawn = stored.is_shown and not download
    return Response(
        content,
        media_type=stored.media_type if is_drawn else "application/octet-stream",
        headers={
            **_HEADERS,
            "etag": tag,
            "content-disposition": f"{'inline' if is_drawn else 'attachment'}; "
            f"filename*=UTF-8''{quote(stored.file_name, safe='')}",
        },
    )
