"""`pyroshock db export`: one campaign with all that belongs to it, as a store of its own in one file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from sqlalchemy import URL, Connection, func, select, text

from ..engine import StoreError, make_engine
from ..integrity.checking import checks, iter_findings
from ..listings import get_campaign_id
from ..loading import load
from ..provenance import Provenance
from ..rows import Progress, ProgressBar, TableDigest, Values, iter_batches
from ..session import Store
from ..tables import metadata
from .copying import becoming_store, verify
from .merge_rules import WRITERS, members


def export_campaign(store: Store, campaign: str, out: Path, progress: Progress | None = None) -> dict[str, int]:
    """Write the campaign to the new file `out`, which appears when it is whole; rows by table.

    Raises `LookupError` for an unknown campaign, `StoreError` where `out` is there already or the campaign is damaged:
    nobody could import it.
    """
    if out.exists():
        raise StoreError(f"{out} is there already; name a new file")
    partial = out.with_name(out.name + ".part")
    partial.unlink(missing_ok=True)
    engine = make_engine(address_of(partial))
    try:
        with store.reading() as session, becoming_store(engine) as copy:
            key = get_campaign_id(session, campaign)
            origin = session.connection()
            _refuse_damaged(origin, campaign, key)
            rows = _carried(origin, copy, key, progress)
        engine.dispose()
        partial.rename(out)
    finally:
        engine.dispose()
        partial.unlink(missing_ok=True)
    return rows


def address_of(file: Path) -> str:
    """The address of the store in a file."""
    return URL.create("sqlite", database=str(file)).render_as_string()


def _refuse_damaged(origin: Connection, campaign: str, key: int) -> None:
    finding = next(iter_findings(origin, checks(of_a_campaign=True), key), None)
    if finding is not None:
        raise StoreError(f"campaign {campaign} is not whole: {finding}; pyroshock db check names all of it")


def _carried(origin: Connection, copy: Connection, campaign: int, progress: Progress | None) -> dict[str, int]:
    chosen = members(campaign)
    tables = [table for table in metadata.sorted_tables if table.name in chosen]
    counts = [origin.scalar(select(func.count()).select_from(t).where(chosen[t.name])) or 0 for t in tables]
    bar = ProgressBar(progress, 2 * sum(counts))
    copy.execute(text("PRAGMA defer_foreign_keys = ON"))  # who wrote the rows is known after them
    writers: set[int] = set()
    written = {}
    for table in tables:
        digest, at = TableDigest(), table.columns.keys().index("written_by_id")
        batches = digest.watch(iter_batches(origin, table, chosen[table.name]))
        load(copy, table, bar.watch(_noting(batches, at, writers), f"exporting {table.name}"))
        written[table] = digest
    source = metadata.tables[WRITERS]
    load(copy, source, iter_batches(origin, source, Provenance.id.in_(sorted(writers))))
    for table, digest in written.items():
        verify(copy, table, digest, bar)
    return {table.name: digest.rows for table, digest in written.items()} | {WRITERS: len(writers)}


def _noting(batches: Iterator[Sequence[Values]], at: int, seen: set[int]) -> Iterator[Sequence[Values]]:
    for batch in batches:
        seen.update(row[at] for row in batch)
        yield batch
