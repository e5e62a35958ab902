"""Pages and data are sent compressed (RFC 9110, 8.4).

A secret in a compressed page can be guessed by who sees the size of answers and makes the browser
ask with text of their own (the BREACH attack). Ours is out of reach: the cookie of a session is
SameSite=strict, so that no other site makes a browser ask for a page of a session.
"""

from __future__ import annotations

import gzip
import struct
import zlib

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

#: Types of text. Pictures, archives and recordings are compressed already.
_TEXT = ("text/html", "text/plain", "text/csv", "text/css", "application/json", "image/svg+xml")
#: Less than this fits into one packet anyway.
_LEAST_BYTES = 1_000
#: Of 1 to 9: beyond it pages become no smaller.
_LEVEL = 6


class Compression:
    """The application, whose answers of one piece are compressed where the client reads gzip.

    What is sent in pieces is passed on as it is.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or "gzip" not in Headers(scope=scope).get("accept-encoding", ""):
            await self.app(scope, receive, send)
            return
        start: Message | None = None

        async def compressed(message: Message) -> None:
            nonlocal start
            if message["type"] == "http.response.start":
                start = message
                return
            if start is not None:
                if message["type"] == "http.response.body" and _is_worth_it(start, message):
                    message = _compress(start, message)
                await send(start)
                start = None
            await send(message)

        await self.app(scope, receive, compressed)


def _is_worth_it(start: Message, message: Message) -> bool:
    headers = Headers(raw=start["headers"])
    return (
        not message.get("more_body", False)
        and len(message.get("body", b"")) >= _LEAST_BYTES
        and "content-encoding" not in headers
        and headers.get("content-type", "").startswith(_TEXT)
    )


def _compress(start: Message, message: Message) -> Message:
    body = gzip.compress(message["body"], _LEVEL, mtime=0)
    headers = MutableHeaders(raw=start["headers"])
    headers["content-encoding"] = "gzip"
    headers["content-length"] = str(len(body))
    headers.add_vary_header("Accept-Encoding")
    start["headers"] = headers.raw
    return {**message, "body": body}


def deflate(text: bytes) -> bytes:
    """A piece of a compressed body (RFC 1951): it ends at a whole byte and refers to no other."""
    compressor = zlib.compressobj(_LEVEL, zlib.DEFLATED, -zlib.MAX_WBITS)
    return compressor.compress(text) + compressor.flush(zlib.Z_FULL_FLUSH)


def gzip_of(text: bytes, pieces: bytes) -> bytes:
    """The gzip file (RFC 1952) of a text whose pieces `deflate` has compressed."""
    head = b"\x1f\x8b\x08" + bytes(6) + b"\xff"
    end = zlib.compressobj(_LEVEL, zlib.DEFLATED, -zlib.MAX_WBITS).flush()
    return head + pieces + end + struct.pack("<II", zlib.crc32(text), len(text) & 0xFFFFFFFF)
