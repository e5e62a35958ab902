"""Killed at any moment, the store is consistent, and a repeat completes the campaign."""

from __future__ import annotations

import time

import numpy as np
import pytest
from numpy.typing import NDArray
from support.records.campaigns import hammer_campaign
from support.stores.stores import assert_whole, content, ingested, start_cli

HITS = 2
KILLS_PER_STORE = 3


def kill_many_times(tmp_path, kills: int, jobs: str, seed: int) -> int:
    """Kill an ingest `kills` times at random moments, look at the store after each, then finish it.

    Returns how often the kill came after work had begun and before it was over.
    """
    folder = hammer_campaign(tmp_path / "c", recordings=16, hits=HITS)
    undisturbed = f"sqlite:///{tmp_path / 'undisturbed.db'}"
    began = time.perf_counter()
    process = start_cli("ingest", folder, "--db", undisturbed, "--jobs", jobs)
    _, errors = process.communicate()
    assert process.returncode == 0, errors
    seconds = time.perf_counter() - began
    expected = content(undisturbed)
    moments = _spread(kills, np.random.default_rng(seed)) * seconds
    struck = 0
    url = f"sqlite:///{tmp_path / 'killed.db'}"
    for number, moment in enumerate(moments):
        if number % KILLS_PER_STORE == 0:
            # a new store now and then: the making of one is a moment too, and a late one has little left to do
            url = f"sqlite:///{tmp_path / f'killed-{number}.db'}"
        process = start_cli("ingest", folder, "--db", url, "--jobs", jobs)
        time.sleep(moment)
        struck += process.poll() is None
        process.kill()
        process.communicate()
        if (tmp_path / url.rsplit("/", 1)[1]).exists():
            _look(url)
        if number % KILLS_PER_STORE == KILLS_PER_STORE - 1 or number == kills - 1:
            ingested(url, folder)
            assert content(url) == expected
    return struck


def _spread(kills: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Random shares of the whole time, one in each of as many equal parts of it: a few leave no part out."""
    return rng.permutation(0.1 + 0.85 * (np.arange(kills) + rng.uniform(size=kills)) / kills)


def _look(url: str) -> None:
    from pyroshock.schema.session import StoreError

    try:
        assert_whole(url, HITS)
    except StoreError as error:
        # killed before the first table was there: an empty place, as if nothing had begun
        assert "no store at" in str(error)


@pytest.mark.parametrize("jobs", [pytest.param("1", marks=pytest.mark.slow), "2"])
def test_killed_ingest_is_consistent_and_completes(tmp_path, jobs):
    assert kill_many_times(tmp_path, 2, jobs, seed=int(jobs)) >= 1


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_killed_a_hundred_times(tmp_path, jobs):
    assert kill_many_times(tmp_path, 100, jobs, seed=10 + int(jobs)) >= 50
