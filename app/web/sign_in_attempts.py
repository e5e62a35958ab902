"""Wrong tokens, counted by the address that they come from: each one makes the next wait longer,
and ten lock it.

While an address waits, no token from it is looked at, the right one included: whoever guesses
learns nothing meanwhile. Sessions that are open already go on. OWASP, Authentication Cheat Sheet,
"Account Lockout".
"""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass

from .client_address import client_network

#: Wrong tokens that cost nothing: a person mistypes.
FREE = 2
#: From this count on, an address is locked.
LOCKED_FROM = 10
LOCK_S = 15 * 60.0
#: An address that has sent no wrong token for so long begins anew.
FORGOTTEN_AFTER_S = 24 * 3600.0
#: Addresses that are remembered. Beyond, those with the oldest failure go, locked ones last.
ADDRESSES = 10_000


@dataclass
class _Failures:
    count: int
    last: float


class SignInAttempts:
    """The wrong tokens of each address. `clock` gives seconds that only grow."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._failures: OrderedDict[str, _Failures] = OrderedDict()

    def __len__(self) -> int:
        return len(self._failures)

    def wait_s(self, host: str | None) -> float:
        """Seconds until a token from this address is looked at; 0 for now."""
        failures = self._failures.get(client_network(host))
        return (
            0.0
            if failures is None
            else max(0.0, failures.last + _pause_s(failures.count) - self._clock())
        )

    def failed(self, host: str | None) -> None:
        """A wrong token came from this address."""
        network, now = client_network(host), self._clock()
        before = self._failures.pop(network, None)
        count = 0 if before is None or now - before.last > FORGOTTEN_AFTER_S else before.count
        if len(self._failures) >= ADDRESSES:
            unlocked = (
                name for name, failures in self._failures.items() if failures.count < LOCKED_FROM
            )
            del self._failures[next(unlocked, next(iter(self._failures)))]
        self._failures[network] = _Failures(count + 1, now)

    def succeeded(self, host: str | None) -> None:
        """The right token came from this address, which begins anew."""
        self._failures.pop(client_network(host), None)


def _pause_s(count: int) -> float:
    """Seconds after the last of `count` wrong tokens: 0, 0, 1, 2, 4, ... and the lock from the
    tenth on."""
    if count <= FREE:
        return 0.0
    return LOCK_S if count >= LOCKED_FROM else 2.0 ** (count - FREE - 1)
