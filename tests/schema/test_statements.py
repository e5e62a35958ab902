"""How often the database is asked, where each question would be felt."""

from __future__ import annotations

import datetime as dt

import pytest
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.conditions import Condition
from pyroshock.schema.configurations import configuration_ids
from pyroshock.schema.impacts import ExtractionSettingsRow, Impact
from pyroshock.schema.known_factors import RunLevel
from pyroshock.schema.listings import list_pulse_keys
from pyroshock.schema.session import Writer, open_store
from support.stores.counting import statements
from support.stores.recorded import pulse_row

TIPS = ("steel", "delrin", "PLA")


@pytest.fixture
def store(tables_url):
    with open_store(tables_url, Writer("test", "0"), create=True) as store:
        yield store


def combinations(radii):
    """As many configurations as radii, of six factors each."""
    rest = [RunLevel(f"factor {i}", "1.0", 1.0) for i in range(4)]
    return [[RunLevel("tip", TIPS[i % 3]), RunLevel("radius", f"{i}.0", float(i)), *rest] for i in range(radii)]


def configurations(store, radii):
    with statements(store) as said:
        keys = store.write(lambda session: configuration_ids(session, combinations(radii)))
    return keys, len(said)


def test_known_configurations_are_asked_for_at_once(store):
    keys, _ = configurations(store, 30)
    again, few = configurations(store, 3)
    everyone, many = configurations(store, 30)
    assert (again, everyone, few) == (keys[:3], keys, many)


def test_new_configuration_takes_few_statements_for_all_its_levels(store):
    """The configuration: looked for, within a savepoint, its levels; of the levels only the new radius costs more."""
    configurations(store, 10)
    _, of_one = configurations(store, 11)
    _, of_four = configurations(store, 15)
    assert of_four - of_one <= 3 * 10


def test_pulses_of_a_small_store_are_not_counted_first(store):
    with store.writing() as session:
        session.add(Campaign(id=1, name="c", kind="hammer", date=dt.date(2026, 1, 1), fingerprint="c"))
        session.add(ExtractionSettingsRow(id=1, fingerprint="1", code_version=1, settings={}))
        (key,) = configuration_ids(session, [[RunLevel("tip", "steel")]])
        session.add_all(Impact(id=i, campaign_id=1, run=i, repetition=1, configuration_id=key) for i in range(1, 9))
        session.flush()
        session.add_all(pulse_row(i, id=i) for i in range(1, 9))
    where = (Condition("tip", "=", "steel"),)
    with store.reading() as session:
        with statements(store) as of_all:
            assert list_pulse_keys(session, None, where, 8) == ([*range(1, 9)], 8)
        with statements(store) as of_some:
            assert list_pulse_keys(session, None, where, 4) == ([1, 3, 5, 7], 8)
    assert [sum("count(" in each for each in said) for said in (of_all, of_some)] == [0, 1]
