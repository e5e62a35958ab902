"""Connections that hold a place without asking anything: how long a request may take to arrive, and
how many connections one address may have.

A server thread costs nothing while it waits, but a file descriptor and a place among the
connections do; whoever opens thousands and sends a byte now and then ("slow loris") keeps everybody
else out. Uvicorn bounds the time between two requests of a connection, not that within one.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from ..web.client_address import client_network
from ..web.settings import Settings

#: Seconds within which the head of a request must be there: from the connection's begin, or its
#: first byte.
HEAD_S = 10.0
#: A body must bring this many bytes in each of these seconds while the application takes them: 100
#: bytes a second, a fiftieth of a modem's.
BODY_S, BODY_BYTES = 20.0, 2_000
#: Seconds within which a client must take what waits to be sent: some 50 kB, or the end of an
#: answer.
WRITE_S = 60.0
#: Connections of one address at once: a browser opens six, and several people may come through one.
PER_ADDRESS = 64
#: Connections at once at all, below the 1,024 files that a process may have open as a rule.
AT_ONCE = 500


class BoundedConnections:
    """Makes the protocol of each connection, and counts them. `trusted`: whether an address is a
    proxy, which brings the connections of many and is not counted by address."""

    def __init__(
        self,
        trusted: Callable[[str], bool] = lambda _: False,
        *,
        head_s: float = HEAD_S,
        body_s: float = BODY_S,
        write_s: float = WRITE_S,
        per_address: int = PER_ADDRESS,
        at_once: int = AT_ONCE,
    ) -> None:
        self.trusted, self.head_s, self.body_s, self.write_s = trusted, head_s, body_s, write_s
        self.per_address, self.at_once = per_address, at_once
        self.counts: Counter[str] = Counter()

    def protocol(self) -> type[H11Protocol]:
        """The class that `uvicorn.Config(http=...)` takes."""
        bounds = self

        class BoundedProtocol(_BoundedProtocol):
            pass

        BoundedProtocol.bounds = bounds
        return BoundedProtocol

    def admit(self, host: str | None) -> bool:
        """Count a connection; False, and not counted, where there are too many."""
        network = client_network(host)
        exempt = host is not None and self.trusted(host)
        if self.counts.total() >= self.at_once or (
            not exempt and self.counts[network] >= self.per_address
        ):
            return False
        self.counts[network] += 1
        return True

    def release(self, host: str | None) -> None:
        """A counted connection has ended."""
        network = client_network(host)
        self.counts[network] -= 1
        if self.counts[network] <= 0:
            del self.counts[network]


class _BoundedProtocol(H11Protocol):
    bounds: BoundedConnections
    _counted = False
    _timer: asyncio.TimerHandle | None = None
    _write_timer: asyncio.TimerHandle | None = None
    _stage: object = None
    _bytes = 0

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._counted = self.bounds.admit(self._host())
        if self._counted:
            self._watch()
        else:
            transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        if self._counted:
            self._counted = False
            self.bounds.release(self._host())
        self._stop_watch()
        self.resume_writing()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        if not self._counted:
            return
        self._bytes += len(data)
        super().data_received(data)
        self._watch()

    def pause_writing(self) -> None:
        super().pause_writing()
        self._abort_later()

    def resume_writing(self) -> None:
        super().resume_writing()
        if self._write_timer is not None:
            self._write_timer.cancel()
            self._write_timer = None

    def timeout_keep_alive_handler(self) -> None:
        super().timeout_keep_alive_handler()
        self._abort_later()

    def on_response_complete(self) -> None:
        super().on_response_complete()  # which bounds the time until the next request begins
        if self.transport.is_closing():
            self._abort_later()
            return
        if self.conn.their_state is h11.IDLE:
            self._stop_watch()
        if self.conn.trailing_data[0]:
            self._watch()

    def _host(self) -> str | None:
        return self.client[0] if self.client else None

    def _watch(self) -> None:
        """Begin the time of the stage that the request is in; a timer that runs for this stage goes
        on."""
        stage = self.conn.their_state
        if stage is self._stage and self._timer is not None:
            return
        self._stop_watch()
        self._stage = stage
        if stage is h11.IDLE:
            self._timer = self.loop.call_later(self.bounds.head_s, self._end)
        elif stage is h11.SEND_BODY:
            self._timer = self.loop.call_later(self.bounds.body_s, self._look_at_body, self._bytes)

    def _look_at_body(self, before: int) -> None:
        if self.conn.their_state is not h11.SEND_BODY:
            return
        # While reading is paused, it is the application that takes its time.
        if self._bytes - before < BODY_BYTES and not self.flow.read_paused:
            self._end()
        else:
            self._timer = self.loop.call_later(self.bounds.body_s, self._look_at_body, self._bytes)

    def _stop_watch(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _end(self) -> None:
        self._stop_watch()
        if self.conn.our_state is h11.IDLE and not self.transport.is_closing():
            self.transport.write(
                b"HTTP/1.1 408 Request Timeout\r\nconnection: close\r\ncontent-length: 0\r\n\r\n"
            )
        self.transport.close()
        self._abort_later()

    def _abort_later(self) -> None:
        """Closing waits until what is written was taken, which may be never."""
        if self._write_timer is None:
            self._write_timer = self.loop.call_later(self.bounds.write_s, self.transport.abort)


def server_options(settings: Settings) -> dict[str, Any]:
    """What `uvicorn.Config` takes beside the application. Headers that name another address or
    scheme are believed of the trusted proxies alone; without one, of nobody."""
    return {
        "http": BoundedConnections(settings.is_trusted_proxy).protocol(),
        "ws": "none",
        "proxy_headers": bool(settings.trusted_proxies),
        "forwarded_allow_ips": list(settings.trusted_proxies),
        "log_level": "warning",
        "access_log": False,
        "timeout_graceful_shutdown": 3,
    }
