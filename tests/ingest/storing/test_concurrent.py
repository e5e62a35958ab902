"""Several processes on one store, a kill at any moment, and the statements that storing costs."""

from __future__ import annotations

import itertools
import time

import numpy as np
import pytest
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.impacts import Impact
from pyroshock.schema.session import StoreError
from sqlalchemy import select
from support.processes.crowd import complaints, together
from support.records.campaigns import gun_campaign, hammer_campaign
from support.stores.stores import (
    assert_whole,
    content,
    ingested,
    opened,
    pyroshock,
    start_cli,
    statements,
)


@pytest.fixture
def run_together(tmp_path):
    """Commands at the same moment, each in a process of its own that is forked from one with all
    imports."""

    def run(*commands):
        assert complaints(together(tmp_path / "said", [[command] for command in commands])) == []

    return run


@pytest.fixture
def sequential(tmp_path):
    """`sequential(*folders)`: what an undisturbed ingest stores."""

    def store(*folders):
        url = f"sqlite:///{tmp_path / 'sequential.db'}"
        ingested(url, *folders)
        return content(url)

    return store


def test_same_folder_at_once_while_others_read(database_url, tmp_path, sequential, run_together):
    folder = hammer_campaign(tmp_path / "c", recordings=8)
    with opened(database_url, create=True):
        pass
    ingests = [("ingest", folder, "--db", database_url, "--jobs", "1")] * 2
    run_together(*ingests, *[("impacts", "--db", database_url, "--json")] * 2)
    assert content(database_url) == sequential(folder)
    assert_whole(database_url, 2)


def test_store_made_by_all_at_once(database_url, run_together):
    run_together(*[("init", "--db", database_url)] * 4)
    assert pyroshock("campaigns", "--db", database_url).exit_code == 0


HITS = 2


#: Of a recording whose configuration is known: BEGIN; whether it is there, and its campaign; the
#: keys of all its rows; itself; its channels; their series; configurations and impacts; pulses;
#: other recordings with the same samples, and with the same file; the numbers of the campaign, read
#: and written. COMMIT is not counted.
OF_A_RECORDING = 14


@pytest.fixture
def asked(any_store, tmp_path):
    """`asked(name, recordings, hits)`: how many statements the ingest of such a campaign takes.

    Each campaign has samples of its own: a file that another campaign holds too is a finding, hence
    two statements more, and whether two files of the same samples are the same depends on the
    second, which MATLAB's header states.
    """
    seeds = itertools.count(1)

    def count(name, recordings=2, hits=2):
        folder = hammer_campaign(tmp_path / name, recordings, hits, name=name, seed=next(seeds))
        with statements(any_store) as statements_run:
            ingest_folder(any_store, folder, jobs=1)
        return len(statements_run)

    count(
        "first", 6, hits=1
    )  # its configurations are known to all later ones, and its recordings are none of theirs
    return count


def test_hits_cost_no_statement_and_recordings_few(asked):
    assert asked("many", hits=7) == asked("few", hits=2)
    assert asked("six", 6) - asked("two", 2) <= 4 * OF_A_RECORDING


def test_shots_without_recording_cost_no_statement_each(any_store, tmp_path):
    ingest_folder(any_store, gun_campaign(tmp_path / "first", 9, name="first"), jobs=1)
    statement_counts = []
    for shots in (3, 9):
        folder = gun_campaign(tmp_path / f"{shots}", shots, name=f"{shots}")
        with statements(any_store) as statements_run:
            ingest_folder(any_store, folder, jobs=1)
        statement_counts.append(len(statements_run))
    assert statement_counts[0] == statement_counts[1]


def test_keys_follow_the_order_of_hits(any_store, tmp_path):
    ingest_folder(any_store, hammer_campaign(tmp_path / "c", 3, 7), jobs=1)
    with any_store.reading() as session:
        order = session.execute(select(Impact.run, Impact.repetition).order_by(Impact.id)).all()
    assert order == [(run, repetition) for run in (1, 2, 3) for repetition in range(1, 8)]


@pytest.mark.parametrize("jobs", [pytest.param("1", marks=pytest.mark.slow), "2"])
def test_killed_ingest_is_consistent_and_completes(tmp_path, jobs):
    """Two kills, one in either half of the work; tests/faults/test_killed.py has a hundred, on
    either engine."""
    folder, killed = (
        hammer_campaign(tmp_path / "c", recordings=16, hits=HITS),
        tmp_path / "killed.db",
    )
    undisturbed, url = f"sqlite:///{tmp_path / 'undisturbed.db'}", f"sqlite:///{killed}"
    began = time.perf_counter()
    process = start_cli("ingest", folder, "--db", undisturbed, "--jobs", jobs)
    _, errors = process.communicate()
    assert process.returncode == 0, errors
    seconds, struck, rng = time.perf_counter() - began, 0, np.random.default_rng(int(jobs))
    for share in rng.permutation(0.1 + 0.85 * (np.arange(2) + rng.uniform(size=2)) / 2):
        process = start_cli("ingest", folder, "--db", url, "--jobs", jobs)
        time.sleep(share * seconds)
        struck += process.poll() is None
        process.kill()
        process.communicate()
        try:
            assert not killed.exists() or assert_whole(url, HITS) is None
        except StoreError as error:
            # killed before the first table was there: an empty place, as if nothing had begun
            assert "no store at" in str(error)
    ingested(url, folder)
    assert content(url) == content(undisturbed)
    assert struck >= 1
