"""`ps.open(...)`: the store at an address, of this machine, of a database, or behind a server."""

from __future__ import annotations

import os

from ...schema.addresses import address_for_display
from ...schema.session import Writer, open_store
from ..common.errors import raises_library_errors
from .experiment_store import ExperimentStore


@raises_library_errors
def open_experiment_store(
    address: str | os.PathLike[str], *, create: bool = True, token: str | None = None
) -> ExperimentStore:
    """The store at an address.

    Parameters:
        address: "sqlite:///lab.db", "postgresql+psycopg://USER@HOST/NAME", the path of an SQLite
            file, or "http://lab:8000", at which `pyroshock serve` answers.
        create: Whether an SQLite file that does not exist is made.
        token: The token of a server; by default the variable PYROSHOCK_TOKEN.

    Raises:
        StorageError: Where the store cannot be opened, and for a server that does not answer or
            does not admit who asks.
        InvalidValueError: For what is no address.
    """
    from ... import __version__

    url = os.fspath(address)
    if url.startswith(("http://", "https://")):
        from .remote_store import open_remote_store  # a store of this machine needs no HTTP

        return open_remote_store(url, token)
    if token is not None:
        raise ValueError(
            f"token is for a server, and {address_for_display(url)} is none; leave it out"
        )
    return ExperimentStore(open_store(url, Writer("python", __version__), create=create), url)
