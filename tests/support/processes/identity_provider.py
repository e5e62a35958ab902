"""A small identity provider on this machine, over real HTTP: discovery, keys, the page that signs a
person in, and the endpoint of tokens (OpenID Connect Core 1.0, section 3.1).

Its tokens are made by PyJWT and its keys by cryptography, so that what checks them is held against
other software than its own. It looks at PKCE, at the secret of its client and at each code once.
What a test wants to be wrong it changes: `claims`, `header`, `make_token`, `document`, `keys`.
"""

from __future__ import annotations

import base64
import hashlib
import json
import secrets
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from html import escape
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qsl, urlencode, urlsplit
from urllib.request import HTTPRedirectHandler, Request, build_opener

import jwt
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat

CLIENT, SECRET = "pyroshock-lab", "a secret of: the two/both"


class SigningKey:
    """A key pair with its name."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.private = rsa.generate_private_key(public_exponent=65537, key_size=2048)

    @property
    def public_pem(self) -> bytes:
        return self.private.public_key().public_bytes(
            Encoding.PEM, PublicFormat.SubjectPublicKeyInfo
        )

    def public(self) -> dict[str, Any]:
        """As the provider tells it (RFC 7517)."""
        numbers = self.private.public_key().public_numbers()
        return {
            "kty": "RSA",
            "use": "sig",
            "alg": "RS256",
            "kid": self.name,
            "n": _base64(numbers.n.to_bytes(256, "big")),
            "e": _base64(numbers.e.to_bytes(3, "big")),
        }


class TestProvider:
    """The provider; `issuer` is its address. `person` has signed in there."""

    __test__ = False

    def __init__(self, issuer: str) -> None:
        self.issuer = issuer
        self.key, self.stranger_key = SigningKey("first"), SigningKey("stranger")
        self.keys = [self.key]
        self.person: dict[str, Any] = {"sub": "7", "preferred_username": "anna"}
        self.user_info: dict[str, Any] | None = None
        #: What a test wants to be otherwise in the next token: None takes a claim away.
        self.claims: dict[str, Any] = {}
        self.header: dict[str, Any] = {}
        self.make_token: Callable[[dict[str, Any]], str] = self._signed
        self.document: dict[str, Any] = {}
        self.error = ""
        self.public_client = False
        #: Whether a person goes on by a link of a page, as after typing a password there.
        self.shows_page = False
        #: The paths that were asked for.
        self.asked: list[str] = []
        self._begun: dict[str, dict[str, str]] = {}
        self._access: dict[str, str] = {}

    def reset(self) -> None:
        """As it was made, but for its keys."""
        key, stranger_key = self.key, self.stranger_key
        self.__init__(self.issuer)  # type: ignore[misc]
        self.key, self.stranger_key, self.keys = key, stranger_key, [key]

    def discovery(self) -> dict[str, Any]:
        """The document of section 4 of OpenID Connect Discovery 1.0."""
        info = {} if self.user_info is None else {"userinfo_endpoint": f"{self.issuer}/info"}
        return {
            "issuer": self.issuer,
            "authorization_endpoint": f"{self.issuer}/authorize",
            "token_endpoint": f"{self.issuer}/token",
            "jwks_uri": f"{self.issuer}/keys",
            "response_types_supported": ["code"],
            "subject_types_supported": ["public"],
            # Also what must not be taken.
            "id_token_signing_alg_values_supported": ["RS256", "HS256", "none"],
            **info,
            **self.document,
        }

    def authorize(self, query: dict[str, str]) -> str:
        """Where the browser goes once the person has signed in."""
        assert query["response_type"] == "code" and "openid" in query["scope"].split()
        assert query["client_id"] == CLIENT and query["code_challenge_method"] == "S256"
        back = {"state": query["state"], "iss": self.issuer}
        if self.error:
            return f"{query['redirect_uri']}?{urlencode({**back, 'error': self.error})}"
        code = secrets.token_urlsafe(16)
        self._begun[code] = query
        return f"{query['redirect_uri']}?{urlencode({**back, 'code': code})}"

    def token(self, form: dict[str, str], authorization: str) -> tuple[int, dict[str, Any]]:
        """The answer to who brings a code: once, with the verifier of its challenge, to the address
        that it was asked for with."""
        if not self.public_client:
            words = base64.b64decode(authorization.removeprefix("Basic ")).decode()
            name, _, secret = words.partition(":")
            if (_unquoted(name), _unquoted(secret)) != (CLIENT, SECRET):
                return 401, {"error": "invalid_client"}
        begun = self._begun.pop(form.get("code", ""), None)
        if begun is None or form.get("redirect_uri") != begun["redirect_uri"]:
            return 400, {"error": "invalid_grant"}
        challenge = _base64(hashlib.sha256(form.get("code_verifier", "").encode()).digest())
        if challenge != begun["code_challenge"]:
            return 400, {"error": "invalid_grant"}
        now = int(time.time())
        claims = {
            "iss": self.issuer,
            "aud": CLIENT,
            "iat": now,
            "exp": now + 300,
            "nonce": begun["nonce"],
            **self.person,
            **self.claims,
        }
        claims = {name: value for name, value in claims.items() if value is not None}
        access = secrets.token_urlsafe(16)
        self._access[access] = self.person["sub"]
        return 200, {
            "access_token": access,
            "token_type": "Bearer",
            "expires_in": 300,
            "id_token": self.make_token(claims),
        }

    def info(self, authorization: str) -> tuple[int, dict[str, Any]]:
        """What is said of the person beside the token."""
        subject = self._access.get(authorization.removeprefix("Bearer "))
        if subject is None or self.user_info is None:
            return 401, {"error": "invalid_token"}
        return 200, {"sub": subject, **self.user_info}

    def _signed(self, claims: dict[str, Any]) -> str:
        key = self.keys[0]
        header = {"kid": key.name, **self.header}
        return jwt.encode(claims, key.private, algorithm="RS256", headers=header)

    # --- tokens that are none

    def signed_by_stranger(self, claims: dict[str, Any]) -> str:
        """By a key that the provider does not have, under the name of one that it has."""
        return jwt.encode(
            claims, self.stranger_key.private, algorithm="RS256", headers={"kid": self.key.name}
        )

    def signed_by_unknown(self, claims: dict[str, Any]) -> str:
        """By a key with a name that the provider does not tell."""
        return jwt.encode(
            claims, self.stranger_key.private, algorithm="RS256", headers={"kid": "stranger"}
        )

    def unsigned(self, claims: dict[str, Any]) -> str:
        """With the algorithm "none"."""
        return jwt.encode(claims, None, algorithm="none", headers={"kid": self.key.name})

    def signed_with_public_key(self, claims: dict[str, Any]) -> str:
        """By HS256, with the public key for the secret (RFC 8725, 2.1); PyJWT refuses to make
        it."""
        import hmac

        header = {"alg": "HS256", "typ": "JWT", "kid": self.key.name}
        parts = [_base64(json.dumps(part).encode()) for part in (header, claims)]
        text = ".".join(parts)
        digest = hmac.new(self.key.public_pem, text.encode(), hashlib.sha256).digest()
        return f"{text}.{_base64(digest)}"

    def with_own_key(self, claims: dict[str, Any]) -> str:
        """By a stranger's key, which the head of the token brings along (RFC 8725, 3.10)."""
        header = {"jwk": self.stranger_key.public(), "kid": "stranger"}
        return jwt.encode(claims, self.stranger_key.private, algorithm="RS256", headers=header)

    def changed_afterwards(self, claims: dict[str, Any]) -> str:
        """With the signature of other claims."""
        head, _, signature = self._signed({**claims, "sub": "nobody"}).split(".")
        return f"{head}.{_base64(json.dumps(claims).encode())}.{signature}"


@contextmanager
def running_provider(name: str = "127.0.0.1") -> Iterator[TestProvider]:
    """A provider that answers on a free port until the block ends, under this name of the
    machine."""

    class Handler(BaseHTTPRequestHandler):
        def log_message(self, *_: Any) -> None:
            """Nothing: the tests' own output is enough."""

        def do_GET(self) -> None:
            parts = urlsplit(self.path)
            provider.asked.append(parts.path)
            if parts.path == "/.well-known/openid-configuration":
                self._answer(200, provider.discovery())
            elif parts.path == "/keys":
                self._answer(200, {"keys": [key.public() for key in provider.keys]})
            elif parts.path == "/info":
                self._answer(*provider.info(self.headers.get("authorization", "")))
            elif parts.path == "/authorize" and provider.shows_page:
                address = escape(provider.authorize(dict(parse_qsl(parts.query))))
                content = f'<!doctype html><title>x</title><a id="go" href="{address}">Go</a>'
                self._send(200, content.encode(), "text/html")
            elif parts.path == "/authorize":
                self.send_response(302)
                self.send_header("location", provider.authorize(dict(parse_qsl(parts.query))))
                self.end_headers()
            else:
                self._answer(404, {})

        def do_POST(self) -> None:
            provider.asked.append(self.path)
            body = self.rfile.read(int(self.headers["content-length"])).decode()
            form = dict(parse_qsl(body))
            self._answer(*provider.token(form, self.headers.get("authorization", "")))

        def _answer(self, status: int, values: dict[str, Any]) -> None:
            self._send(status, json.dumps(values).encode(), "application/json")

        def _send(self, status: int, content: bytes, kind: str) -> None:
            self.send_response(status)
            self.send_header("content-type", kind)
            self.send_header("content-length", str(len(content)))
            self.end_headers()
            self.wfile.write(content)

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    provider = TestProvider(f"http://{name}:{server.server_port}")
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield provider
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


class _Still(HTTPRedirectHandler):
    """A browser that does not go on by itself."""

    def redirect_request(self, *_: Any) -> None:
        return None


def sent_on(address: str) -> str:
    """Where a page of the provider sends the browser that asks for `address`."""
    from urllib.error import HTTPError

    try:
        build_opener(_Still).open(Request(address), timeout=10)
    except HTTPError as answer:
        with answer:
            assert answer.code == 302, answer.read()
            return str(answer.headers["location"])
    raise AssertionError(f"{address} leads nowhere")


def _base64(content: bytes) -> str:
    return base64.urlsafe_b64encode(content).rstrip(b"=").decode()


def _unquoted(text: str) -> str:
    from urllib.parse import unquote_plus

    return unquote_plus(text)
