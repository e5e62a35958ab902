"""Rows of one store into another, by what they are known by: what is there stays, what is new gets a key of its own."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

from sqlalchemy import Connection, Table, select, tuple_

from ..care.loading import load
from ..care.rows import iter_batches, stored_columns
from ..care.sequences import reserve_keys
from ..engine import StoreError
from ..impacts import Pulse
from ..provenance import Provenance
from ..tables import metadata
from .campaign_rows import WRITERS
from .merge_overrides import SETTLED, Settled, leave_in_use
from .merge_rules import MergeRule, Row

#: Keys in one question: SQLite allows a limited number of variables.
_ASKED = 500


class MergeRefusedError(StoreError):
    """The store holds another thing under the same name; the message shows both."""


class Merge:
    """One merge of `origin` into `target`, within the transaction that is open there.

    `added` counts new rows by table; `keys` leads from keys there to keys here, for every table that others point at.
    """

    def __init__(self, origin: Connection, target: Connection) -> None:
        self.added: Counter[str] = Counter()
        self._origin = origin
        self._target = target
        self._keys: dict[str, dict[int, int]] = {}
        self._new: dict[str, set[int]] = {}
        self._writers: dict[int, int] = {}

    def take(self, rule: MergeRule) -> None:
        """Merge a table. Raises `MergeRefusedError` where a row here is another under the same key."""
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
        for i in range(0, len(wanted), _ASKED):
            own = tuple_(*(rule.of.columns[name] for name in rule.key))
            query = select(*stored_columns(rule.of)).where(own.in_(wanted[i : i + _ASKED]))
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
        load(self._target, rule.of, [[list(row.values()) for row in rows]])
        self.added[rule.table] += len(rows)

    def _writer(self, key: int) -> int:
        """Who wrote a row there, as a row of this store: added with the first row that needs it."""
        if key not in self._writers:
            self._writers[key] = self._writer_here(key)
        return self._writers[key]

    def _writer_here(self, key: int) -> int:
        table = metadata.tables[WRITERS]
        row = self._origin.execute(select(table).where(Provenance.id == key)).mappings().one()
        content = {name: value for name, value in row.items() if name != "id"}
        here = self._target.scalar(select(Provenance.id).filter_by(**content).limit(1))
        if here is not None:
            return int(here)
        (new_key,) = reserve_keys(self._target, table, 1)
        load(self._target, table, [[[{**content, "id": new_key}[column.name] for column in table.columns]]])
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
            raise MergeRefusedError(f"{_called(rule, row)} is another one in this store: {what}; {rule.advice}")


def _called(rule: MergeRule, row: Row) -> str:
    """A row by its natural key, in words."""
    named = [f"{name} {row[name]!r}" for name in rule.key if not name.endswith("_id")]
    return f"{rule.table.removesuffix('s').replace('_', ' ')} ({', '.join(named)})"
