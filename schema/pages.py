"""A listing's rows page by page, at a cost that follows what is listed and not what is stored.

A database that is asked for the first rows of a filter in order of their key either walks the keys, which is slow
where matches are rare, or collects and sorts every match, which is slow where they are many; and it guesses which. So
it is asked for a window of keys at a time: the windows begin at the first key that can match, end at the last one, and
widen or narrow until a window holds about a page.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Select, func, select
from sqlalchemy.orm import Session

from .campaigns import Configuration
from .impacts import Impact
from .shots import Shot

Table = type[Impact] | type[Shot]

#: The first page is small, for a caller who wants a few rows; each further one four times as large, up to the limit.
_FIRST_ROWS, _GROWTH = 128, 4
#: A window without a match is followed by one this many times as wide.
_LEAP = 16


@dataclass(frozen=True)
class KeySpan:
    """Keys `first` to `last` hold every match; none when `last` < `first`."""

    first: int
    last: int

    def beyond(self, key: int | None) -> KeySpan:
        """The part after `key`; all where it is None."""
        return self if key is None else KeySpan(max(self.first, key + 1), self.last)


def span_of(session: Session, table: Table, campaign_id: int | None, configurations: list[int] | None) -> KeySpan:
    """Where rows of a campaign (None: all) with one of `configurations` (None: any) can lie.

    Two look-ups in an index for each configuration: asked for the least key of many, a database reads them all. And
    each in a query of its own within the one that is sent: of two in one, a database reads the whole table.
    """
    ends = [select(f(table.id)) for f in (func.min, func.max)]
    if campaign_id is not None:
        ends = [end.where(table.campaign_id == campaign_id) for end in ends]
    query = select(*(end.scalar_subquery() for end in ends))
    if configurations is None:
        return _span(*session.execute(query).one())
    conditions = [
        select(f(table.id)).where(table.configuration_id == Configuration.id).scalar_subquery()
        for f in (func.min, func.max)
    ]
    query = query.add_columns(func.min(conditions[0]), func.max(conditions[1])).where(
        Configuration.id.in_(configurations)
    )
    first, last, *other = session.execute(query).one()
    span, of_them = _span(first, last), _span(*other)
    return KeySpan(max(span.first, of_them.first), min(span.last, of_them.last))


def _span(first: int | None, last: int | None) -> KeySpan:
    return KeySpan(1, 0) if first is None or last is None else KeySpan(first, last)


def iter_pages(
    session: Session, query: Select[Any], key: Any, span: KeySpan, page: int
) -> Iterator[list[dict[str, Any]]]:
    """The query's rows in order of `key` (its column "id"), at most `page` at a time; no page is empty."""
    limit = min(_FIRST_ROWS, page)
    after, width = span.first - 1, 2 * limit
    while after < span.last:
        window = query.where(key > after, key <= min(after + width, span.last)).order_by(key).limit(limit)
        rows = [dict(row) for row in session.execute(window).mappings()]
        if rows:
            yield rows
        end = rows[-1]["id"] if len(rows) == limit else after + width
        passed, after = end - after, end
        limit = min(_GROWTH * limit, page)
        width = min(_LEAP * width, 2 * limit * passed // len(rows)) if rows else _LEAP * width
