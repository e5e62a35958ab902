"""Pulses thinned in the database: as many as asked for, evenly, and only those in use."""

from __future__ import annotations

from itertools import pairwise

import pytest
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.configurations import configuration_id
from pyroshock.schema.impacts import ExtractionSettingsRow, Impact
from pyroshock.schema.known_factors import RunLevel
from pyroshock.schema.listings import Condition, list_pulse_keys
from pyroshock.schema.session import Writer, open_store
from support.stores.recorded import WHEN, pulse_row

IMPACTS = 97


@pytest.fixture(scope="module")
def store(new_database):
    """97 impacts with an earlier and a current pulse each, one in three of steel; a last one without a pulse."""
    with open_store(new_database(), Writer("test", "0"), create=True) as store:
        with store.writing() as session:
            session.add(Campaign(id=1, name="c", kind="hammer", date=WHEN.date(), fingerprint="c"))
            session.add_all(
                ExtractionSettingsRow(id=i, fingerprint=str(i), code_version=1, settings={}) for i in (1, 2)
            )
            keys = [configuration_id(session, [RunLevel("tip_material", tip)]) for tip in ("steel", "delrin")]
            for i in range(1, IMPACTS + 2):
                key = keys[i % 3 > 0]
                session.add(Impact(id=i, campaign_id=1, run=i, repetition=1, configuration_id=key))
            session.flush()
            for settings in (1, 2):
                own = {"settings_id": settings, "current": settings == 2}
                keys_of = ((i, 1000 * settings + i) for i in range(1, IMPACTS + 1))
                session.add_all(pulse_row(i, id=key, peak_force_n=float(i), **own) for i, key in keys_of)
        yield store


def keys(store, most, *where, campaign="c"):
    with store.reading() as session:
        return list_pulse_keys(session, campaign, where, most)


@pytest.mark.parametrize("most", [1, 2, 10, 50, 96])
def test_as_many_as_asked_for_in_even_steps(store, most):
    found, total = keys(store, most)
    assert (len(found), total, found[0]) == (most, IMPACTS, 2001)
    steps = {b - a for a, b in pairwise(found)}
    assert steps <= {IMPACTS // most, IMPACTS // most + 1}


@pytest.mark.parametrize("most", [97, 98, 5000])
def test_all_where_they_fit(store, most):
    assert keys(store, most) == ([2000 + i for i in range(1, IMPACTS + 1)], IMPACTS)


def test_filter_is_taken_before_the_thinning(store):
    found, total = keys(store, 8, Condition("tip_material", "=", "steel"), Condition("peak_force_n", ">", 30.0))
    assert (len(found), total) == (8, 22)
    assert all(key % 1000 % 3 == 0 and key % 1000 > 30 for key in found)
    assert keys(store, 8, Condition("tip_material", "=", "gold")) == ([], 0)
    with pytest.raises(ValueError, match="most is 0"):
        keys(store, 0)
