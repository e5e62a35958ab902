"""Storing costs statements by the recording, not by the hit: each is a way to a server and back."""

from __future__ import annotations

import pytest
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.impacts import Impact
from sqlalchemy import select
from support.records.campaigns import gun_campaign, hammer_campaign
from support.stores.counting import statements

#: Of a recording whose configuration is known: BEGIN; whether it is there, was set aside, and its campaign; itself;
#: its channels and their keys; the series of each channel (here one); configurations, impacts and their keys; settings
#: and pulses; other recordings with the same samples. COMMIT is not counted.
OF_A_RECORDING = 14


@pytest.fixture
def asked(any_store, tmp_path):
    """`asked(name, recordings, hits)`: how many statements the ingest of such a campaign takes."""

    def count(name, recordings=2, hits=2):
        folder = hammer_campaign(tmp_path / name, recordings, hits, name=name)
        with statements(any_store) as statements_run:
            ingest_folder(any_store, folder, jobs=1)
        return len(statements_run)

    count("first", 6)  # its configurations are known to all later ones
    return count


def test_hits_cost_no_statement(asked):
    assert asked("many", hits=7) == asked("few", hits=2)


def test_recording_costs_few(asked):
    assert asked("six", 6) - asked("two", 2) <= 4 * OF_A_RECORDING


def test_shots_without_recording_cost_no_statement_each(any_store, tmp_path):
    ingest_folder(any_store, gun_campaign(tmp_path / "first", 9, name="first"), jobs=1)
    asked = []
    for shots in (3, 9):
        folder = gun_campaign(tmp_path / f"{shots}", shots, name=f"{shots}")
        with statements(any_store) as statements_run:
            ingest_folder(any_store, folder, jobs=1)
        asked.append(len(statements_run))
    assert asked[0] == asked[1]


def test_keys_follow_the_order_of_hits(any_store, tmp_path):
    ingest_folder(any_store, hammer_campaign(tmp_path / "c", 3, 7), jobs=1)
    with any_store.reading() as session:
        order = session.execute(select(Impact.run, Impact.repetition).order_by(Impact.id)).all()
    assert order == [(run, repetition) for run in (1, 2, 3) for repetition in range(1, 8)]
