"""What `pyroshock serve` was told of the identity provider of the laboratory."""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import get_args
from urllib.parse import urlsplit

from ....schema.person_roles import PERSON_ROLES
from ...operations.people.stored_identities import Admission, AdmissionRules

#: Where a sign-in through the provider begins and where it comes back to; the provider must know
#: the second.
BEGIN, RETURN = "/sign-in/provider", "/sign-in/provider/return"
_HOST = re.compile(r"[A-Za-z0-9.-]+|\[[0-9a-fA-F:]+\]")


class SignOnSettingsError(ValueError):
    """Single sign-on cannot be set up so; the message says what to give."""


@dataclass(frozen=True)
class SignOnSettings:
    """`issuer`: the provider's own address, as its tokens name it. `public_address`: that of this
    server in the browsers of people. `login_claim`: what of a token is the login; `email` is
    believed only where the provider has verified it. `roles`: (group, role), of the groups that
    `groups_claim` lists.

    Raises `SignOnSettingsError`.
    """

    issuer: str
    client_id: str
    public_address: str
    client_secret: str | None = field(default=None, repr=False)
    login_claim: str = "preferred_username"
    groups_claim: str = "groups"
    roles: tuple[tuple[str, str], ...] = ()
    admits: Admission = "invited"
    name: str = "single sign-on"

    def __post_init__(self) -> None:
        _check_address("--sso-issuer", self.issuer)
        _check_address("--public-address", self.public_address)
        parts = urlsplit(self.public_address)
        if parts.path not in ("", "/") or parts.query or parts.fragment:
            raise SignOnSettingsError(
                f"--public-address {self.public_address!r} has a path; expected scheme and host "
                "alone, such as https://shock.example.org"
            )
        if not self.client_id:
            raise SignOnSettingsError(
                "--sso-client-id is empty; expected the name under which the provider knows this "
                "server"
            )
        for group, role in self.roles:
            if role not in PERSON_ROLES or not group:
                raise SignOnSettingsError(
                    f"--sso-role {group}={role!r} names no role; expected GROUP=ROLE with one of "
                    f"{', '.join(PERSON_ROLES)}"
                )
        if self.admits == "groups" and not self.roles:
            raise SignOnSettingsError(
                "--sso-admit groups adds people by their groups, and no group has a role; give "
                "--sso-role GROUP=ROLE"
            )
        if self.admits not in get_args(Admission):
            raise SignOnSettingsError(f"--sso-admit {self.admits!r} is unknown")

    @property
    def origin(self) -> str:
        """Scheme and host of this server, as browsers know it."""
        return self.public_address.rstrip("/")

    @property
    def redirect_address(self) -> str:
        """Where the provider sends browsers back to. It never follows from a request."""
        return self.origin + RETURN

    @property
    def rules(self) -> AdmissionRules:
        """Whom a sign-in adds, and with which role. Of a group that is named twice the role that
        may most holds."""
        roles: dict[str, str] = {}
        for group, role in self.roles:
            roles[group] = max(role, roles.get(group, role), key=PERSON_ROLES.index)
        return AdmissionRules(roles, self.admits)

    @property
    def scopes(self) -> str:
        """What the provider is asked to tell."""
        return "openid profile email"


def role_pairs(texts: Sequence[str]) -> tuple[tuple[str, str], ...]:
    """GROUP=ROLE of each text; a group may have = in its name, as those of LDAP do. Raises
    `SignOnSettingsError`."""
    pairs = []
    for text in texts:
        group, separator, role = text.rpartition("=")
        if not separator:
            raise SignOnSettingsError(f"--sso-role {text!r} has no =; expected GROUP=ROLE")
        pairs.append((group.strip(), role.strip()))
    return tuple(pairs)


def is_safe_address(address: str) -> bool:
    """Whether nobody between can read or change what goes there: https, or this machine."""
    try:
        parts = urlsplit(address)
        host, _ = parts.hostname, parts.port
    except ValueError:  # a port that is no number, a bracket that is not closed
        return False
    if host is None or parts.username is not None or parts.password is not None:
        return False
    if not _HOST.fullmatch(host) and not _is_ip(host):
        return False
    return parts.scheme == "https" or (parts.scheme == "http" and _is_this_machine(host))


def _check_address(option: str, address: str) -> None:
    if not is_safe_address(address):
        raise SignOnSettingsError(
            f"{option} {address!r} is no address that can be trusted; expected one of https, such "
            "as https://login.example.org, or of http on this machine"
        )


def _is_ip(host: str) -> bool:
    try:
        ipaddress.ip_address(host)
    except ValueError:  # a name of a host, or nothing at all
        return False
    return True


def _is_this_machine(host: str) -> bool:
    return host == "localhost" or (_is_ip(host) and ipaddress.ip_address(host).is_loopback)
