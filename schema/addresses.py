"""Addresses of stores and servers, and any other text, as they may be shown: without passwords and tokens.

Whatever leaves the software - a message, a log, a page, a row of provenance - goes through `address_for_display` or
`without_secrets`. Both find a secret by its place in the text, never by its value: a short password would else blank
out half of a sentence.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sqlalchemy import URL

#: What stands for a secret.
HIDDEN = "***"

#: `://user:password@`, to the last @ of the word, for a password may hold one; not `://host:5000/models/linear@3`.
_LOGIN = re.compile(r"(://[^\s/?#:@]*):(?!\d{1,5}/)\S*@")
#: `user:password@host/` without its scheme.
_BARE_LOGIN = re.compile(r"(?<![\w/])([\w.+-]+):[^\s:/@]+@(?=[\w.-]+[/:])")
#: `https://token@`, as code hosts take it; the user of a database is no secret.
_BEARER = re.compile(r"(https?://)[^\s/?#:@]+@")
#: `password=..` of a query string or of libpq's key=value form, quoted or not.
_PAIR = re.compile(
    r"(\b(?:\w*password|passwd|pwd|passphrase|token|secret)\s*=\s*)('(?:\\.|[^'\\])*'|\"[^\"]*\"|[^\s&;,'\"]+)", re.I
)


class AddressError(ValueError):
    """An address that is none; the message shows it without its secrets."""


def parse_address(address: str) -> URL:
    """The parts of a database's address. Raises `AddressError`."""
    from sqlalchemy import make_url
    from sqlalchemy.exc import ArgumentError

    try:
        url = make_url(address)
    except (ArgumentError, ValueError):  # the reason given may quote the password
        raise AddressError(f"unreadable address {address_for_display(address)!r}") from None
    if "@" in (url.host or ""):
        raise AddressError(
            f"unreadable address {address_for_display(address)!r}: write an @ within the password as %40"
        )
    return url


def address_for_display(address: str | URL) -> str:
    """An address for people, as typed where it holds no secret; an unreadable one keeps what follows its last @."""
    from sqlalchemy import make_url
    from sqlalchemy.exc import ArgumentError

    text = address if isinstance(address, str) else address.render_as_string(hide_password=True)
    if not text.startswith(("http://", "https://")):
        try:
            url = make_url(address)
            text = text if url.password is None else url.render_as_string(hide_password=True)
        except (ArgumentError, ValueError):
            if "://" not in text and "@" in text:
                text = f"{HIDDEN}@{text.rpartition('@')[2]}"
    return without_secrets(text)


def without_secrets(text: str) -> str:
    """A text with *** for the passwords of addresses and the values of `password=` and `token=` in it."""
    login = rf"\1:{HIDDEN}@"
    for pattern, replacement in (
        (_LOGIN, login),
        (_BARE_LOGIN, login),
        (_BEARER, rf"\1{HIDDEN}@"),
        (_PAIR, rf"\1{HIDDEN}"),
    ):
        text = pattern.sub(replacement, text)
    return text
