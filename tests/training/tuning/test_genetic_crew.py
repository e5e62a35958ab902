"""A population whose candidates are tried by other processes."""

from __future__ import annotations

import pytest
from pyroshock.parallel.executor import HERE, ExecutorConfig
from pyroshock.training.tuning.genetic import Search, SearchJournal, run_search
from support.processes import chores
from support.processes.dask_clusters import dask_cluster

SEARCH = Search((4, 9, 7), population=6, generations=2)


@pytest.mark.parametrize("executor", [HERE, ExecutorConfig(jobs=2)], ids=["here", "two"])
def test_any_crew_finds_the_same(executor, tmp_path):
    """And keeps the journal here."""
    alone = run_search(SEARCH, chores.away, 3, SearchJournal(None, {}))
    journal = SearchJournal(tmp_path / "journal", {})
    assert run_search(SEARCH, chores.away, 3, journal, executor=executor) == alone
    assert len(SearchJournal(tmp_path / "journal", {}).values) == alone.evaluated


def test_a_cluster_finds_the_same(tmp_path):
    alone = run_search(SEARCH, chores.away, 3, SearchJournal(None, {}))
    with dask_cluster(tmp_path, 2) as cluster:
        executor = ExecutorConfig("dask", scheduler=cluster.address)
        assert (
            run_search(SEARCH, chores.away, 3, SearchJournal(None, {}), executor=executor) == alone
        )


def test_what_was_found_costs_no_worker(tmp_path):
    path = tmp_path / "journal"
    result = run_search(SEARCH, chores.away, 3, SearchJournal(path, {}))
    content = path.read_bytes()
    assert (
        run_search(
            SEARCH,
            chores.away,
            3,
            SearchJournal(path, {}),
            executor=ExecutorConfig("dask", scheduler="tcp://nobody:1"),
        )
        == result
    )
    assert path.read_bytes() == content
