"""The identity provider, asked: where it sends browsers, and who has signed in there.

OpenID Connect Core 1.0, the authorization code flow (section 3.1) with PKCE (RFC 7636). Authlib
makes the requests and checks claims, joserfc signatures.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from ...operations.people.stored_identities import LONGEST_LOGIN, ProviderAccount
from .settings import SignOnSettings, is_safe_address

if TYPE_CHECKING:
    from collections.abc import Iterator

    from authlib.integrations.httpx_client import OAuth2Client
    from joserfc.jwk import KeySet

#: Signatures by a key pair alone. An algorithm with a shared secret would take the provider's
#: public key, which everybody has, for the secret (RFC 8725, 2.1), and "none" no key at all.
ALGORITHMS = ("RS256", "RS384", "RS512", "PS256", "PS384", "PS512", "ES256", "ES384", "ES512")
#: Seconds that the discovery document and the keys hold.
HOLDS_S = 3600.0
#: Seconds until the keys are asked for again because of a token with a key that is not among them.
KEYS_AGAIN_S = 60.0
#: Seconds that the provider has for an answer, and bytes of a document.
PATIENCE_S, MOST_BYTES = 10.0, 1_000_000
#: Seconds by which the clocks of the two may differ.
CLOCKS_S = 60
#: Of groups, more names no provider that is asked for them alone.
_MOST_GROUPS, _LONGEST = 5_000, 255
_ENDPOINTS = ("authorization_endpoint", "token_endpoint", "jwks_uri")


class ProviderError(ValueError):
    """The provider cannot be asked, or has said what cannot be believed. `is_a_refusal`: it was
    asked about this sign-in, and nobody comes in for it; the next attempts wait."""

    def __init__(self, message: str, *, is_a_refusal: bool = False) -> None:
        super().__init__(message)
        self.is_a_refusal = is_a_refusal


class IdentityProvider:
    """One provider. For use from several threads. `clock` gives seconds that only grow."""

    def __init__(
        self, settings: SignOnSettings, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.settings, self._clock = settings, clock
        self._lock = threading.Lock()
        self._document: dict[str, Any] = {}
        self._keys: dict[str, Any] = {}
        self._document_until = self._keys_until = self._keys_again_from = float("-inf")

    def authorization_address(self, state: str, nonce: str, verifier: str) -> str:
        """Where a browser goes to sign in. Raises `ProviderError`."""
        document = self._discovered()
        with self._client() as client:
            address, _ = client.create_authorization_url(
                document["authorization_endpoint"], state=state, code_verifier=verifier, nonce=nonce
            )
        return str(address)

    def account_of(self, code: str, nonce: str, verifier: str) -> ProviderAccount:
        """Who has signed in, by the code that the browser brings back. Raises `ProviderError`."""
        document = self._discovered()
        with self._client(document) as client, _in_words("refuses the sign-in"):
            token = client.fetch_token(
                document["token_endpoint"],
                grant_type="authorization_code",
                code=code,
                code_verifier=verifier,
            )
            claims = self._claims(token, nonce)
            if self.settings.login_claim not in claims and "userinfo_endpoint" in document:
                claims = {**self._user_info(client, document, claims["sub"]), **claims}
        return self._account(claims)

    def _account(self, claims: Mapping[str, Any]) -> ProviderAccount:
        name = self.settings.login_claim
        login, subject = claims.get(name), claims["sub"]
        if not isinstance(login, str) or not login.strip():
            raise ProviderError(f"the identity provider says no {name} of this account")
        if len(login) > LONGEST_LOGIN or not login.isprintable():
            raise ProviderError(f"the {name} of this account is too long, or no text")
        if name == "email" and not _is_verified(claims):
            raise ProviderError(
                f"the identity provider has not verified the address {login!r}; whoever enters it "
                "there would be let in as its owner"
            )
        if not isinstance(subject, str) or not 0 < len(subject) <= _LONGEST:
            raise ProviderError("the identity provider names no account (sub)")
        return ProviderAccount(self.settings.issuer, subject, login.strip(), self._groups(claims))

    def _groups(self, claims: Mapping[str, Any]) -> tuple[str, ...]:
        """Of a path of names with dots between them, as in `realm_access.roles`; or under the
        whole name."""
        path = self.settings.groups_claim
        groups: Any = claims.get(path)
        if groups is None:
            groups = claims
            for part in path.split("."):
                groups = groups.get(part) if isinstance(groups, Mapping) else None
        if isinstance(groups, str):
            return (groups,)
        if not isinstance(groups, list) or len(groups) > _MOST_GROUPS:
            return ()
        return tuple(group for group in groups if isinstance(group, str))

    def _claims(self, token: Mapping[str, Any], nonce: str) -> dict[str, Any]:
        """What the ID token says, once signature, issuer, audience, time and nonce are right."""
        from authlib.oidc.core import CodeIDToken
        from joserfc import jwt
        from joserfc.errors import InvalidKeyIdError

        text = token.get("id_token")
        if not isinstance(text, str):
            raise ProviderError("the identity provider has given no ID token")
        try:
            read = jwt.decode(text, self._key_set(), algorithms=ALGORITHMS)
        except InvalidKeyIdError:  # the provider has changed its keys, perhaps
            read = jwt.decode(text, self._key_set(renewed=True), algorithms=ALGORITHMS)
        claims = CodeIDToken(
            read.claims,
            read.header,
            {
                "iss": {"essential": True, "value": self.settings.issuer},
                "aud": {"essential": True, "value": self.settings.client_id},
                "nonce": {"essential": True, "value": nonce},
            },
            {
                "nonce": nonce,
                "client_id": self.settings.client_id,
                "access_token": token.get("access_token"),
            },
        )
        claims.validate(leeway=CLOCKS_S)
        return dict(claims)

    def _user_info(
        self, client: OAuth2Client, document: Mapping[str, Any], subject: str
    ) -> dict[str, Any]:
        """What the provider says beside the ID token, of the same account (section 5.3.2)."""
        answer = client.get(document["userinfo_endpoint"])
        answer.raise_for_status()
        info = _as_object(answer.content)
        if info.get("sub") != subject:
            raise ProviderError("the identity provider tells of another account than the token's")
        return info

    def _discovered(self) -> dict[str, Any]:
        """The discovery document, which holds for an hour (OpenID Connect Discovery 1.0)."""
        with self._lock:
            if self._clock() >= self._document_until:
                address = self.settings.issuer.rstrip("/") + "/.well-known/openid-configuration"
                document = self._fetched(address)
                self._check_document(document)
                self._document, self._document_until = document, self._clock() + HOLDS_S
                self._keys_until = float("-inf")
            return self._document

    def _check_document(self, document: Mapping[str, Any]) -> None:
        if document.get("issuer") != self.settings.issuer:
            raise ProviderError(
                f"the identity provider calls itself {document.get('issuer')!r} and not "
                f"{self.settings.issuer!r}; --sso-issuer must be the same, letter for letter"
            )
        for name in (*_ENDPOINTS, "userinfo_endpoint"):
            address = document.get(name)
            if address is None and name == "userinfo_endpoint":
                continue
            if not isinstance(address, str) or not is_safe_address(address):
                raise ProviderError(
                    f"the identity provider gives {address!r} as its {name}; expected an address "
                    "of https"
                )

    def _key_set(self, *, renewed: bool = False) -> KeySet:
        from joserfc.jwk import KeySet

        document = self._discovered()
        with self._lock:
            now = self._clock()
            if now >= self._keys_until or (renewed and now >= self._keys_again_from):
                self._keys = self._fetched(document["jwks_uri"])
                self._keys_until, self._keys_again_from = now + HOLDS_S, now + KEYS_AGAIN_S
            keys = self._keys
        # Keys for other uses, and of kinds that we do not know, may stand beside.
        usable = [
            key
            for key in keys.get("keys", ())
            if isinstance(key, dict)
            and key.get("kty") in ("RSA", "EC")
            and key.get("use", "sig") == "sig"
        ]
        if not usable:
            raise ProviderError("the identity provider tells no key that signs its tokens")
        return KeySet.import_key_set({"keys": usable})

    def _client(self, document: Mapping[str, Any] | None = None) -> OAuth2Client:
        from authlib.integrations.httpx_client import OAuth2Client

        secret = self.settings.client_secret
        methods = (document or {}).get("token_endpoint_auth_methods_supported")
        method = "none" if secret is None else "client_secret_basic"
        if secret is not None and isinstance(methods, list) and method not in methods:
            method = "client_secret_post"
        return OAuth2Client(
            client_id=self.settings.client_id,
            client_secret=secret,
            token_endpoint_auth_method=method,
            scope=self.settings.scopes,
            redirect_uri=self.settings.redirect_address,
            code_challenge_method="S256",
            timeout=PATIENCE_S,
            follow_redirects=False,
        )

    def _fetched(self, address: str) -> dict[str, Any]:
        with self._client() as client, _in_words("cannot be asked"):
            with client.stream("GET", address, withhold_token=True) as answer:
                answer.raise_for_status()
                content = b""
                for part in answer.iter_bytes():
                    content += part
                    if len(content) > MOST_BYTES:
                        raise ProviderError(f"{address} is longer than {MOST_BYTES:,} bytes")
            return _as_object(content)


def _is_verified(claims: Mapping[str, Any]) -> bool:
    """Some providers write the truth value as a text."""
    verified = claims.get("email_verified")
    return verified is True or verified == "true"


def _as_object(content: bytes) -> dict[str, Any]:
    import json

    try:
        values = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise ProviderError(
            "the identity provider has answered something else than JSON"
        ) from error
    if not isinstance(values, dict):
        raise ProviderError("the identity provider has answered JSON that is no object")
    return values


@contextmanager
def _in_words(what: str) -> Iterator[None]:
    """Errors of the packages as one that names the provider. What the provider itself has written
    is not repeated, but for the name of an error of OAuth."""
    import httpx2
    from authlib.common.errors import AuthlibBaseError
    from joserfc.errors import JoseError

    try:
        yield
    except ProviderError:
        raise
    except AuthlibBaseError as error:
        raise ProviderError(
            f"the identity provider {what}: {_code(error.error)}", is_a_refusal=True
        ) from error
    except JoseError as error:
        raise ProviderError(
            f"the ID token of the identity provider is not to be believed: {_code(error.error)}",
            is_a_refusal=True,
        ) from error
    except (httpx2.HTTPError, httpx2.InvalidURL) as error:
        raise ProviderError(f"the identity provider {what}: {type(error).__name__}") from error
    # Of tokens and keys that are none, the packages raise these, too.
    except (ValueError, TypeError, KeyError) as error:
        raise ProviderError(
            f"the identity provider {what}: its answer cannot be read ({type(error).__name__})"
        ) from error


def _code(text: object) -> str:
    """The name of an error as RFC 6749 spells one."""
    word = str(text or "")
    return word if word.replace("_", "").isalnum() and len(word) <= 60 else "an unknown error"
