"""The HTTP of the Python library: one kept connection to a server of pyroshock, whose answers are
read and whose refusals become the library's errors.

`http.client` of the standard library does it: the library needs no further dependency for one
request at a time. Nothing here writes a file, follows a redirect, or reads another form than JSON
and arrays of NumPy without objects.
"""

from __future__ import annotations

import http.client
import io
import json
import os
import re
import socket
import ssl
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from http.cookies import CookieError, SimpleCookie
from typing import TYPE_CHECKING, Any, NoReturn
from urllib.parse import parse_qs, quote, urlencode, urlsplit
from urllib.request import getproxies, proxy_bypass

from ... import __version__
from ..common.errors import InvalidValueError, NotFoundError, StorageError, argument_names
from ..operations.result_codec import CodecError, decode

if TYPE_CHECKING:
    from ...array_types import Floats

#: What `web.result_answer` calls its form; stated again, for no client imports the pages.
RESULT_TYPE = "application/vnd.pyroshock.result+json"
TOKEN_VARIABLE = "PYROSHOCK_TOKEN"  # noqa: S105  the name of a variable
#: Seconds until a server has taken a connection, and between two of its bytes. A prediction with
#: many draws is answered after a minute.
CONNECT_S, ANSWER_S = 10.0, 300.0
#: A larger answer is refused: a list of a million impacts has half of it.
MOST_BYTES = 1_000_000_000
#: A read is asked again after these pauses; a write never is.
_PAUSES_S = (0.2, 1.0)
_BUSY = (502, 503, 504)
#: `http.client` and the layers below it, of a connection that does not come or breaks.
_LOST = (OSError, http.client.HTTPException)


@dataclass
class ServerConnection:
    """A server, and the token that it is sent. `address` has neither token nor a trailing slash."""

    address: str
    _token: str | None = field(default=None, repr=False)
    _kept: http.client.HTTPConnection | None = field(default=None, repr=False)
    _session: dict[str, str] = field(default_factory=dict, repr=False)
    _lock: threading.RLock = field(default_factory=threading.RLock, repr=False)

    # --- what the library asks

    def read(self, path: str, query: Mapping[str, Any] | None = None) -> Any:
        """A result of `web.result_answer`. `query` values are texts, or lists of texts."""
        return self._result(path, self.request("GET", path, query=query))

    def ask(self, path: str, body: Any) -> Any:
        """A result of `web.result_answer` that a body is sent for."""
        return self._result(path, self.write(path, body))

    def json(self, path: str) -> Any:
        """The JSON of a route of the API."""
        return self._json(path, self.request("GET", path, accept="application/json"))

    def write(self, path: str, body: Any, content_type: str = "application/json") -> bytes:
        """What a write answers: JSON of a `body` that is no bytes. It is sent once."""
        sent = body if isinstance(body, bytes) else json.dumps(body, allow_nan=False).encode()
        return self.request("POST", path, body=sent, content_type=content_type)

    def write_json(self, path: str, body: Any, content_type: str = "application/json") -> Any:
        """The JSON that a write answers."""
        return self._json(path, self.write(path, body, content_type))

    def array(self, path: str, query: Mapping[str, Any]) -> Floats:
        """An array in the form of NumPy's files, of numbers alone."""
        import numpy as np

        content = self.request("GET", path, query=query, accept="application/octet-stream")
        try:
            return np.lib.format.read_array(io.BytesIO(content), allow_pickle=False)
        except (ValueError, EOFError, OSError) as error:
            raise StorageError(f"{self.address}{path} gave no array of numbers: {error}") from error

    def close(self) -> None:
        """End the connection; the next request opens another one."""
        with self._lock:
            if self._kept is not None:
                self._kept.close()
            self._kept = None

    def __del__(self) -> None:
        """Who forgets to close a store leaves no socket open."""
        self.close()

    # --- one request

    def request(
        self,
        method: str,
        path: str,
        *,
        query: Mapping[str, Any] | None = None,
        body: bytes | None = None,
        content_type: str = "",
        accept: str = f"{RESULT_TYPE}, application/json",
    ) -> bytes:
        """The body of an answer of status 200 to 299.

        Raises:
            NotFoundError: For what the server does not have.
            InvalidValueError: For what it refuses.
            StorageError: For a server that is not there, is another program, or admits nobody.
        """
        target = path + (f"?{urlencode(query, doseq=True)}" if query else "")
        reads = method == "GET"
        headers = {"accept": accept, "user-agent": f"pyroshock/{__version__}"}
        if body is not None:
            headers["content-type"] = content_type
        if self._token is not None:
            headers["authorization"] = f"Bearer {self._token}"
        for pause_s in (*(_PAUSES_S if reads else ()), None):
            written = {} if reads else self._write_headers()
            try:
                status, kind, content = self._sent(method, target, body, {**headers, **written})
            except _LOST as error:  # a read is asked again after each pause, then it is raised
                self.close()
                if pause_s is None or isinstance(error, ssl.SSLError | socket.gaierror):
                    self._raise_lost(error, path, reads)
                time.sleep(pause_s)
                continue
            if status in _BUSY and pause_s is not None:
                time.sleep(pause_s)
                continue
            if 200 <= status < 300 and "html" not in kind:
                return content
            if written and status == 403 and b"/api/csrf" in content and self._session:
                # The server was started anew and refuses the old token before it does anything.
                self._session.clear()
                return self.request(
                    method, path, query=query, body=body, content_type=content_type, accept=accept
                )
            self._raise_refused(status, kind, content, path)
        raise AssertionError("the last attempt returns or raises")

    def _sent(
        self, method: str, target: str, body: bytes | None, headers: Mapping[str, str]
    ) -> tuple[int, str, bytes]:
        """Status, media type and content of an answer. Raises one of `_LOST`."""
        with self._lock:
            if method != "GET":
                # On a kept connection one cannot tell whether a write that got no answer was read.
                self.close()
            if self._kept is None:
                self._kept = _opened(self.address)
            prefix = _absolute(self.address)
            self._kept.request(method, prefix + target, body, dict(headers))
            answer = self._kept.getresponse()
            content = answer.read(MOST_BYTES + 1)
            if len(content) > MOST_BYTES:
                self.close()
                raise StorageError(
                    f"{self.address}{target.partition('?')[0]} answers with more than "
                    f"{MOST_BYTES:,} bytes; ask for less: a campaign, a condition, a limit"
                )
            if not answer.isclosed() or answer.will_close:
                self.close()
            self._keep_session(answer.headers.get_all("set-cookie") or ())
            return answer.status, answer.headers.get_content_type(), content

    def _write_headers(self) -> dict[str, str]:
        """The token of a session and its cookie, without which no server takes a write."""
        if "csrf" not in self._session:
            session = self._json("/api/csrf", self.request("GET", "/api/csrf"))
            if not isinstance(session, dict) or not {"token", "header"} <= session.keys():
                self._raise_other_program("/api/csrf", "no token of a session")
            # what a server sends goes into a header of ours: one line, and no control characters
            self._session["csrf"] = "".join(filter(str.isalnum, str(session["token"])))
        headers = {"x-csrf-token": self._session["csrf"]}
        if "cookie" in self._session:
            headers["cookie"] = self._session["cookie"]
        return headers

    def _keep_session(self, cookies: Sequence[str]) -> None:
        for text in cookies:
            try:
                parsed = SimpleCookie(text)
            except CookieError:  # a proxy's own, of a form that Python does not read
                continue
            for name, cookie in parsed.items():
                if name == "pyroshock_session" and re.fullmatch(r"[\w.~-]{1,200}", cookie.value):
                    self._session["cookie"] = f"{name}={cookie.value}"

    # --- answers

    def _json(self, path: str, content: bytes) -> Any:
        try:
            return json.loads(content)
        except (ValueError, RecursionError):  # no JSON, or nested without end
            self._raise_other_program(path, "no JSON")

    def _result(self, path: str, content: bytes) -> Any:
        answer = self._json(path, content)
        if not isinstance(answer, dict) or answer.keys() != {"software", "result"}:
            self._raise_other_program(path, "no result of this library")
        return self.decoded(answer["result"], answer["software"])

    def decoded(self, data: Any, version: object = "another version") -> Any:
        """A result of the server's JSON. Raises `StorageError` with both versions."""
        try:
            return decode(data)
        except CodecError as error:
            raise StorageError(
                f"{self.address} has pyroshock {version!s:.40}, this is {__version__}: {error}; "
                "install the same version here as there"
            ) from error

    def _raise_other_program(self, path: str, words: str) -> NoReturn:
        raise StorageError(
            f"{self.address}{path} gave {words}: is a server of pyroshock {__version__} at this "
            "address? Another version, a proxy or another program may answer there"
        )

    def _raise_refused(self, status: int, kind: str, content: bytes, path: str) -> NoReturn:
        """The error that an answer tells, as the library would raise it."""
        if kind != "application/json":
            words = {301: "a redirect", 302: "a redirect", 303: "a redirect", 307: "a redirect"}
            what = words.get(status, f"a page ({kind}, status {status})")
            self._raise_other_program(path, f"{what} where JSON was expected")
        answer = self._json(path, content)
        detail = answer.get("detail") if isinstance(answer, dict) else None
        if not isinstance(detail, str):
            self._raise_other_program(path, f"status {status} without words")
        if status == 404 and detail == "Not Found":
            self._raise_other_program(path, "nothing")
        if status in (401, 429):
            raise StorageError(
                f"{self.address} admits nobody with this token: {detail}; give the right one: "
                f'ps.open("{self.address}", token="..."), or the variable {TOKEN_VARIABLE}'
                if self._token is not None
                else f'{self.address} needs a token: ps.open("{self.address}", token="..."), or '
                f"the variable {TOKEN_VARIABLE}"
            )
        if status in (403, 421):
            raise StorageError(f"{self.address} refuses: {detail}")
        if status == 404:
            raise NotFoundError(argument_names(detail))
        if 400 <= status < 500:
            refusal = InvalidValueError(argument_names(detail))
            refusal.__dict__["faults"] = _faults(answer)  # `argument_words` spells them
            raise refusal
        raise StorageError(f"{self.address}: {argument_names(detail)}")

    def _raise_lost(self, error: Exception, path: str, reads: bool) -> NoReturn:
        if isinstance(error, ssl.SSLCertVerificationError):
            raise StorageError(
                f"{self.address} is not trusted: {error.verify_message}; the variable "
                "SSL_CERT_FILE names the certificate of an authority of your own"
            ) from error
        words = _words_of_loss(error)
        if reads or isinstance(error, ConnectionRefusedError | socket.gaierror):
            raise StorageError(
                f"{self.address} does not answer: {words}; check the address, whether the server "
                "runs (pyroshock serve), and the network"
            ) from error
        raise StorageError(
            f"{self.address} was lost while {path} was asked: {words}; whether it was done is not "
            "known, and it is not asked again: look at what the store has, and at its jobs()"
        ) from error


def connect(address: str, token: str | None = None) -> ServerConnection:
    """The connection to a server, which is asked at once who it is.

    Parameters:
        address: "http://lab:8000", or "https://..."; the address that `pyroshock serve` printed may
            have its `?token=`.
        token: The token that the server was started with; by default that of the address, else the
            variable PYROSHOCK_TOKEN.

    Raises:
        InvalidValueError: For what is no address of a server, and a token that no header takes.
        StorageError: For a server that does not answer, is another program or admits nobody.
    """
    parts = urlsplit(address)
    shown = f"{parts.scheme}://{parts.netloc.rpartition('@')[2]}"
    try:
        port = parts.port
    except ValueError as error:
        raise InvalidValueError(f"{shown!r} is no address: {error}") from error
    if parts.scheme not in ("http", "https") or not parts.hostname or port == 0:
        raise InvalidValueError(f"{shown!r} is no address of a server, such as http://lab:8000")
    if parts.username is not None or parts.path not in ("", "/") or parts.fragment:
        raise InvalidValueError(
            f"{shown!r} has a name, a path or a mark beside it; expected http://HOST:PORT, and the "
            "token as token="
        )
    query = parse_qs(parts.query)
    if query.keys() - {"token"}:
        raise InvalidValueError(f"{shown!r} has a query; expected http://HOST:PORT")
    own_token = token or next(iter(query.get("token", ())), None) or os.environ.get(TOKEN_VARIABLE)
    if own_token is not None and not re.fullmatch(r"[\x21-\x7e]+", own_token.strip()):
        raise InvalidValueError("token has a character that no header takes; expected plain text")
    connection = ServerConnection(shown, None if own_token is None else own_token.strip())
    try:
        connection.read("/api/library")
    except BaseException:  # whatever ended it, is raised again
        connection.close()
        raise
    return connection


def part(name: object) -> str:
    """A name within a path, slashes included."""
    return quote(str(name), safe="")


def _faults(answer: Mapping[str, Any]) -> list[tuple[str, str]]:
    listed = answer.get("faults")
    if not isinstance(listed, list):
        return []
    return [
        (str(fault.get("field", "")), str(fault.get("message", "")))
        for fault in listed
        if isinstance(fault, dict)
    ]


def _words_of_loss(error: Exception) -> str:
    if isinstance(error, TimeoutError):
        return f"no answer within {ANSWER_S:g} s"
    if isinstance(error, socket.gaierror):
        return "no machine of this name is known"
    if isinstance(error, ConnectionRefusedError):
        return "nothing listens there"
    strerror = error.strerror if isinstance(error, OSError) else None
    return strerror or str(error) or type(error).__name__


def _proxy(address: str) -> str | None:
    """The address of the proxy that the environment names for a server."""
    parts = urlsplit(address)
    if proxy_bypass(parts.netloc):
        return None
    return getproxies().get(parts.scheme)


def _absolute(address: str) -> str:
    """What stands before a path: the whole address where a proxy reads it."""
    return address if address.startswith("http:") and _proxy(address) else ""


def _opened(address: str) -> http.client.HTTPConnection:
    parts, proxy = urlsplit(address), _proxy(address)
    host, port = parts.hostname or "", parts.port
    is_tls = parts.scheme == "https"
    via = urlsplit(proxy if "://" in proxy else f"http://{proxy}") if proxy else None
    place = (host, port) if via is None else (via.hostname or "", via.port)
    connection = (
        http.client.HTTPSConnection(*place, timeout=CONNECT_S, context=ssl.create_default_context())
        if is_tls
        else http.client.HTTPConnection(*place, timeout=CONNECT_S)
    )
    if via is not None and is_tls:
        connection.set_tunnel(host, port)
    connection.connect()
    assert connection.sock is not None
    connection.sock.settimeout(ANSWER_S)
    # An answer in two packets must not wait for a confirmation of the first.
    connection.sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return connection
