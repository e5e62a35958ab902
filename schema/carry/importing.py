"""`pyroshock db import`: the campaigns of a file into the store, all or nothing, and nothing twice."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from sqlalchemy import Connection, func, select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from ..campaigns import Campaign
from ..care.progress import Progress
from ..engine import first_line
from ..materials import Material, MaterialAlias
from ..removal.returning import settle_imported
from ..session import Store
from ..tables import metadata
from .campaign_rows import STAY_BEHIND
from .merge_rules import RULES
from .merging import Merge, MergeRefusedError
from .opened_export import ForeignFileError, opened_file


@dataclass(frozen=True)
class ImportReport:
    """The campaigns of the file, the rows that were new by table, what of the file no import takes, and recordings that
    were discarded here and came back with it."""

    campaigns: tuple[str, ...]
    added: dict[str, int]
    left_behind: tuple[str, ...]
    discarded: tuple[str, ...] = ()


def import_file(store: Store, file: Path, progress: Progress | None = None) -> ImportReport:
    """Merge the campaigns of `file` into the store, in one transaction.

    Raises `ForeignFileError` for a file that does not pass its checks, `MergeRefusedError` where the store holds
    another thing under the same name; nothing is changed then.
    """
    with opened_file(file, progress) as origin:
        campaigns = tuple(origin.scalars(select(Campaign.name).order_by(Campaign.name)))
        try:
            added, discarded = store.write(lambda session: _merged(store, session, origin), idempotent=True)
        except IntegrityError as error:
            raise ForeignFileError(f"{file} is refused by a rule of the store: {first_line(error)}") from error
        return ImportReport(campaigns, added, tuple(_left_behind(origin)), tuple(discarded))


def _merged(store: Store, session: Session, origin: Connection) -> tuple[dict[str, int], list[str]]:
    added = merge(store, session, origin)
    return added, settle_imported(session, store.written_by(session)) if added else []


def merge(store: Store, session: Session, origin: Connection) -> dict[str, int]:
    """Merge a file that has passed its checks, within the transaction of `session`; new rows by table."""
    target = session.connection()
    _refuse_aliases(origin, target)
    merged = Merge(origin, target)
    for rule in RULES:
        merged.take(rule)
    if merged.added:
        store.written_by(session)  # of the rows, their own writers tell; this one, of the import
    return dict(merged.added)


def _refuse_aliases(origin: Connection, target: Connection) -> None:
    """A material that has another's name here: which of the two a table means would depend on who reads it."""
    query = select(MaterialAlias.alias, Material.name).join(Material, MaterialAlias.material_id == Material.id)
    aliases = {alias.lower(): name for alias, name in target.execute(query)}
    for name in origin.scalars(select(Material.name)):
        other = aliases.get(name.lower())
        if other not in (None, name):
            raise MergeRefusedError(
                f"material {name!r} of the file is another name of {other!r} in this store; one of them needs another"
            )


def _left_behind(origin: Connection) -> list[str]:
    counts = {
        name: origin.scalar(select(func.count()).select_from(metadata.tables[name])) for name in sorted(STAY_BEHIND)
    }
    return [f"{count} rows of {name}" for name, count in counts.items() if count]
