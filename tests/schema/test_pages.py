"""Pages of a listing: every match once and in order, wherever the matches lie."""

from __future__ import annotations

import datetime as dt

import pytest
from pyroshock.schema.campaigns import Campaign, Configuration
from pyroshock.schema.conditions import KeySpan, iter_pages, span_of
from pyroshock.schema.impacts import Impact
from pyroshock.schema.session import Writer, open_store
from sqlalchemy import select

#: Key of the impact -> its configuration: two clusters far apart, a stray, and a dense stretch.
PLACES = {
    **dict.fromkeys(range(10, 300), 1),
    **dict.fromkeys(range(1000000, 1000040), 2),
    5_000: 2,
    **dict.fromkeys(range(2000, 4000, 7), 3),
}


@pytest.fixture(scope="module")
def scattered(new_database):
    with open_store(new_database(), Writer("test", "0"), create=True) as store:
        with store.writing() as session:
            for key in (1, 2, 3):
                session.add(Campaign(id=key, name=str(key), kind="hammer", date=dt.date(2026, 1, 1), fingerprint="x"))
                session.add(Configuration(id=key, fingerprint=str(key)))
            session.flush()
            session.add_all(
                Impact(id=key, campaign_id=configuration, run=key, repetition=1, configuration_id=configuration)
                for key, configuration in PLACES.items()
            )
        yield store


@pytest.mark.parametrize("page", [1, 50, 2000])
@pytest.mark.parametrize("wanted", [[1], [2], [3], [1, 2], [1, 2, 3]])
def test_every_match_comes_once_and_in_order(scattered, wanted, page):
    with scattered.reading() as session:
        query = select(Impact.id).where(Impact.configuration_id.in_(wanted))
        pages = list(iter_pages(session, query, Impact.id, span_of(session, Impact, None, wanted), page))
    found = [row["id"] for rows in pages for row in rows]
    assert found == sorted(key for key, configuration in PLACES.items() if configuration in wanted)
    assert all(0 < len(rows) <= page for rows in pages)


def test_span_is_where_the_rows_lie(scattered):
    with scattered.reading() as session:
        assert span_of(session, Impact, None, None) == KeySpan(10, 1_000_039)
        assert span_of(session, Impact, 3, None) == KeySpan(2_000, 3_995)
        assert span_of(session, Impact, None, [2]) == KeySpan(5_000, 1_000_039)
        assert span_of(session, Impact, 1, [2]).first > span_of(session, Impact, 1, [2]).last
        nothing = span_of(session, Impact, None, [99])
        assert list(iter_pages(session, select(Impact.id), Impact.id, nothing, 10)) == []
