"""Addresses of stores and servers: what they mean, and how they and any other text may be shown,
without passwords and tokens.

Whatever leaves the software - a message, a log, a page, a row of provenance - goes through
`address_for_display` or `without_secrets`. Both find a secret by its place in the text, never by
its value: a short password would else blank out half of a sentence.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sqlalchemy import URL

#: What stands for a secret.
HIDDEN = "***"

#: `://user:password@`, to the last @ of the word, for a password may hold one; not
#: `://host:5000/models/linear@3`.
_LOGIN = re.compile(r"(://[^\s/?#:@]*):(?!\d{1,5}/)\S*@")
#: `user:password@host/` without its scheme.
_BARE_LOGIN = re.compile(r"(?<![\w/])([\w.+-]+):[^\s:/@]+@(?=[\w.-]+[/:])")
#: `https://token@`, as code hosts take it; the user of a database is no secret.
_BEARER = re.compile(r"(https?://)[^\s/?#:@]+@")
#: `password=..` of a query string or of libpq's key=value form, quoted or not.
_PAIR = re.compile(
    r"(\b(?:\w*password|passwd|pwd|passphrase|token|secret)\s*=\s*)('(?:\\.|[^'\\])*'|\"[^\"]*\"|"
    r"[^\s&;,'\"]+)",
    re.I,
)


#: `sqlite:///` and what SQLAlchemy adds as a driver's name; what follows is the path of a file,
#: sign for sign.
_SQLITE = re.compile(r"sqlite(?:\+\w+)?:", re.IGNORECASE)
#: Options of SQLite's own addresses and of Python's driver, as the last part of an address.
_SQLITE_OPTIONS = re.compile(
    r"\?(?:(?:mode|cache|uri|immutable|vfs|psow|nolock|modeof|timeout|isolation_level|"
    r"check_same_thread|detect_types|cached_statements)=[^/\\]*)$",
    re.IGNORECASE,
)
#: What begins so is a server's address or a list of settings, and no path; drives have one letter.
_NO_PATH = re.compile(r"\w{2,}(?:\+\w+)?:(?!\\)|\w+\s*=\s*\S")
_EXPECTED = "expected the path of a file, sqlite:///FILE.db or postgresql+psycopg://USER@HOST/NAME"


class AddressError(ValueError):
    """An address that is none; the message shows it without its secrets."""


def parse_store_address(address: str) -> URL:
    """The parts of a store's address.

    Parameters:
        address: A server's address, `sqlite:///FILE`, or the path of a file alone.

    Raises:
        AddressError: For an address that cannot be read, also for a store in memory, which would be
            gone when the command ends.
    """
    from sqlalchemy import URL

    file = sqlite_file(address)
    return parse_address(address) if file is None else URL.create("sqlite", database=file)


def sqlite_file(address: str) -> str | None:
    """The path of an SQLite store; None for what may be a server's address.

    Parameters:
        address: The address of a store. The path in it is taken sign for sign: `%20`, `?` and `#`
            belong to it.

    Raises:
        AddressError: As `parse_store_address`.
    """
    scheme = _SQLITE.match(address)
    if scheme is None:
        is_path = (
            "://" not in address
            and not _NO_PATH.match(address)
            and without_secrets(address) == address
        )
        return _file_path(address, address) if is_path else None
    path = address[scheme.end() :]
    if not path.startswith("///"):
        name = path.lstrip("/")
        cure = f"a file is written with three slashes: sqlite:///{name}" if name else _EXPECTED
        raise AddressError(
            f"{address!r} names no file, so that nothing stored in it would be kept; {cure}"
        )
    return _file_path(path.removeprefix("///"), address)


def _file_path(path: str, address: str) -> str:
    """`path` of an SQLite store. Raises `AddressError` for one in memory and for options behind the
    name."""
    if not path.strip() or path == ":memory:" or path.startswith("file:"):
        raise AddressError(
            f"{address!r} names no file, so that nothing stored in it would be kept; {_EXPECTED}"
        )
    if "\0" in path:
        raise AddressError(f"{address!r} holds a NUL character, which no path can; {_EXPECTED}")
    if option := _SQLITE_OPTIONS.search(path):
        raise AddressError(
            f"{address!r} has the options {option.group()!r}, which the software does not take; "
            f"leave them out: {address.removesuffix(option.group())}"
        )
    return path


def parse_address(address: str) -> URL:
    """The parts of a database's address.

    Parameters:
        address: The address as SQLAlchemy spells it. An @ within its password is written as %40.

    Raises:
        AddressError: For an address that cannot be read; the message shows it without its password.
    """
    from sqlalchemy import make_url
    from sqlalchemy.exc import ArgumentError

    try:
        url = make_url(address)
    except (ArgumentError, ValueError):  # the reason given may quote the password
        raise AddressError(
            f"unreadable address {address_for_display(address)!r}; {_EXPECTED}"
        ) from None
    if "@" in (url.host or ""):
        raise AddressError(
            f"unreadable address {address_for_display(address)!r}: write an @ "
            f"within the password as %40"
        )
    return url


def address_for_display(address: str | URL) -> str:
    """An address for people, as typed where it holds no secret.

    Parameters:
        address: The address of a store or a server, as text or as SQLAlchemy parses it. An
            unreadable one keeps what follows its last @.
    """
    from sqlalchemy import make_url
    from sqlalchemy.exc import ArgumentError

    text = address if isinstance(address, str) else _rendered(address)
    if not text.startswith(("http://", "https://")):
        try:
            url = make_url(address)
            text = text if url.password is None else url.render_as_string(hide_password=True)
        except (ArgumentError, ValueError):
            if "://" not in text and "@" in text:
                text = f"{HIDDEN}@{text.rpartition('@')[2]}"
    return without_secrets(text)


def _rendered(url: URL) -> str:
    """As it can be given again: SQLAlchemy would write the signs of a path as %20."""
    if url.get_backend_name() == "sqlite" and url.database:
        return f"sqlite:///{url.database}"
    return url.render_as_string(hide_password=True)


def without_secrets(text: str) -> str:
    """A text with `***` for the passwords of addresses and the values of `password=` and `token=`
    in it.

    Parameters:
        text: Any text, such as a message or an address.
    """
    login = rf"\1:{HIDDEN}@"
    for pattern, replacement in (
        (_LOGIN, login),
        (_BARE_LOGIN, login),
        (_BEARER, rf"\1{HIDDEN}@"),
        (_PAIR, rf"\1{HIDDEN}"),
    ):
        text = pattern.sub(replacement, text)
    return text
