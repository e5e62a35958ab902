"""What `pyroshock serve` was told: where it listens, what it may read, how much it takes."""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import urlsplit

from ...schema.addresses import address_for_display
from .sign_on.settings import SignOnSettings

MEGABYTE = 1_000_000


class SettingsError(ValueError):
    """The server may not be started so; the message says what to give."""


@dataclass(frozen=True)
class Settings:
    """`folders`: those below which a campaign may be ingested by its path. `token`: what others
    must know. `works`: whether it does the jobs that it is asked for, or leaves them to workers
    (`pyroshock work`).

    `trusted_proxies`: addresses and networks whose `X-Forwarded-For` and `X-Forwarded-Proto` are
    believed.

    Raises `SettingsError` for an address that others can reach without a token, and for a token
    that can be guessed.
    """

    db: str = field(repr=False)
    host: str = "127.0.0.1"
    port: int = 8000
    token: str | None = field(default=None, repr=False)
    folders: tuple[Path, ...] = ()
    mlflow: str | None = None
    max_upload_bytes: int = 2_000 * MEGABYTE
    max_body_bytes: int = MEGABYTE
    works: bool = True
    trusted_proxies: tuple[str, ...] = ()
    #: Whether people sign in with a name and a password, also where there is no token.
    asks_people: bool = False
    #: The laboratory's identity provider, where people sign in through one.
    sign_on: SignOnSettings | None = None
    #: Whether users sign in with passwords, too.
    takes_passwords: bool = True

    def __post_init__(self) -> None:
        if not self.takes_passwords and self.sign_on is None:
            raise SettingsError(
                "--no-passwords lets in nobody without an identity provider; give --sso-issuer, "
                "--sso-client-id and --public-address"
            )
        if self.token is None and not self.lets_in_users and not is_loopback(self.host):
            raise SettingsError(
                f"--host {self.host} can be reached by others: give them a token to know, "
                "--token WORD or PYROSHOCK_TOKEN (16 characters or more), or let in users alone "
                "with --users"
            )
        if self.token is not None and len(self.token) < 16:
            raise SettingsError(
                f"a token of {len(self.token)} characters can be guessed; expected 16 or more"
            )
        if self.mlflow is not None and not self.mlflow.startswith(("http://", "https://")):
            raise SettingsError(
                f"--mlflow {address_for_display(self.mlflow)!r} is no address "
                f"of a page; expected http://HOST:PORT"
            )
        if self.mlflow is not None and address_for_display(self.mlflow) != self.mlflow:
            raise SettingsError(
                f"--mlflow {address_for_display(self.mlflow)!r}: every page "
                f"would show its password; leave it out"
            )
        for proxy in self.trusted_proxies:
            try:
                ipaddress.ip_network(proxy)
            except ValueError as error:
                raise SettingsError(
                    f"--trusted-proxy {proxy!r} is no address or network; "
                    f"expected one like 127.0.0.1 or 172.18.0.0/16"
                ) from error

    @property
    def lets_in_users(self) -> bool:
        """Whether people sign in as users, also where there is no token."""
        return self.asks_people or self.sign_on is not None

    @property
    def public_name(self) -> str | None:
        """The name of this server in the browsers of people, where it was told."""
        return None if self.sign_on is None else urlsplit(self.sign_on.public_address).hostname

    def is_trusted_proxy(self, host: str) -> bool:
        """Whether a connection from this address is one of a trusted proxy, which brings the
        requests of many."""
        try:
            address = ipaddress.ip_address(host)
        except ValueError:
            return False
        return any(address in ipaddress.ip_network(proxy) for proxy in self.trusted_proxies)


def is_loopback(host: str) -> bool:
    """Whether only this machine reaches an address."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False
