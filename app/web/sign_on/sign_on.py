"""A sign-in through the identity provider: begun here, finished with what the browser brings back.

What a sign-in needs when it comes back (state, nonce, the verifier of PKCE, the page that was asked
for) lies in a cookie of the browser, signed by this process: whoever begins many sign-ins takes no
room here, and no other browser can finish one.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import hmac
import json
import secrets
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ...operations.people.stored_identities import ProviderAccount
from .provider import IdentityProvider, ProviderError
from .settings import BEGIN, SignOnSettings

#: The cookie. A page of elsewhere leads back here, so that it is lax and not strict.
COOKIE = "pyroshock_sign_on"
#: Seconds for the person to sign in at the provider.
LASTS_S = 600
#: Sign-ins that were finished and are not taken twice; the browser's cookie ends before.
_FINISHED = 10_000
#: An address that is longer is not kept; the first page opens in its place.
_LONGEST_ADDRESS = 1_500
#: A text of a provider: codes and states of some have 2,000 characters.
_LONGEST_CODE = 4_000


@dataclass(frozen=True)
class BegunSignIn:
    """Where the browser goes, and the cookie that it keeps until it comes back."""

    address: str
    cookie: str


class SignOn:
    """The sign-ins through one provider. For use from several threads. `clock` gives seconds that
    only grow."""

    def __init__(
        self,
        settings: SignOnSettings,
        provider: IdentityProvider | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.settings = settings
        self.provider = provider or IdentityProvider(settings)
        self._clock, self._key = clock, secrets.token_bytes(32)
        self._lock = threading.Lock()
        self._finished: OrderedDict[str, None] = OrderedDict()

    def begin(self, address: str) -> BegunSignIn:
        """Begin a sign-in after which the page at `address` opens, which is one of this server.
        Raises `ProviderError`."""
        state, nonce, verifier = (secrets.token_urlsafe(32) for _ in range(3))
        there = self.provider.authorization_address(state, nonce, verifier)
        values = {
            "state": state,
            "nonce": nonce,
            "verifier": verifier,
            "address": address if len(address) <= _LONGEST_ADDRESS else "/",
            "until": self._clock() + LASTS_S,
        }
        text = base64.urlsafe_b64encode(json.dumps(values).encode()).decode()
        return BegunSignIn(there, f"{text}.{self._signature(text)}")

    def finish(self, cookie: str, query: Mapping[str, str]) -> tuple[ProviderAccount, str]:
        """Who has signed in, and the address of the page that was asked for.

        Parameters:
            cookie: What `begin` gave the browser; empty where it brings none.
            query: What the provider sends back with the browser: `state`, `code` or `error`.

        Raises:
            ProviderError: For a sign-in that this browser has not begun, that took too long or was
                finished already, and for all that the provider refuses or cannot prove.
        """
        begun = self._begun(cookie)
        state = query.get("state", "")
        if not hmac.compare_digest(state.encode(), begun["state"].encode()):
            raise ProviderError(
                "this sign-in was not begun by this browser, or by another page of it since; sign "
                "in again"
            )
        with self._lock:
            if state in self._finished:
                raise ProviderError("this sign-in was used already; sign in again")
            while len(self._finished) >= _FINISHED:
                self._finished.popitem(last=False)
            self._finished[state] = None
        issuer = query.get("iss")
        if issuer is not None and issuer != self.settings.issuer:  # RFC 9207
            raise ProviderError("another identity provider than that of this laboratory answered")
        if "error" in query:
            raise ProviderError(
                "the identity provider has let nobody in"
                + (": access was denied" if query["error"] == "access_denied" else "")
            )
        code = query.get("code", "")
        if not 0 < len(code) <= _LONGEST_CODE:
            raise ProviderError("the identity provider has sent no code; sign in again")
        account = self.provider.account_of(code, begun["nonce"], begun["verifier"])
        return account, begun["address"]

    def cookie_header(self, value: str) -> str:
        """The header's text for the cookie of a sign-in; an empty value takes it away."""
        secure = "; Secure" if self.settings.origin.startswith("https:") else ""
        age = LASTS_S if value else 0
        return f"{COOKIE}={value}; HttpOnly; Path={BEGIN}; SameSite=lax; Max-Age={age}{secure}"

    def _begun(self, cookie: str) -> dict[str, str]:
        text, _, signature = cookie.partition(".")
        if not text or not hmac.compare_digest(signature.encode(), self._signature(text).encode()):
            raise ProviderError("this browser has begun no sign-in here; sign in again")
        try:
            begun: dict[str, str] = json.loads(base64.urlsafe_b64decode(text))
        except (ValueError, binascii.Error) as error:
            raise ProviderError("this browser has begun no sign-in here; sign in again") from error
        if self._clock() > float(begun["until"]):
            raise ProviderError(
                f"this sign-in has taken more than {LASTS_S // 60} minutes; sign in again"
            )
        return begun

    def _signature(self, text: str) -> str:
        return hmac.new(self._key, text.encode(), hashlib.sha256).hexdigest()
