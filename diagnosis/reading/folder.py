"""A campaign folder as a record, by an ingest into a store that is gone afterwards."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

from ...schema.session import Store, Writer, make_engine, open_store
from ..record import CampaignRecord
from .campaign import read_campaign

#: Folders above this are ingested into a file of a temporary folder, not into memory.
IN_MEMORY_BYTES = 256 * 2**20
_WRITER = Writer("diagnose", "temporary")


def read_folder(path: Path) -> CampaignRecord:
    """The campaign in the folder `path`, as `read_campaign` gives it. Leaves nothing behind.

    Raises `IngestError` for a folder that the ingest refuses.
    """
    from ...ingest.load import ingest_folder

    path = Path(path)
    sizes = (file.stat().st_size for file in path.rglob("*") if file.is_file()) if path.is_dir() else ()
    large = sum(sizes) > IN_MEMORY_BYTES
    with _temporary_store(in_file=large) as store:
        report = ingest_folder(store, path, jobs=None if large else 1)
        with store.reading() as session:
            return read_campaign(session, report.campaign)


@contextmanager
def _temporary_store(*, in_file: bool) -> Iterator[Store]:
    """In memory one engine serves all folders of a thread: its statements are compiled once, and each begins anew."""
    if in_file:
        with (
            tempfile.TemporaryDirectory(prefix="pyroshock-") as folder,
            open_store(f"sqlite:///{folder}/campaign.db", _WRITER, create=True) as store,
        ):
            yield store
        return
    engine = _engine(os.getpid())
    try:
        _connection(engine).deserialize(_empty())
        yield Store(engine, _WRITER)
    finally:
        _connection(engine).deserialize(_empty())


@cache
def _engine(_process: int) -> Any:
    """Of a process; a forked one must not share its parent's."""
    return make_engine("sqlite:///:memory:")


@cache
def _empty() -> bytes:
    """An empty store with its materials, as SQLite's own bytes."""
    from ...schema.seed import seed_materials
    from ...schema.tables import metadata

    engine = make_engine("sqlite:///:memory:")
    metadata.create_all(engine)
    seed_materials(Store(engine, _WRITER))
    content: bytes = _connection(engine).serialize()
    engine.dispose()
    return content


def _connection(engine: Any) -> Any:
    """SQLite's own connection of this thread, which the pool keeps for as long as the thread lives."""
    with engine.connect() as connection:
        return connection.connection.driver_connection
