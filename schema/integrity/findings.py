"""What a check has found wrong in a store, and what to do about it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from sqlalchemy import Connection

from ..rows import ProgressBar

#: In this order a place is told; other keys follow.
_PLACE = ("campaign", "recording", "channel", "chunk", "table", "row")


@dataclass(frozen=True)
class IntegrityFinding:
    """`place` names what is concerned: campaign, recording, channel, chunk, table, row, or what
    else there is."""

    check: str
    message: str
    advice: str
    place: Mapping[str, Any] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        return {"check": self.check, **self.place, "message": self.message, "advice": self.advice}

    @property
    def what(self) -> str:
        """Check, place and message in one line."""
        keys = [key for key in _PLACE if key in self.place] + [
            key for key in self.place if key not in _PLACE
        ]
        where = ", ".join(f"{key} {self.place[key]}" for key in keys)
        return f"{self.check}: {where}{': ' if where else ''}{self.message}"

    def __str__(self) -> str:
        return f"{self.what}; {self.advice}"


#: A select of any columns, whose types SQLAlchemy's versions write differently.
Query = Any

#: Restoring is right whatever was damaged, and often all that is left.
RESTORE = "restore the store from its backup (docs/reference/store.md)"
#: Of the kept numbers of impacts and shots.
COUNT_ANEW = f"if nobody removed rows by hand, pyroshock db upgrade counts anew; else {RESTORE}"


@dataclass(frozen=True)
class Scope:
    """One campaign by its key, or the whole store (None); `bar` is told of what takes time."""

    campaign: int | None = None
    bar: ProgressBar = field(default_factory=lambda: ProgressBar(None, 0))

    def within(self, query: Query, campaign: Any) -> Query:
        """The query's rows of this scope.

        Parameters:
            query: The select of the rows.
            campaign: The column that holds the campaign's key.
        """
        return query if self.campaign is None else query.where(campaign == self.campaign)

    def iter_rows(
        self, connection: Connection, query: Query, campaign: Any, key: Any, page: int
    ) -> Iterator[Any]:
        """The query's rows of this scope in the order of their key, a page at a time: other queries
        may run in between.

        Parameters:
            connection: A connection to the store.
            query: The select of the rows. It has the key as its column "id".
            campaign: The column that holds the campaign's key.
            key: The column of the key.
            page: The largest number of rows that are fetched at a time.
        """
        query, after = self.within(query, campaign).order_by(key).limit(page), 0
        while rows := connection.execute(query.where(key > after)).all():
            yield from rows
            after = rows[-1].id
