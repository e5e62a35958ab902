"""Whom a connection is counted for: an address of IPv4, and the /64 of one of IPv6, which one
machine has whole."""

from __future__ import annotations

import ipaddress

#: Of a connection without an address (a Unix socket); all of these are counted together.
UNKNOWN = "unknown"


def client_network(host: str | None) -> str:
    """The address or network as text: "192.0.2.7" for that address and for ::ffff:192.0.2.7,
    "2001:db8::/64" for all of that network. A text that is no address stands for itself, cut to 64
    characters."""
    if not host:
        return UNKNOWN
    try:
        address = ipaddress.ip_address(host.strip("[]").partition("%")[0])
    except ValueError:
        return host[:64]
    if isinstance(address, ipaddress.IPv4Address):
        return str(address)
    if address.ipv4_mapped is not None:
        return str(address.ipv4_mapped)
    return str(ipaddress.ip_network((address, 64), strict=False))
