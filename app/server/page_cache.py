"""Pages that are made once for all of a role who open them, until what they rest on changes.

The stamp of the sources is read before a page is made, so that a page that is kept is never older
than its stamp; one that finds another stamp is made anew. Nothing is kept by time.
"""

from __future__ import annotations

import asyncio
import secrets
from collections import OrderedDict
from collections.abc import Hashable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from anyio import CapacityLimiter, to_thread
from starlette.datastructures import Headers, MutableHeaders
from starlette.routing import BaseRoute, Match
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from ..web.page_sources import PageSource, SourceStamps
from ..web.role_needs import need_of
from .compression import deflate, gzip_of

#: Bytes of all pages that are kept, as they are and compressed.
_MOST_BYTES = 24_000_000
#: Path, query, and what of a person a page is made for: role and kind.
_Key = tuple[str, bytes, str, str]


@dataclass(frozen=True)
class _Page:
    """`parts` stand around the token of the session, which differs from one reader to the next."""

    stamp: Hashable
    headers: list[tuple[bytes, bytes]]
    parts: list[bytes]
    deflated: list[bytes]

    @property
    def size(self) -> int:
        return sum(map(len, self.parts)) + sum(map(len, self.deflated))


class PageCache:
    """The application, whose pages that say what they rest on are kept (ASGI).

    Several who ask at once for a page that is not ready wait for the one that is being made.
    """

    def __init__(self, app: ASGIApp, routes: Sequence[BaseRoute], sources: SourceStamps) -> None:
        self.app, self._routes, self._sources = app, routes, sources
        self._pages: OrderedDict[_Key, _Page] = OrderedDict()
        self._bytes = 0
        self._in_work: dict[_Key, asyncio.Lock] = {}
        #: Stands in a page for the token of whoever reads it.
        self._token = secrets.token_hex(32)
        #: Stamps are read beside the pages that are being made, and do not wait for them.
        self._reading = CapacityLimiter(2)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        source = self._source(scope)
        if source is None:
            await self.app(scope, receive, send)
            return
        person = scope["state"]["person"]
        key = scope["path"], scope["query_string"], person.role, person.kind
        page = await self._current(key, source)
        if page is None:
            with self._lock_of(key) as lock:
                async with lock:
                    page = await self._current(key, source) or await self._make(
                        key, source, scope, receive, send
                    )
        if page is not None:
            await _send(page, scope, send)

    def _source(self, scope: Scope) -> PageSource | None:
        """What the page rests on; None of one that is not kept, and of one that this person may
        not see, of which the application says why."""
        if scope["type"] != "http" or scope["method"] != "GET":
            return None
        for route in self._routes:
            match, _ = route.matches(scope)
            if match is Match.FULL:
                if not scope["state"]["person"].may(need_of(route, "GET").role):
                    return None
                calls = (needed.dependency for needed in getattr(route, "dependencies", ()))
                return next((call for call in calls if isinstance(call, PageSource)), None)
        return None

    @contextmanager
    def _lock_of(self, key: _Key) -> Iterator[asyncio.Lock]:
        lock = self._in_work.setdefault(key, asyncio.Lock())
        try:
            yield lock
        finally:
            if not lock.locked() and self._in_work.get(key) is lock:
                del self._in_work[key]

    async def _current(self, key: _Key, source: PageSource) -> _Page | None:
        page = self._pages.get(key)
        if page is None or page.stamp != await self._stamp(source):
            return None
        self._pages.move_to_end(key)
        return page

    async def _stamp(self, source: PageSource) -> Hashable:
        return await to_thread.run_sync(self._sources.stamp, source, limiter=self._reading)

    async def _make(
        self, key: _Key, source: PageSource, scope: Scope, receive: Receive, send: Send
    ) -> _Page | None:
        """The page, kept; None where the application has sent another answer than a whole page."""
        stamp = await self._stamp(source)
        if stamp is None:
            await self.app(scope, receive, send)
            return None
        answer: list[Message] = []

        async def collect(message: Message) -> None:
            answer.append(message)

        common_scope = {**scope, "state": {**scope["state"], "csrf": self._token}}
        try:
            await self.app(common_scope, receive, collect)
        except Exception:  # the application tells of a fault of its own, and raises it
            for message in answer:
                await send(message)
            raise
        start, *bodies = answer
        body = b"".join(message.get("body", b"") for message in bodies)
        parts = body.split(self._token.encode())
        if start["status"] != 200:
            page_of_reader = scope["state"]["csrf"].encode().join(parts)
            await send(start)
            await send({"type": "http.response.body", "body": page_of_reader})
            return None
        deflated = await to_thread.run_sync(lambda: [deflate(part) for part in parts])
        page = _Page(stamp, start["headers"], parts, deflated)
        self._keep(key, page)
        return page

    def _keep(self, key: _Key, page: _Page) -> None:
        former = self._pages.pop(key, None)
        self._bytes += page.size - (former.size if former else 0)
        self._pages[key] = page
        while self._bytes > _MOST_BYTES and self._pages:
            _, oldest = self._pages.popitem(last=False)
            self._bytes -= oldest.size


async def _send(page: _Page, scope: Scope, send: Send) -> None:
    token = scope["state"]["csrf"].encode()
    headers = MutableHeaders(raw=[*page.headers])
    body = token.join(page.parts)
    if "gzip" in Headers(scope=scope).get("accept-encoding", ""):
        body = gzip_of(body, deflate(token).join(page.deflated))
        headers["content-encoding"] = "gzip"
    headers.add_vary_header("Accept-Encoding")
    headers["content-length"] = str(len(body))
    await send({"type": "http.response.start", "status": 200, "headers": headers.raw})
    await send({"type": "http.response.body", "body": body})
