"""Connections that send no whole request are closed, and one address has so many at most; over
loopback sockets."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import pytest
import uvicorn
from pyroshock.app.server.connections import PER_ADDRESS, BoundedConnections, server_options
from pyroshock.app.web.settings import Settings, SettingsError

HEAD = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n"
GET = HEAD + b"\r\n"
POST = b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 100000\r\n\r\n"
#: Seconds that the test's server gives, and what a busy machine may add.
LIMIT_S, PATIENCE_S = 0.5, 20.0


async def _app(scope: Any, receive: Any, send: Any) -> None:
    """Answers with what it was asked by, and how much it got; 30 MB for /large."""
    if scope["type"] == "lifespan":
        return
    taken, more = 0, True
    while more:
        message = await receive()
        if message["type"] == "http.disconnect":
            return
        taken += len(message["body"])
        more = message.get("more_body", False)
    body = (
        bytes(30_000_000)
        if scope["path"] == "/large"
        else f"{scope['client'][0]} {scope['scheme']} {taken}".encode()
    )
    await send(
        {
            "type": "http.response.start",
            "status": 200,
            "headers": [(b"content-length", b"%d" % len(body))],
        }
    )
    await send({"type": "http.response.body", "body": body})


@contextmanager
def _served(bounds: BoundedConnections, **options: Any) -> Iterator[tuple[str, int]]:
    settings = Settings("sqlite://", **options)
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        config = {
            **server_options(settings),
            "http": bounds.protocol(),
            "lifespan": "off",
            "log_level": "critical",
        }
        server = uvicorn.Server(uvicorn.Config(_app, **config))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, daemon=True)
        thread.start()
        deadline = time.monotonic() + PATIENCE_S
        while not server.started and time.monotonic() < deadline:
            time.sleep(0.01)
        try:
            yield listener.getsockname()
        finally:
            server.should_exit = True
            thread.join(PATIENCE_S)


def _bounds(**more: Any) -> BoundedConnections:
    return BoundedConnections(**{"head_s": LIMIT_S, "body_s": LIMIT_S, "write_s": LIMIT_S, **more})


def _connected(address: tuple[str, int]) -> socket.socket:
    return socket.create_connection(address, timeout=PATIENCE_S)


def _closed_after(
    connection: socket.socket, drip: bytes, pause_s: float = 0.1
) -> tuple[float, bytes]:
    """Seconds until the server ends a connection that brings a byte now and then, and what it
    answered."""
    begin, answer = time.monotonic(), b""
    connection.settimeout(pause_s)
    for byte in (drip or b"") * 1000:
        try:
            if drip:
                connection.sendall(bytes([byte]))
            answer += (block := connection.recv(1000))
            if not block:
                return time.monotonic() - begin, answer
        except TimeoutError:
            pass
        except OSError:
            return time.monotonic() - begin, answer
        if time.monotonic() - begin > PATIENCE_S:
            break
    raise AssertionError("the server keeps a connection that sends no request")


@pytest.mark.parametrize(("begin", "drip"), [
    (b"G", b"E"),  # a head that never ends
    (HEAD, b"X"),
    (GET + HEAD, b"X"),  # the second request of a connection
    (POST, b"a"),  # a body that drips
    (GET + POST, b"a"),
], ids=["method", "headers", "second request", "body", "second body"])  # fmt: skip
def test_a_request_that_drips_is_ended(begin: bytes, drip: bytes) -> None:
    bounds = _bounds()
    with _served(bounds) as address, _connected(address) as connection:
        connection.sendall(begin)
        seconds, _ = _closed_after(connection, drip)
        assert LIMIT_S / 2 < seconds < PATIENCE_S
        assert _settles(bounds, 0)


def test_a_connection_that_says_nothing_is_ended() -> None:
    with _served(_bounds()) as address, _connected(address) as connection:
        assert b"408" in connection.recv(1000)
        assert connection.recv(1000) == b""


def test_an_answer_that_nobody_takes_is_given_up() -> None:
    bounds = _bounds()
    with _served(bounds) as address, _connected(address) as connection:
        connection.sendall(GET.replace(b"GET /", b"GET /large"))
        assert _settles(bounds, 0)


def test_an_upload_that_comes_at_a_slow_line_s_pace_is_taken() -> None:
    """Ten times as long as the limit, at 20 kB in each of its times."""
    with _served(_bounds(head_s=PATIENCE_S)) as address, _connected(address) as connection:
        connection.sendall(POST)
        for _ in range(50):
            connection.sendall(b"x" * 2_000)
            time.sleep(LIMIT_S / 10)
        assert _answer_with(b"127.0.0.1 http 100000", connection)


def _answer_with(expected: bytes, connection: socket.socket) -> bool:
    """Whether the answer, which may come in parts, holds this."""
    answer = b""
    while expected not in answer and (block := connection.recv(10_000)):
        answer += block
    return expected in answer


def _settles(bounds: BoundedConnections, count: int) -> bool:
    deadline = time.monotonic() + PATIENCE_S
    while bounds.counts.total() != count and time.monotonic() < deadline:
        time.sleep(0.02)
    return bounds.counts.total() == count


def _answered(connection: socket.socket) -> bool:
    try:
        connection.sendall(GET)
        return b"200 OK" in connection.recv(1000)
    except OSError:
        return False


def test_one_address_has_so_many_connections_and_others_get_through() -> None:
    bounds = _bounds(head_s=PATIENCE_S)
    with _served(bounds) as address, ExitStack() as stack:
        held = [stack.enter_context(_connected(address)) for _ in range(PER_ADDRESS)]
        assert _settles(bounds, PER_ADDRESS)
        assert not _answered(stack.enter_context(_connected(address)))
        other = stack.enter_context(socket.socket())
        other.bind(("127.0.0.2", 0))
        other.settimeout(PATIENCE_S)
        other.connect(address)
        assert _answered(other)
        for connection in held:
            connection.close()
        assert _settles(bounds, 1)
        assert _answered(stack.enter_context(_connected(address)))


def test_all_connections_are_bounded_also_those_of_a_proxy() -> None:
    bounds = BoundedConnections(lambda host: host == "127.0.0.1", per_address=2, at_once=5)
    assert [bounds.admit("127.0.0.1") for _ in range(6)] == [True] * 5 + [False]
    for _ in range(5):
        bounds.release("127.0.0.1")
    assert [
        bounds.admit("2001:db8::1"),
        bounds.admit("2001:db8::2"),
        bounds.admit("2001:db8::3"),
    ] == [
        True,
        True,
        False,
    ]
    bounds.release("2001:db8::1")
    bounds.release("2001:db8::1")
    assert not bounds.counts


@pytest.mark.parametrize(("trusted", "seen"), [
    ((), b"127.0.0.1 http"),
    (("10.0.0.1",), b"127.0.0.1 http"),
    (("127.0.0.0/8",), b"198.51.100.7 https"),
])  # fmt: skip
def test_only_a_proxy_that_was_named_tells_another_address(
    trusted: tuple[str, ...], seen: bytes
) -> None:
    with (
        _served(_bounds(head_s=PATIENCE_S), trusted_proxies=trusted) as address,
        _connected(address) as connection,
    ):
        connection.sendall(
            HEAD + b"X-Forwarded-For: 203.0.113.9, 198.51.100.7\r\nX-Forwarded-Proto: https\r\n\r\n"
        )
        assert _answer_with(seen, connection)


@pytest.mark.parametrize("proxy", ["*", "proxy", "10.0.0.1/8", "", "300.1.1.1"])
def test_a_trusted_proxy_is_an_address(proxy: str) -> None:
    with pytest.raises(SettingsError, match="no address or network"):
        Settings("sqlite://", trusted_proxies=(proxy,))
