"""Two processes and one store: nothing is lost, nothing is doubled, nobody sees an error."""

from __future__ import annotations

import pytest
from support.processes.crowd import complaints, together
from support.records.campaigns import gun_campaign, hammer_campaign
from support.stores.stores import assert_whole, content, ingested, opened, pyroshock


@pytest.fixture
def run_together(tmp_path):
    """Commands at the same moment, each in a process of its own that is forked from one with all imports."""

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


@pytest.mark.slow  # the default run has tests/clients/test_few_clients.py, which asks more
def test_different_folders_at_once(database_url, tmp_path, sequential, run_together):
    folders = [hammer_campaign(tmp_path / f"c{i}", 6, name=f"c{i}", seed=i) for i in range(2)]
    folders.append(gun_campaign(tmp_path / "gun", 20, name="gun"))
    run_together(*[("ingest", folder, "--db", database_url, "--jobs", "1") for folder in folders])
    assert content(database_url) == sequential(*folders)


def test_store_made_by_all_at_once(database_url, run_together):
    run_together(*[("init", "--db", database_url)] * 4)
    assert pyroshock("campaigns", "--db", database_url).exit_code == 0
