"""`pyroshock db import`: the campaigns of a file into the store, all or nothing, and nothing twice.
What is there stays and may take on what the other laboratory knows further; what is new gets a key
of its own."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, Table, func, select, tuple_, update
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from ..access.append_only import replace_set_aside
from ..base import in_batches
from ..benches import Material, MaterialAlias
from ..campaign_counts import count_added
from ..campaigns import Campaign, PlannedRun
from ..engine import StoreError, first_line
from ..impacts import Impact, Pulse, Shot
from ..provenance import Provenance
from ..removal.returning import settle_imported
from ..row_hashes import ROW_SHA256, row_hash
from ..row_keys import reserve_keys
from ..rows import Progress, iter_batches, load, stored_columns
from ..session import Store
from ..tables import metadata
from .export import ForeignFileError, opened_file
from .merge_rules import RULES, STAY_BEHIND, WRITERS, MergeRule, Row

Writer = Callable[[], int]

_HITS = (Impact.__tablename__, Shot.__tablename__)


class Settled(Enum):
    """What became of a row whose key is here: nothing yet, it is `KNOWN`, or it was `REPLACED` by
    the better one."""

    NEW, OPEN, KNOWN, REPLACED = auto(), auto(), auto(), auto()


def _recording(target: Connection, row: Row, here: Row, writer: Writer) -> Settled:
    """A recording that one side set aside is the other's: a stored one counts."""
    if row["status"] != "stored":
        return Settled.KNOWN
    if here["status"] == "stored":
        return Settled.OPEN
    better = {name: row[name] for name in ("sha256", "size_bytes", "format", "status", "reason")}
    replace_set_aside(target, here["id"], {**better, "written_by_id": writer()})
    return Settled.REPLACED


def _planned_run(target: Connection, row: Row, here: Row, _: Writer) -> Settled:
    """What was still to do here and is done there is done."""
    if here["status"] == "planned" and row["status"] != "planned":
        values = {"status": row["status"], "reason": row["reason"]}
        target.execute(update(PlannedRun).where(PlannedRun.id == here["id"]).values(**values))
    return Settled.OPEN


def _linked(model: type[Impact] | type[Shot]) -> Callable[[Connection, Row, Row, Writer], Settled]:
    """A hit that nobody here has linked to its planned run is linked as there."""

    def settle(target: Connection, row: Row, here: Row, _: Writer) -> Settled:
        if here["planned_run_id"] is None and row["planned_run_id"] is not None:
            target.execute(
                update(model)
                .where(model.id == here["id"])
                .values(planned_run_id=row["planned_run_id"])
            )
        return Settled.OPEN

    return settle


#: Table -> what is done first for a row whose key is here.
SETTLED: dict[str, Callable[[Connection, Any, Row, Writer], Settled]] = {
    "recordings": _recording,
    "planned_runs": _planned_run,
    "impacts": _linked(Impact),
    "shots": _linked(Shot),
}


def leave_in_use(target: Connection, rows: list[dict[str, Any]]) -> None:
    """New versions of pulses do not push aside those that are in use here.

    Parameters:
        target: A connection to the store that takes the rows.
        rows: The new rows of pulses by column, of impacts of that store. `current` becomes false in
            place where another pulse of the impact is in use.
    """
    current_impacts = {row["impact_id"] for row in rows if row["current"]}
    used: set[int] = set()
    if current_impacts:  # at most a batch of them
        used = set(
            target.scalars(
                select(Pulse.impact_id).where(Pulse.impact_id.in_(current_impacts), Pulse.current)
            )
        )
    for row in rows:
        row["current"] = row["current"] and row["impact_id"] not in used


class MergeRefusedError(StoreError):
    """The store holds another thing under the same name; the message shows both."""


class Merge:
    """One merge of `origin` into `target`, within the transaction that is open there.

    `added` counts new rows by table, and `hits` new impacts and shots by table and the key of their
    campaign; `keys` leads from keys there to keys here, for every table that others point at.
    """

    def __init__(self, origin: Connection, target: Connection) -> None:
        self.added: Counter[str] = Counter()
        self.hits: Counter[tuple[str, int]] = Counter()
        self._origin = origin
        self._target = target
        self._keys: dict[str, dict[int, int]] = {}
        self._new: dict[str, set[int]] = {}
        self._writers: dict[int, int] = {}

    def take(self, rule: MergeRule) -> None:
        """Merge a table, after those that it points at.

        Parameters:
            rule: The table, and how its rows are merged.

        Raises:
            MergeRefusedError: Where a row here is another under the same key.
        """
        self._keys[rule.table], self._new[rule.table] = {}, set()
        names = rule.of.columns.keys()
        for batch in iter_batches(self._origin, rule.of):
            rows = [
                self._led_here(rule.of, dict(zip(names, row, strict=True)))
                for row in batch
                if self._comes(rule, names, row)
            ]
            self._merge(rule, rows)

    def _comes(self, rule: MergeRule, names: list[str], row: Sequence[Any]) -> bool:
        if rule.owner is None:
            return True
        (owner,) = rule.of.columns[rule.owner].foreign_keys
        return row[names.index(rule.owner)] in self._new[owner.column.table.name]

    def _led_here(self, table: Table, row: dict[str, Any]) -> dict[str, Any]:
        """The row with its references as they are here."""
        for key in table.foreign_keys:
            name, target = key.parent.name, key.column.table.name
            if row[name] is not None and target != WRITERS:
                row[name] = self._keys[target][row[name]]
        return row

    def _merge(self, rule: MergeRule, rows: list[dict[str, Any]]) -> None:
        existing = self._known(rule, rows)
        new = []
        for row in rows:
            here = existing.get(_key(rule, row))
            settled = Settled.NEW if here is None else self._settled(rule, row, here)
            if settled is Settled.NEW:
                new.append(row)
                continue
            assert here is not None
            self._keys[rule.table][row["id"]] = here["id"]
            if settled is Settled.REPLACED:  # what belongs to it comes with it
                self._new[rule.table].add(row["id"])
        self._add(rule, new)

    def _settled(self, rule: MergeRule, row: dict[str, Any], here: Row) -> Settled:
        special = SETTLED.get(rule.table)
        if special is not None:
            settled = special(self._target, row, here, lambda: self._writer(row["written_by_id"]))
            if settled is not Settled.OPEN:
                return settled
        _refuse_another(rule, row, here)
        return Settled.KNOWN

    def _known(self, rule: MergeRule, rows: list[dict[str, Any]]) -> dict[tuple[Any, ...], Row]:
        """Rows that are here under the keys of `rows`."""
        if not rule.key:
            return {}
        names = rule.of.columns.keys()
        wanted = list(dict.fromkeys(_key(rule, row) for row in rows))
        rows_by_key: dict[tuple[Any, ...], Row] = {}
        own = tuple_(*(rule.of.columns[name] for name in rule.key))
        for some in in_batches(wanted):
            query = select(*stored_columns(rule.of)).where(own.in_(some))
            for values in self._target.execute(query):
                here = dict(zip(names, values, strict=True))
                rows_by_key[_key(rule, here)] = here
        return rows_by_key

    def _add(self, rule: MergeRule, rows: list[dict[str, Any]]) -> None:
        if not rows:
            return
        if rule.table == Pulse.__tablename__:
            leave_in_use(self._target, rows)
        if "id" in rule.of.columns:
            for row, key in zip(rows, reserve_keys(self._target, rule.of, len(rows)), strict=True):
                self._keys[rule.table][row["id"]] = key
                self._new[rule.table].add(row["id"])
                row["id"] = key
        for row in rows:
            row["written_by_id"] = self._writer(row["written_by_id"])
            row[ROW_SHA256] = row_hash(rule.of, row)
        load(self._target, rule.of, [[list(row.values()) for row in rows]])
        self.added[rule.table] += len(rows)
        if rule.table in _HITS:
            self.hits.update((rule.table, row["campaign_id"]) for row in rows)

    def _writer(self, key: int) -> int:
        """Who wrote a row there, as a row of this store: added with the first row that needs it."""
        if key not in self._writers:
            self._writers[key] = self._writer_here(key)
        return self._writers[key]

    def _writer_here(self, key: int) -> int:
        table = metadata.tables[WRITERS]
        row = self._origin.execute(select(table).where(Provenance.id == key)).mappings().one()
        content = {name: value for name, value in row.items() if name not in ("id", ROW_SHA256)}
        here = self._target.scalar(select(Provenance.id).filter_by(**content).limit(1))
        if here is not None:
            return int(here)
        (new_key,) = reserve_keys(self._target, table, 1)
        new = {**content, "id": new_key}
        new[ROW_SHA256] = row_hash(table, new)
        load(self._target, table, [[[new[column.name] for column in table.columns]]])
        return new_key


def _key(rule: MergeRule, row: Row) -> tuple[Any, ...]:
    return tuple(row[name] for name in rule.key)


def _refuse_another(rule: MergeRule, row: Row, here: Row) -> None:
    theirs, ours = rule.same(row), rule.same(here)
    for name, value in theirs.items():
        if value != ours[name]:
            what = (
                f"{name.removesuffix('_id')} differs"
                if name.endswith("_id")
                else f"{name} is {ours[name]!r:.60} here, {value!r:.60} in the file"
            )
            raise MergeRefusedError(
                f"{_row_title(rule, row)} is another one in this store: {what}; {rule.advice}"
            )


def _row_title(rule: MergeRule, row: Row) -> str:
    """A row by its natural key, in words."""
    named = [f"{name} {row[name]!r}" for name in rule.key if not name.endswith("_id")]
    return f"{rule.table.removesuffix('s').replace('_', ' ')} ({', '.join(named)})"


@dataclass(frozen=True)
class ImportReport:
    """The campaigns of the file, the rows that were new by table, what of the file no import takes,
    and recordings that were discarded here and came back with it."""

    campaigns: tuple[str, ...]
    added: dict[str, int]
    left_behind: tuple[str, ...]
    discarded: tuple[str, ...] = ()


def import_file(store: Store, file: Path, progress: Progress | None = None) -> ImportReport:
    """Merge the campaigns of a file into the store, in one transaction.

    Parameters:
        store: The open store that takes the campaigns.
        file: The path of the file, as `export_campaign` wrote it.
        progress: Called with (done, total, what) while series are checked, in samples; by default
            progress is not reported.

    Raises:
        ForeignFileError: For a file that does not pass its checks or breaks a rule of the store;
            nothing is changed then.
        StoreVersionError: As `opened_file`.
        MergeRefusedError: Where the store holds another thing under the same name; nothing is
            changed then.
    """
    with opened_file(file, progress) as origin:
        campaigns = tuple(origin.scalars(select(Campaign.name).order_by(Campaign.name)))
        try:
            added, discarded = store.write(
                lambda session: _merged(store, session, origin), idempotent=True
            )
        except IntegrityError as error:
            raise ForeignFileError(
                f"{file} is refused by a rule of the store: {first_line(error)}"
            ) from error
        return ImportReport(campaigns, added, tuple(_left_behind(origin)), tuple(discarded))


def _merged(store: Store, session: Session, origin: Connection) -> tuple[dict[str, int], list[str]]:
    added = merge(store, session, origin)
    return added, settle_imported(session, store.written_by(session)) if added else []


def merge(store: Store, session: Session, origin: Connection) -> dict[str, int]:
    """Merge a file that has passed its checks, within a transaction of the caller's.

    Parameters:
        store: The open store that takes the campaigns.
        session: A session of `writing` of this store.
        origin: The connection to the file that `opened_file` gives.

    Returns:
        The number of new rows by table; a table without any is left out.

    Raises:
        MergeRefusedError: As `import_file`.
    """
    target = session.connection()
    _refuse_aliases(origin, target)
    merged = Merge(origin, target)
    for rule in RULES:
        merged.take(rule)
    for campaign in sorted({campaign for _, campaign in merged.hits}):
        count_added(target, campaign, *(merged.hits[table, campaign] for table in _HITS))
    if merged.added:
        store.written_by(session)  # of the rows, their own writers tell; this one, of the import
    return dict(merged.added)


def _refuse_aliases(origin: Connection, target: Connection) -> None:
    """A material that has another's name here: which of the two a table means would depend on who
    reads it."""
    query = select(MaterialAlias.alias, Material.name).join(
        Material, MaterialAlias.material_id == Material.id
    )
    aliases = {alias.lower(): name for alias, name in target.execute(query)}
    for name in origin.scalars(select(Material.name)):
        other = aliases.get(name.lower())
        if other not in (None, name):
            raise MergeRefusedError(
                f"material {name!r} of the file is another name of {other!r} "
                f"in this store; one of them needs another"
            )


def _left_behind(origin: Connection) -> list[str]:
    counts = {
        name: origin.scalar(select(func.count()).select_from(metadata.tables[name]))
        for name in sorted(STAY_BEHIND)
    }
    return [f"{count} rows of {name}" for name, count in counts.items() if count]
